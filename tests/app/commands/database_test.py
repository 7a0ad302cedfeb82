"""Databases that cannot be used, and merl-scan database."""

import os
import re
import shutil
import signal
import struct
import subprocess

import support
from support import GRID, INPUT, OUTPUT, SUCCESS, USAGE, Case
from support import merl_bytes, samples, tree, voxels, write_database

BYTES = 12 + 24 * voxels(GRID)  # of a whole file


class BadDatabase(Case):
    """A database of two good materials, m00 and m01, to which the tests add a bad one."""

    def setUp(self):
        super().setUp()
        self.database = write_database(self.work / "db", 2)
        self.bad = self.database / "bad.binary"

    def assert_scan_refused(self, *words):
        self.assert_refused(INPUT, words, "scan", "--database", "db", "--out", "out")

    def assert_bad(self, *words):
        """The scan refuses it; `database info` explains it and lists the others."""
        self.assert_scan_refused("bad.binary", *words)
        result = self.run_program("database", "info", "db")
        self.assertEqual((result.returncode, result.stderr), (INPUT, ""))
        (line,) = [line for line in result.stdout.splitlines() if line.startswith("bad ")]
        for word in ("cannot be used", "bad.binary", *words):
            self.assertIn(word, line)
        for good in "m00", "m01":
            self.assertRegex(result.stdout, rf"(?m)^{good} +{voxels(GRID)} ")
        self.assertIn("2 of 3 can be read", result.stdout)


class BadFile(BadDatabase):
    def test_empty(self):
        self.bad.touch()
        self.assert_bad("0 bytes", "12")

    def test_less_than_a_header(self):
        self.bad.write_bytes(b"\1\0\0\0\1\0\0\0\1\0\0")
        self.assert_bad("11 bytes", "12")

    def test_header_only(self):
        self.bad.write_bytes(merl_bytes([]))
        self.assert_bad("12 bytes", f"{BYTES}", "truncated")

    def test_truncated(self):
        self.bad.write_bytes(merl_bytes(samples(0))[:-1])
        self.assert_bad(f"{BYTES - 1} bytes", f"{BYTES}", "truncated")

    def test_overlong(self):
        self.bad.write_bytes(merl_bytes(samples(0)) + b"\n")
        self.assert_bad(f"{BYTES + 1} bytes", f"{BYTES}", "over-long")

    def test_hostile_headers(self):
        largest = 2**31 - 1
        for sizes in (
            (0, 5, 8), (6, 0, 8), (6, 5, 0), (0, 0, 0), (-6, 5, 8), (-6, -5, 8),
            (-(2**31), 2, 1), (largest, largest, largest), (65536, 65536, 1), (65536, 65536, 65536),
            (largest, 1, 1), (2**16, 2**16, 2**30), (3, 715827883, 8),
        ):
            with self.subTest(sizes):
                self.bad.write_bytes(struct.pack("<3i", *sizes))
                expected = "positive" if min(sizes) <= 0 else "at most"
                self.assert_bad(" x ".join(map(str, sizes)), expected)

    def test_big_endian_header(self):
        self.bad.write_bytes(struct.pack(">3i", *GRID) + merl_bytes(samples(0))[12:])
        self.assert_bad("at most")

    def test_numbers_that_are_no_reflectance(self):
        count = voxels(GRID)
        first = "theta_h 0, theta_d 0, phi_d 0"  # above the horizon
        last = "theta_h 5, theta_d 4, phi_d 7"  # below it
        for value, channel, voxel in (
            ("nan", "red", first), ("inf", "red", last), ("1e300", "green", first),
            ("-inf", "green", last), ("1e17", "blue", first),
        ):
            with self.subTest(value):
                numbers = samples(0)
                plane = ["red", "green", "blue"].index(channel)
                numbers[plane * count + (count - 1 if voxel == last else 0)] = float(value)
                self.bad.write_bytes(merl_bytes(numbers))
                self.assert_bad(channel, voxel, "finite", "at most")

    def test_directory(self):
        self.bad.mkdir()
        self.assert_bad("not a regular file")

    def test_fifo(self):
        os.mkfifo(self.bad)
        self.assert_bad("not a regular file")

    def test_dangling_symbolic_link(self):
        self.bad.symlink_to("nowhere")
        self.assert_bad("cannot be opened", "No such file")

    def test_symbolic_link_to_itself(self):
        self.bad.symlink_to("bad.binary")
        self.assert_bad("cannot be opened")

    def test_unreadable(self):
        self.bad.write_bytes(merl_bytes(samples(0)))
        self.bad.chmod(0)
        self.drop_privileges()
        self.work.chmod(0o777)  # the results could be written
        self.assert_bad("cannot be opened", "Permission denied")


