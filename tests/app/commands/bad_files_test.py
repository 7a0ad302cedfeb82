"""Files that are not what they should be: all are named, recognised, and left out where that is asked for."""

import gzip
import shutil
import struct

import rgl
import support
from exr import read_exr
from support import GRID, INPUT, SUCCESS, Case, merl_bytes, samples, voxels, write_database
from tables import COLUMNS, write_rows


class BadFiles(Case):
    """A database of four good materials, to which the tests add bad ones."""

    def setUp(self):
        super().setUp()
        self.database = write_database(self.work / "db", 4)

    def add(self, name, content):
        (self.database / f"{name}.binary").write_bytes(content)

    def add_three(self):
        """A broken header, a number that is none, and another grid."""
        self.add("cut", merl_bytes(samples(7))[:-1])
        self.add("nan", merl_bytes([*samples(8)[:-1], float("nan")]))
        self.add("other", merl_bytes(samples(9, (6, 5, 7)), (6, 5, 7)))

    def test_all_are_named(self):
        self.add_three()
        line = self.assert_refused(INPUT, [], "scan", "--database", "db")  # what opening finds
        self.assertRegex(line, "^merl-scan: db: 2 of 7 files cannot be used: db/cut.binary: has .*; "
                               "db/other.binary: the grid is 6 x 5 x 7 .*; --skip-bad leaves them out$")
        for name in "cut", "other":
            (self.database / f"{name}.binary").unlink()
        self.add("a-nan", merl_bytes([*samples(8)[:-1], float("inf")]))
        for command in ("scan", "--database", "db"), ("compare", "--database", "db", "--metrics", "rmse,cwcbrt"), \
                ("render", "--database", "db", "--size", "16"), ("database", "write", "copy", "--database", "db"):
            line = self.assert_refused(INPUT, [], *command)  # what reading samples finds
            where = "blue of voxel theta_h 5, theta_d 4, phi_d 7 is "
            self.assertRegex(line, f"^merl-scan: db: 2 of 6 files cannot be used: db/a-nan.binary: {where}.*; "
                                   f"db/nan.binary: {where}")

    def test_one_is_told_how_to_leave_it_out(self):
        self.add("cut", b"x")
        line = self.assert_refused(INPUT, [], "scan", "--database", "db")
        self.assertRegex(line, "^merl-scan: db/cut.binary: has 1 bytes.*; --skip-bad leaves them out$")

    def test_all_are_named_of_several_databases(self):
        self.add_three()
        write_database(self.work / "more", {"short": samples(1)})
        (self.work / "more" / "short.binary").write_bytes(b"x")
        self.assert_refused(INPUT, ["db/cut.binary", "db/other.binary", "more/short.binary", "--skip-bad"],
                            "scan", "--database", "db", "--database", "more")

    def test_many(self):
        for i in range(30):
            self.add(f"x{i:02}", b"x")
        line = self.assert_refused(INPUT, ["db: 30 of 34 files", "; and 10 more; --skip-bad"], "scan", "--database", "db")
        for i in range(20):
            self.assertIn(f"; db/x{i:02}.binary: has 1 bytes" if i > 0 else ": db/x00.binary: has 1 bytes", line)

    def scan_and_skip(self, *options, out="out"):
        result = self.run_program("scan", "--database", "db", "--skip-bad", "--out", out, *options)
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        return result, support.read_json(self.work / out / "summary.json")

    def test_skipped(self):
        self.scan("--database", "db", out="good")
        self.add_three()
        result, summary = self.scan_and_skip()
        lines = result.stderr.splitlines()
        self.assertEqual(lines[0], "merl-scan: warning: db: 3 files cannot be used and are left out")
        self.assertEqual([line.split(": ")[3] for line in lines[1:]],
                         [f"db/{name}.binary" for name in ("cut", "nan", "other")])
        self.assertRegex(result.stdout, r"(?m)^skipped +3 bad files: cut, nan, other$")
        skipped = summary["database"]["skipped"]
        self.assertEqual(list(skipped), ["cut", "nan", "other"])
        self.assertTrue(skipped["nan"].startswith("db/nan.binary: blue of voxel "))
        self.assertEqual(summary["warnings"], [line[len("merl-scan: warning: "):] for line in lines])
        # The others are as if they were alone.
        for name in "pairs.csv", "selection.csv", "disagreements.csv":
            self.assertEqual((self.work / "out" / name).read_bytes(), (self.work / "good" / name).read_bytes())
        alone = support.read_json(self.work / "good" / "summary.json")["database"]
        self.assertEqual((alone["content_hash"], alone["skipped"]), (summary["database"]["content_hash"], {}))

    def test_what_comes_after_has_the_same_materials(self):
        self.add_three()
        self.scan_and_skip()
        # A file that is whole by now was not scanned.
        shutil.copy(self.database / "m00.binary", self.database / "cut.binary")
        for command in ("render", "--size", "16"), ("judge", "--size", "16"):
            result = self.run_program(*command, "--selection", "out/selection.csv", "--out", command[0])
            self.assertEqual(result.returncode, SUCCESS, result.stderr)
            self.assertIn("warning: db: 3 files cannot be used and are left out\n", result.stderr)
        warnings = support.read_json(self.work / "judge" / "kit.json")["warnings"]
        self.assertIn("left out: db/nan.binary: blue of voxel ", warnings[2])
        self.assertFalse((self.work / "render" / "cut.png").exists())
        part = self.run_program("render", "--size", "16", "--selection", "out/selection.csv", "--materials", "m0?",
                                "--exclude", "m00", "--out", "part")
        self.assertEqual(part.returncode, SUCCESS, part.stderr)
        self.assertIn("warning: db: 3 files cannot be used", part.stderr)
        kit = support.read_json(self.work / "judge" / "kit.json")
        write_rows(self.work / "ann.csv", COLUMNS,
                   [["ann", i, t["configuration"], t["kind"], *t["left"], *t["right"], 0, 3, 900, kit["seed"],
                     kit["kit_hash"]] for i, t in enumerate(kit["trials"], 1)])
        self.run_program("votes", "ann.csv", "--selection", "out/selection.csv", "--kit", "judge/kit.json", "--out",
                         "analysis")
        self.assertIn("left out: 3 bad files: cut, nan, other", (self.work / "render" / "contact-sheet.html").read_text())
        self.assertEqual(list(kit["database"]["skipped"]), ["cut", "nan", "other"])
        for command in ("score", "--metrics", "rmse"), ("tune", "--metric", "nielsen-log", "--evaluations", "1"):
            result = self.run_program(*command, "--judgements", "analysis/judgements.csv", "--out", command[0])
            self.assertEqual(result.returncode, SUCCESS, result.stderr)
            self.assertIn("warning: db: 3 files cannot be used", result.stderr)
            skipped = support.read_json(self.work / command[0] / "summary.json")["database"]["skipped"]
            self.assertEqual(list(skipped), ["cut", "nan", "other"])
        # One that is bad only now is an error, or skipped too.
        self.add("m03", b"x")
        self.assert_refused(INPUT, ["db/m03.binary"], "render", "--selection", "out/selection.csv", "--size", "16",
                            "--out", "again")

    def test_every_command(self):
        self.add_three()
        for command in (("compare", "--metrics", "rmse,cwcbrt"), ("render", "--size", "16"),
                        ("slices", "--materials", "*"), ("database", "write", "copy")):
            out = () if command[0] == "database" else ("--out", command[0])
            result = self.run_program(*command, *out, "--database", "db", "--skip-bad")
            self.assertEqual(result.returncode, SUCCESS, result.stderr)
            self.assertEqual(len(result.stderr.splitlines()), 4, result.stderr)
        summary = support.read_json(self.work / "compare" / "summary.json")
        self.assertEqual(list(summary["database"]["skipped"]), ["cut", "nan", "other"])
        self.assertEqual(len(list((self.work / "copy").iterdir())), 4)
        for page in "compare/compare.html", "render/contact-sheet.html":
            self.assertIn("3 bad files: cut, nan, other", (self.work / page).read_text())
        (self.work / "judged.csv").write_text("reference,a,b,votes_a,votes_b\nm00,m01,m02,3,1\n")
        result = self.run_program("score", "--judgements", "judged.csv", "--database", "db", "--skip-bad",
                                  "--metrics", "rmse", "--out", "scores")
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.assertEqual(len(support.read_json(self.work / "scores" / "summary.json")["database"]["skipped"]), 3)
        self.assertIn("; without 3 bad files", (self.work / "scores" / "score.svg").read_text())

    def test_a_database_without_a_good_file(self):
        self.add_three()
        broken = self.work / "broken"
        broken.mkdir()
        (broken / "b.binary").write_bytes(b"x")
        (broken / "a.binary").write_bytes(b"")
        databases = "--database", "db", "--database", "broken", "--skip-bad"
        result = self.run_program("scan", *databases, "--out", "out")
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.assertIn("warning: db: 5 files cannot be used", result.stderr)
        database = support.read_json(self.work / "out" / "summary.json")["database"]
        self.assertEqual(list(database["skipped"]), ["broken/a", "broken/b", "db/cut", "db/nan", "db/other"])
        self.assertEqual([part["label"] for part in database["databases"]], ["db"])
        # What comes after the scan opens what was scanned, and says the same.
        result = self.run_program("render", "--selection", "out/selection.csv", "--size", "16", "--out", "sheet")
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.assertIn("warning: db: 5 files cannot be used", result.stderr)

    def test_no_database_has_a_good_file(self):
        for name in "one", "two":
            write_database(self.work / name, 1)
            (self.work / name / "m00.binary").write_bytes(b"x")
        self.assert_refused(INPUT, ["one: none of 1 files can be used: one/m00.binary", "two: none of 1 files"],
                            "scan", "--database", "one", "--database", "two", "--skip-bad")

    def test_nothing_to_skip(self):
        result, summary = self.scan_and_skip()
        self.assertEqual((result.stderr, summary["database"]["skipped"]), ("", {}))
        self.assert_success("slices", "--out", "slices", "--skip-bad")

    def test_too_few_are_left(self):
        for name in "m01", "m02", "m03":
            self.add(name, b"")
        self.assert_refused(INPUT, ["db: found 1 material", "at least two", "left out: ", "db/m02.binary: has 0 bytes"],
                            "scan", "--database", "db", "--skip-bad")

    def test_names_that_hide(self):
        self.add("x\n\x1b[2J", b"")
        self.add("y", b"")
        self.assert_refused(INPUT, ["db/x\\x0a\\x1b[2J.binary", "db/y.binary"], "scan", "--database", "db")
        result, summary = self.scan_and_skip()
        self.assertIn("left out: db/x\\x0a\\x1b[2J.binary: has 0 bytes", result.stderr)
        self.assertEqual(len(summary["database"]["skipped"]), 2)


