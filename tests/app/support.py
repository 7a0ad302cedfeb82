"""What the end-to-end tests share: MERL files, running merl-scan, reading what it wrote."""

import csv
import json
import os
import pathlib
import random
import re
import struct
import subprocess
import tempfile
import time
import unittest

PROGRAM = os.environ["MERL_SCAN"]

GRID = (6, 5, 8)  # theta_h x theta_d x phi_d, small enough that everything takes no time

# Exit statuses, as app/exit_status.h has them.
SUCCESS, FAILED, USAGE, INPUT, DEVICE, OUTPUT, RESOURCE = range(7)
INTERRUPTED = 128

RESULTS = ["disagreements.csv", "pairs.csv", "selection.csv", "summary.json"]


def voxels(grid):
    return grid[0] * grid[1] * grid[2]


def samples(seed, grid=GRID):
    """The stored numbers of a made-up material: red, green and blue plane, dark to bright."""
    numbers = random.Random(seed)
    colour = [numbers.uniform(4, 8) for _ in range(3)]
    return [numbers.lognormvariate(c, 1) for c in colour for _ in range(voxels(grid))]


def merl_bytes(numbers, grid=GRID):
    return struct.pack("<3i", *grid) + struct.pack(f"<{len(numbers)}d", *numbers)


def write_database(directory, materials, grid=GRID):
    """`materials`: a dictionary from name to stored numbers, or how many to make up."""
    if isinstance(materials, int):
        materials = {f"m{i:02}": samples(i, grid) for i in range(materials)}
    directory.mkdir()
    for name, numbers in materials.items():
        (directory / f"{name}.binary").write_bytes(merl_bytes(numbers, grid))
    return directory


def read_csv(path):
    """The header and the rows, all as text."""
    with open(path, newline="", encoding="utf-8", errors="surrogateescape") as file:
        header, *rows = csv.reader(file)
    return header, rows


def read_json(path):
    def unique(pairs):
        assert len(dict(pairs)) == len(pairs), "a key appears twice"
        return dict(pairs)

    with open(path, encoding="utf-8") as file:
        return json.load(file, object_pairs_hook=unique)


def visible(text):
    """The text as terminals and pages show it: what nobody sees as \\xNN, byte by byte."""
    hidden = "[\0-\x1f\x7f-\x9f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\U000e0000-\U000e0fff]"
    return re.sub(hidden, lambda m: "".join(f"\\x{byte:02x}" for byte in m[0].encode()), text)


def tree(directory):
    """Everything below a directory, hidden or not, with the content of the files."""
    return {
        path.relative_to(directory): path.read_bytes() if path.is_file() else None
        for path in directory.rglob("*")
    }


class Case(unittest.TestCase):
    """A test with an empty directory `self.work`, in which the program runs."""

    warns = False  # whether its databases look like broken copies, so that the program warns of them

    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.work = pathlib.Path(scratch.name)
        self.user = None

    def drop_privileges(self):
        """From here on the program runs as somebody whom permissions stop: root they do not."""
        if os.geteuid() == 0:
            self.user = 65534
            self.work.chmod(0o755)
            try:
                self.run_program("--version")
            except PermissionError as error:
                self.skipTest(f"root, and nobody else may run the program: {error}")

    def run_program(self, *arguments, **changes):
        """`changes` are environment variables."""
        return subprocess.run(
            [PROGRAM, *map(str, arguments)],
            cwd=self.work,
            user=self.user,
            env={**os.environ, **changes},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            errors="surrogateescape",
            timeout=300,
            check=False,
        )

    def assert_success(self, *arguments, **changes):
        """Runs the program, which must succeed and complain of nothing; returns its output."""
        result = self.run_program(*arguments, **changes)
        complaints = [line for line in result.stderr.splitlines()
                      if not (self.warns and line.startswith("merl-scan: warning: "))]
        self.assertEqual((result.returncode, complaints), (SUCCESS, []))
        return result.stdout

    def scan(self, *options, out="out"):
        """Runs a scan that must succeed; returns the directory of its results."""
        self.assert_success("scan", "--out", out, *options)
        return self.work / out

    def assert_refused(self, status, words, *arguments, **changes):
        """Runs the program, which must fail with this status, say why in one line that has all
        these words, and leave no trace. Returns the line."""
        before = tree(self.work)
        result = self.run_program(*arguments, **changes)
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(result.stdout, "")
        line = self.only_line(result.stderr)
        self.assertTrue(line.startswith("merl-scan: "), line)
        for word in words:
            self.assertIn(word, line)
        self.assertEqual(tree(self.work), before)
        return line

    def only_line(self, text):
        self.assertTrue(text.endswith("\n"), repr(text))
        lines = text.splitlines()
        self.assertEqual(len(lines), 1, text)
        return lines[0]


class Running:
    """The program at work in the directory of a test, until it is told to stop."""

    def __init__(self, case, *arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **changes):
        self.case = case
        self.start = time.monotonic()
        self.process = subprocess.Popen(
            [PROGRAM, *arguments], cwd=case.work, stdin=subprocess.DEVNULL, text=True,
            env={**os.environ, **changes}, stdout=stdout, stderr=stderr,
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def seconds(self):
        return time.monotonic() - self.start

    def wait_for(self, condition, seconds=60):
        """Waits until `condition` gives something that is true, and returns it."""
        end = time.monotonic() + seconds
        while not (result := condition()):
            self.case.assertIsNone(self.process.poll(), "it ended")
            self.case.assertLess(time.monotonic(), end, "it takes too long")
            time.sleep(0.02)
        return result

    def wait_for_partial(self):
        """Waits for the hidden directory that it writes into."""
        return self.wait_for(lambda: list(self.case.work.rglob(".*.partial*")))

    def stop(self, signal, seconds=20):
        """Sends a signal, which must end it soon with the status for this signal; returns what it
        wrote to standard error."""
        self.process.send_signal(signal)
        output, errors = self.process.communicate(timeout=seconds)
        self.case.assertEqual((self.process.returncode, output or ""), (INTERRUPTED + signal, ""))
        return errors


def mount(case, size):
    """A file system of its own of this size, below the directory of a test; skips it if that is not
    allowed."""
    directory = case.work / "full"
    directory.mkdir()
    result = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", directory],
        capture_output=True, text=True, check=False,
    )
    if result.returncode != 0:
        case.skipTest(f"cannot mount a small disk: {result.stderr.strip()}")
    case.addCleanup(subprocess.run, ["umount", directory], check=True)
    return directory


def main():
    unittest.main(verbosity=2)
