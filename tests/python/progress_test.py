"""What is shown of long calls: in a terminal, in a notebook, where nobody looks; with tqdm and without."""

import os
import pathlib
import pty
import re
import subprocess
import sys
import tempfile
import textwrap
import unittest

WITHOUT_TQDM = "import sys; sys.modules['tqdm'] = None\n"

IN_A_NOTEBOOK = "import sys, types; sys.modules['ipykernel'] = types.ModuleType('ipykernel')\n"

WORK = """
import merl_scan as ms
database = ms.open(shape=(20, 20, 40), materials="*paint*")
with ms.progress():
    d = ms.distances(database, device="host")
    ms.scan(d)
"""

# Stands in for tqdm: says on standard output what is done with it.
TQDM = """
class tqdm:
    def __init__(self, total, desc, **options):
        self.total, self.desc, self.n = total, desc, 0
        print("begin", desc)

    def update(self, n):
        assert n >= 0, n
        self.n += n

    def close(self):
        print("end", self.desc, round(self.n), "of", self.total)
"""


def run(code, is_terminal, folder=None):
    """What a program writes to standard error and to standard output."""
    environment = dict(os.environ)
    if folder is not None:
        environment["PYTHONPATH"] = f"{folder}:{environment['PYTHONPATH']}"
    master, slave = pty.openpty() if is_terminal else os.pipe()
    with open(master, "rb", buffering=0) as reader:
        process = subprocess.Popen([sys.executable, "-B", "-c", code], stdout=subprocess.PIPE, stderr=slave, env=environment)
        os.close(slave)
        said = b""
        try:
            while piece := reader.read(4096):
                said += piece
        except OSError:  # a terminal whose other side is closed
            pass
        output = process.communicate(timeout=300)[0].decode()
    if process.returncode != 0:
        raise AssertionError(f"status {process.returncode}: {said.decode()}")
    return said.decode(), output


def lines_shown(said):
    """What one line of a terminal shows after each return of the carriage."""
    shown = [""]
    for piece in said.split("\r")[1:]:
        shown.append(piece + shown[-1][len(piece):])
    return shown


class Progress(unittest.TestCase):
    def assert_is_a_bar(self, said):
        *bars, before_end, end = (line.rstrip() for line in lines_shown(said))
        self.assertEqual((before_end, end), ("", ""))  # nothing is left of it
        stages = {}
        for line in bars[1:]:
            stage, percent, bar = re.fullmatch(r"(\w+): +(\d+)% \|([#.]{30})\|", line).groups()
            self.assertEqual(bar.rstrip("."), "#" * bar.count("#"))
            self.assertAlmostEqual(bar.count("#") / 30, int(percent) / 100, delta=0.03)
            stages.setdefault(stage, []).append(int(percent))
        self.assertIn("distances", stages)
        self.assertGreater(len(stages), 1)
        for stage, percents in stages.items():
            self.assertEqual(percents, sorted(percents), stage)
        self.assertEqual(stages["distances"][-1], 100)

    def test_terminal(self):
        said, output = run(WITHOUT_TQDM + WORK, is_terminal=True)
        self.assertEqual(output, "")
        self.assert_is_a_bar(said)

    def test_notebook(self):
        self.assert_is_a_bar(run(IN_A_NOTEBOOK + WITHOUT_TQDM + WORK, is_terminal=False)[0])

    def test_nobody_looks(self):
        for code in (WORK, WITHOUT_TQDM + WORK):
            self.assertEqual(run(code, is_terminal=False), ("", ""))
        self.assertEqual(run("import sys; sys.stderr = None\n" + WORK, is_terminal=True), ("", ""))
        outside = WORK.replace("with ms.progress():", "with ms.progress():\n    pass\nif True:")
        self.assertEqual(run(WITHOUT_TQDM + outside, is_terminal=True), ("", ""))

    def test_tqdm(self):
        with tempfile.TemporaryDirectory() as folder:
            package = pathlib.Path(folder) / "tqdm"
            package.mkdir()
            (package / "__init__.py").touch()
            (package / "auto.py").write_text(TQDM)
            for code, is_terminal in ((WORK, True), (IN_A_NOTEBOOK + WORK, False)):
                said, output = run(code, is_terminal, folder)
                self.assertEqual(said, "")
                lines = output.splitlines()
                self.assertEqual(lines[:2], ["begin distances", "end distances 100 of 100"])
                self.assertGreater(len(lines), 2)
                for begin, end in zip(lines[::2], lines[1::2], strict=True):  # one at a time
                    stage = begin.removeprefix("begin ")
                    self.assertRegex(end, rf"end {stage} (100|\d?\d) of 100")
            self.assertEqual(run(WORK, False, folder), ("", ""))

    def test_ends_with_what_is_raised(self):
        for raised, caught in (("1 / 0", "ZeroDivisionError"), ("raise KeyboardInterrupt", "KeyboardInterrupt")):
            code = f"try:{textwrap.indent(WORK, '    ')}        {raised}\nexcept {caught}:\n    print('caught')\n"
            said, output = run(WITHOUT_TQDM + code, is_terminal=True)
            self.assertEqual(output, "caught\n")
            self.assert_is_a_bar(said)

    def test_function_of_ones_own(self):
        code = """
import threading
import merl_scan as ms
database = ms.open(shape=(6, 5, 8), materials="*paint*")
def call():
    ms.distances(database, "rmse", device="host")
def noting(name):
    return lambda stage, share: said.append((name, stage, share))
said = []
with ms.progress(noting("outer")):
    with ms.progress(noting("inner")):
        call()
    thread = threading.Thread(target=call)  # which has none
    thread.start()
    thread.join()
    print([entry for entry in said if entry[2] == 1])
    said = []
    call()
call()
print([entry for entry in said if entry[2] == 1])
try:
    with ms.progress(3):
        pass
except TypeError as error:
    print(error)
"""
        said, output = run(code, is_terminal=True)
        self.assertEqual(said, "")
        self.assertEqual(output.splitlines(), [
            "[('inner', 'distances', 1.0)]", "[('outer', 'distances', 1.0)]",
            "report: found 3; expected a function of stage and share"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