class OtherFormats(Case):
    def refusal(self, path, *words):
        for command in ("scan", "--database"), ("database", "info"):
            result = self.run_program(*command, path)
            self.assertEqual(result.returncode, INPUT, command)
            for word in words:
                self.assertIn(word, result.stdout + result.stderr)

    def test_files(self):
        database = write_database(self.work / "db", 2)
        whole = merl_bytes(samples(3))
        numbers = struct.unpack(f"<{3 * voxels(GRID)}d", whole[12:])
        bad = database / "bad.binary"
        npy = b"\x93NUMPY\1\0v\0{'descr': '<f8', 'fortran_order': False, 'shape': (3, 240), }"
        for content, word in {
            b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 34992012\n": "`git lfs pull`",
            gzip.compress(whole): "compressed with gzip: unpack it",
            npy + whole: "a NumPy array (.npy)",
            b"PK\3\4" + whole: "NumPy's .npz",
            b"0.1 0.2 0.3\n" * 50: "it is text",
            rgl.file_bytes(rgl.made_up(1)): "a file of the RGL: call it NAME.bsdf",
            whole[:12] + struct.pack(f"<{len(numbers)}f", *numbers): "its samples are float32",
            struct.pack(f">3i{len(numbers)}d", *GRID, *numbers): "it is big-endian (6 x 5 x 8)",
        }.items():
            bad.write_bytes(content)
            self.refusal("db", "db/bad.binary: ", word)

    def test_rgl_files(self):
        database = self.work / "db"
        database.mkdir()
        for seed in 1, 2:
            (database / f"m{seed}.bsdf").write_bytes(rgl.file_bytes(rgl.made_up(seed)))
        fields = rgl.made_up(3)
        (database / "anisotropic.bsdf").write_bytes(rgl.file_bytes({**fields, "phi_i": ((3,), [0, 1, 2])}))
        spectral = {("spectra" if name == "rgb" else name): field for name, field in fields.items()}
        (database / "spectral.bsdf").write_bytes(rgl.file_bytes(spectral))
        (database / "pointer.bsdf").write_bytes(b"version https://git-lfs.github.com/spec/v1\n")
        result = self.run_program("scan", "--database", "db", "--device", "host")
        self.assertEqual(result.returncode, INPUT)
        self.assertIn("3 of 5 files cannot be used", result.stderr)
        self.assertIn("`git lfs pull`", result.stderr)
        result = self.run_program("scan", "--database", "db", "--device", "host", "--skip-bad", "--out", "out",
                                  "--metrics", "rmse,cwcbrt")
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        skipped = support.read_json(self.work / "out" / "summary.json")["database"]["skipped"]
        self.assertEqual(list(skipped), ["anisotropic", "pointer", "spectral"])
        self.assertIn("is spectral", skipped["spectral"])

    def test_folders(self):
        write_database(self.work / "brdfs", 2)
        (self.work / "parent").mkdir()
        shutil.move(self.work / "brdfs", self.work / "parent" / "brdfs")
        self.refusal("parent", "the database may be parent/brdfs")
        (self.work / "arrays").mkdir()
        for name in "ab":
            (self.work / "arrays" / f"{name}.npy").touch()
        self.refusal("arrays", "it has 2 .npy files: write it again as docs/file-formats.md says")
        (self.work / "arrays" / "c.npy").write_bytes(b"\x93NUMPY" + bytes(100))
        self.refusal("arrays/c.npy", "a NumPy array")