class BadDirectory(BadDatabase):
    def test_missing(self):
        for path in "nowhere", "db/m00.binary/db", "x" * 300:
            self.assert_refused(INPUT, [path], "scan", "--database", path)

    def test_unreadable(self):
        self.database.chmod(0)
        self.drop_privileges()
        self.work.chmod(0o777)
        self.assert_scan_refused("db", "Permission denied")
        self.database.chmod(0o755)

    def test_a_file(self):
        self.assert_refused(INPUT, ["db/m00.binary", "directory"],
                            "scan", "--database", "db/m00.binary")

    def test_no_material(self):
        for file in self.database.iterdir():
            file.unlink()
        self.assert_scan_refused("db", "0 .binary")

    def test_one_material(self):
        (self.database / "m01.binary").rename(self.database / "m01.bin")
        self.assert_scan_refused("db", "found 1 material", "two")

    def test_different_grids(self):
        other = (6, 8, 5)  # as many voxels
        self.bad.write_bytes(merl_bytes(samples(0, other), other))
        self.assert_scan_refused("bad.binary", "6 x 8 x 5", "m00.binary", "6 x 5 x 8", "same")
        result = self.run_program("database", "info", "db")
        self.assertEqual((result.returncode, result.stderr), (INPUT, ""))
        self.assertIn("grids differ", result.stdout)

    def test_two_names_of_one_material(self):
        data = merl_bytes(samples(3))
        (self.database / "chrome.binary").write_bytes(data)
        (self.database / "chrome.BINARY").write_bytes(data)
        words = "chrome.binary", "chrome.BINARY", "same material"
        self.assert_scan_refused(*words)
        self.assert_refused(INPUT, words, "database", "info", "db")

    def test_bad_names_stay_on_one_line(self):
        (self.database / "two\nlines\x1b[31m\udcff\x9b.binary").touch()
        shown = r"two\x0alines\x1b[31m\xff\xc2\x9b.binary"
        self.assert_scan_refused(shown, "0 bytes")
        result = self.run_program("database", "info", "db")
        self.assertIn(shown, result.stdout)
        self.assertNotIn("\x1b", result.stdout)