class OverTwoPi(Case):
    """phi_d over [0, 2 pi), alone and next to [0, pi)."""

    HALF = (6, 5, 10)
    WHOLE = (6, 5, 20)

    def extended(self, numbers):
        """f(phi_d + pi) = f(phi_d)."""
        rows = [numbers[i : i + self.HALF[2]] for i in range(0, len(numbers), self.HALF[2])]
        return [number for row in rows for number in row + row]

    def setUp(self):
        super().setUp()
        self.made = {f"m{i}": samples(i, self.HALF) for i in range(4)}
        write_database(self.work / "half", self.made, self.HALF)
        write_database(self.work / "whole", {name: self.extended(numbers) for name, numbers in self.made.items()},
                       self.WHOLE)
        write_database(self.work / "mixed", self.made, self.HALF)
        shutil.copy(self.work / "whole" / "m2.binary", self.work / "mixed" / "twin.binary")

    def distances(self, database, *options):
        out = self.scan("--database", database, "--metrics", "cwcbrt,cosine-rmse", *options, out=f"{database}-out")
        header, rows = support.read_csv(out / "pairs.csv")
        place = header.index("cwcbrt")
        return {(row[0], row[1]): [float(value) for value in row[place : place + 2]] for row in rows}

    def test_distances_do_not_depend_on_the_range(self):
        half = self.distances("half")
        whole = self.distances("whole")
        # Of these files the content is the same, which is worth a warning.
        mixed = self.distances("mixed")
        self.assertEqual(mixed["m2", "twin"], [0, 0])
        for pair, expected in half.items():
            for other in whole, mixed:
                for a, b in zip(expected, other[pair]):
                    self.assertLess(abs(a / b - 1), 1e-6, pair)
        for name in "m0", "m1":
            self.assertEqual(mixed[name, "twin"], mixed[name, "m2"])
        self.assertEqual(mixed["m3", "twin"] if ("m3", "twin") in mixed else mixed["twin", "m3"], mixed["m2", "m3"])
        for database, expected in ("half", [10, "pi"]), ("mixed", [20, "2pi"]):
            grid = support.read_json(self.work / f"{database}-out" / "summary.json")["database"]["grid"]
            self.assertEqual([grid["phi_d"], grid["phi_d_range"]], expected)

    def test_what_comes_after_reads_the_same(self):
        for database, options in ("mixed", ()), ("whole", ("--phi-d-range", "pi")), ("half", ("--phi-d-range", "2pi")):
            self.distances(database, *options)
            self.assert_success("render", "--selection", f"{database}-out/selection.csv", "--out", f"{database}-spheres",
                                "--size", "16")

    def test_spheres(self):
        """A file and its extension look the same."""
        for database in "half", "whole":
            self.assert_success("render", "--database", database, "--material", "m1", "--out", f"{database}.exr",
                                "--size", "24")
        half, whole = (read_exr(self.work / f"{name}.exr")[2] for name in ("half", "whole"))
        self.assertGreater(max(half["G"]), 0)
        for channel in "RGB":
            for a, b in zip(half[channel], whole[channel], strict=True):
                self.assertLess(abs(a - b), 1e-3 * max(half[channel]))

    def test_written(self):
        self.assert_success("database", "write", "copy", "--database", "mixed", "--quiet")
        output = self.assert_success("database", "info", "whole")
        for name in self.made:
            copy, whole = ((self.work / directory / f"{name}.binary").read_bytes() for directory in ("copy", "whole"))
            self.assertEqual(copy[:12], whole[:12])
            count = 3 * voxels(self.WHOLE)
            for a, b in zip(struct.unpack_from(f"<{count}d", copy, 12), struct.unpack_from(f"<{count}d", whole, 12)):
                self.assertLess(abs(a / b - 1), 1e-15)
        self.assertIn("over 2 pi", output)
        result = self.run_program("database", "write", "odd", "--database", "half", "--phi-d-range", "2pi", "--quiet")
        self.assertEqual(result.returncode, SUCCESS)
        self.assertIn("(--phi-d-range 2pi)", self.only_line(result.stderr))


if __name__ == "__main__":
    support.main()