class Info(Case):
    def rows(self, *arguments):
        """What is printed of each material."""
        output = self.assert_success("database", "info", *arguments)
        row = r"^(.+?) +(\d+) +(\d+)   (\S+) to (\S+)$"
        return {m[1]: (int(m[2]), int(m[3]), float(m[4]), float(m[5]))
                for m in re.finditer(row, output, re.MULTILINE)}

    def test_directory(self):
        count = voxels(GRID)
        some = [float(1500 + i) for i in range(3 * count)]
        some[7] = 300000
        some[8] = some[count + 8] = some[2 * count + 8] = -1
        some[2 * count + 9] = -1e308
        some[10] = 0
        write_database(self.work / "db", {"some": some, "grey": [1500.0] * (3 * count)})
        output = self.assert_success("database", "info", "db")
        self.assertIn("db: 2 materials", output)
        self.assertIn("2 of 2 can be read", output)
        self.assertIn("6 x 5 x 8", output)
        self.assertEqual(self.rows("db")["some"], (count, 2, 0, 200))

    def test_damaged(self):
        """Copies that have the right size but not the content."""
        grid = (20, 20, 30)
        count = voxels(grid)
        whole = samples(0, grid)
        page = merl_bytes(whole, grid)
        page = page[:40960] + bytes(4096) + page[45056:]
        page = list(struct.unpack(f"<{3 * count}d", page[12:]))
        databases = {
            "minus": ([-1.0] * (3 * count), "nothing above the horizon was measured"),
            "zero": ([0.0] * (3 * count), "no sample above the horizon is above zero"),
            "no-blue": (whole[:2 * count] + [0.0] * count, "blue is nowhere above zero"),
            "red-flat": ([0.75] * count + whole[count:], "red is 0.0005/sr everywhere"),
            "twins": (whole[:count] * 2 + whole[2 * count:], "red and green are the same"),
            "little": ([-1.0] * (count * 3 // 4) + whole[count * 3 // 4:], "were not measured"),
            "page": (page, "like a hole in the file"),
        }
        write_database(self.work / "good", {f"m{i}": samples(9 + i, grid) for i in range(2)}, grid)
        self.assert_success("database", "info", "good")
        for name, (numbers, words) in databases.items():
            shutil.copytree(self.work / "good", self.work / name)
            (self.work / name / "bad.binary").write_bytes(merl_bytes(numbers, grid))
            result = self.run_program("database", "info", name)
            self.assertEqual((result.returncode, result.stderr), (INPUT, ""), name)
            line = re.search(r"(?m)^bad +looks damaged: .*$", result.stdout)[0]
            self.assertIn(words, line)
            self.assertIn("1 of 3 looks damaged", result.stdout)
            for command in (("scan",), ("compare", "--metrics", "rmse,cwcbrt")):
                out = f"{name}-{command[0]}"
                result = self.run_program(*command, "--database", name, "--out", out, "--quiet")
                self.assertEqual(result.returncode, SUCCESS)
                warning = f"bad of {name}: "
                line = self.only_line(result.stderr)
                self.assertTrue(line.startswith("merl-scan: warning: " + warning) and words in line)
                (recorded,) = support.read_json(self.work / out / "summary.json")["warnings"]
                self.assertTrue(recorded.startswith(warning) and words in recorded)

    def test_copies(self):
        write_database(self.work / "db", {name: samples(int(name[1])) for name in
                                          ("a1", "a2", "b1", "b3", "c1")})
        result = self.run_program("database", "info", "db")
        self.assertEqual((result.returncode, result.stderr), (INPUT, ""))
        self.assertIn("the same content: a1, b1, c1\n", result.stdout)
        result = self.run_program("scan", "--database", "db")
        self.assertEqual((result.returncode, self.only_line(result.stderr)),
                         (SUCCESS, "merl-scan: warning: a1, b1, c1 of db have the same content"))

    def test_all_distances_are_zero(self):
        write_database(self.work / "db", {name: samples(1) for name in ("a", "b", "c")})
        result = self.run_program("scan", "--database", "db", "--metrics", "rmse,cwcbrt")
        self.assertEqual(result.returncode, SUCCESS)
        for metric in "rmse", "cwcbrt":
            self.assertIn(f"merl-scan: warning: all distances under {metric} are 0\n", result.stderr)

    def test_over_all_of_phi_d(self):
        write_database(self.work / "db", 2, (9, 9, 36))
        output = self.assert_success("database", "info", "db")
        self.assertIn("2 of 2 can be read; grid 9 x 9 x 36 (theta_h x theta_d x phi_d over 2 pi), phi_d over "
                      "[0, 2 pi)\n", output)
        output = self.assert_success("database", "info", "db", "--phi-d-range", "pi")
        self.assertIn("; grid 9 x 9 x 36 (theta_h x theta_d x phi_d), phi_d over [0, pi)\n", output)
        (self.work / "db" / "half.binary").write_bytes(merl_bytes(samples(5, (9, 9, 18)), (9, 9, 18)))
        output = self.assert_success("database", "info", "db")
        self.assertIn("3 of 3 can be read", output)
        self.assertIn("; 1 over [0, pi) count as repeated after pi\n", output)
        self.assert_refused(USAGE, ["--phi-d-range", "2pi"], "database", "info", "db", "--phi-d-range", "360")

    def test_file(self):
        write_database(self.work / "db", 1)
        self.assertEqual(list(self.rows("db/m00.binary")), ["m00"])

    def test_stopped(self):
        with support.Running(self, "database", "info", stderr=subprocess.DEVNULL) as running:
            running.wait_for(lambda: running.seconds() > 0.3)
            running.process.send_signal(signal.SIGINT)
            running.process.communicate(timeout=2)
            self.assertEqual(running.process.returncode, support.INTERRUPTED + signal.SIGINT)

    def test_built_in(self):
        output = self.assert_success("database", "info")
        self.assertIn("stand-in", output)
        self.assertRegex(output, r"(?m)^chrome +1458000 ")
        self.assertRegex(output, r"(?m)^yellow-plastic +1458000 ")
        self.assertNotIn("damaged", output)

    def test_empty_directory(self):
        (self.work / "db").mkdir()
        result = self.run_program("database", "info", "db")
        self.assertEqual(result.returncode, INPUT)
        self.assertIn("db", result.stdout + result.stderr)

    def test_missing(self):
        for path in "nowhere", "nowhere/":
            self.assert_missing(path)
            self.assert_refused(INPUT, [path, "no such database"], "database", "info", path)

    def test_impossible_name(self):
        self.assert_missing("x" * 300)

    def assert_missing(self, path):
        result = self.run_program("database", "info", path)
        self.assertEqual(result.returncode, INPUT, result.stderr)
        self.assertIn(path, result.stdout + result.stderr)


class Write(Case):
    """The whole is 3.3 GiB: too much for a test, so these stop it early."""

    def test_existing(self):
        (self.work / "there").mkdir()
        self.assert_refused(OUTPUT, ["there", "exists", "--force"], "database", "write", "there")

    def test_unwritable(self):
        (self.work / "file").touch()
        self.assert_refused(OUTPUT, ["file/x", "Not a directory"], "database", "write", "file/x")
        self.assert_refused(OUTPUT, ["no/x", "No such file"], "database", "write", "no/x")

    def test_full_disk(self):
        disk = support.mount(self, "50m")
        line = self.assert_refused(OUTPUT, ["full/x/", ".binary: cannot be", "No space left"],
                                   "database", "write", disk / "x")
        self.assertNotIn("partial-", line)

    def test_interrupted(self):
        with support.Running(self, "database", "write", "abc") as running:
            # Files that are already there are those of the built-in database: one is kept, which
            # is whole when there is the next.
            written = running.wait_for(lambda: sorted(self.work.rglob("*.binary"))[:-1])[0]
            kept = self.work / written.name
            os.link(written, kept)
            errors = running.stop(signal.SIGINT)
        self.assertIn("interrupted", self.only_line(errors))
        self.assertEqual(list(self.work.iterdir()), [kept])
        self.assertEqual(kept.stat().st_size, 34992012)
        name = re.escape(kept.stem)
        # Below the horizon are 361,784 of 1,458,000 voxels.
        output = self.assert_success("database", "info", kept)
        most = re.search(rf"(?m)^{name} +1458000 +361784   .* to (\S+)$", output)[1]
        built_in = self.assert_success("database", "info")
        self.assertRegex(built_in, rf"(?m)^{name} +1458000 .* to {re.escape(most)}$")

    def test_a_database_into_itself(self):
        write_database(self.work / "db", 2)
        before = tree(self.work)
        for options in [], ["--force"]:
            self.assert_refused(USAGE, ["db", "is the database that is read"], "database", "write",
                                "db", "--database", "db", *options)
        self.assertEqual(tree(self.work), before)
        self.assert_success("database", "write", "copy", "--database", "db")
        self.assertEqual(sorted(p.name for p in (self.work / "copy").iterdir()),
                         ["m00.binary", "m01.binary"])


if __name__ == "__main__":
    support.main()
