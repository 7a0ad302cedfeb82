"""Every file that a command writes is its own, is replaced with the others, and is documented."""

import pathlib
import random
import re

import support
from support import OUTPUT, Case, write_database
from tables import COLUMNS, write_rows, write_table

FORMATS = pathlib.Path(__file__).parents[3] / "docs" / "file-formats.md"

TABLES = r"[a-z_]+\.(?:csv|json|html|svg)"


def section(command):
    """What docs/file-formats.md says of the files of a command."""
    text = FORMATS.read_text(encoding="utf-8")
    return text.split(f"## What `merl-scan {command}` writes\n")[1].split("\n## ")[0]


class Documented(Case):
    warns = True

    def setUp(self):
        super().setUp()
        names = [f"m{i}" for i in range(6)]
        numbers = random.Random(3)
        write_database(self.work / "db", 6)
        write_table(self.work / "t.csv", ["one", "two"], names,
                    lambda _: numbers.uniform(1, 9))
        write_rows(self.work / "said.csv", ["reference", "a", "b", "votes_a", "votes_b"],
                   [["m0", "m1", "m2", 3, 1]])

    def results(self, command, *options):
        """Runs the command, which must write, own and replace the same files; returns their
        names."""
        words = [*command.split(), *options, "--quiet"]
        out = self.work / "out"
        words += [out] if command == "database write" else ["--out", out]
        self.assert_success(*words)
        names = sorted(file.name for file in out.iterdir())
        for name in names:
            (out / name).write_text("old")
        self.assert_success(*words, "--force")
        self.assertEqual(sorted(file.name for file in out.iterdir()), names)
        for name in names:
            self.assertNotEqual((out / name).read_bytes(), b"old", name)
        for name in names:
            with self.subTest(command=command, stands_in_the_way=name):
                (out / name).rename(self.work / "aside")
                (out / name).mkdir()
                self.assert_refused(OUTPUT, [name], *words, "--force")
                (out / name).rmdir()
                (self.work / "aside").rename(out / name)
        return names

    def assert_tables(self, command, *options):
        """Help and docs/file-formats.md name the files that are written and no others."""
        names = self.results(command, *options)
        documented = re.findall(rf"^- \*\*`({TABLES})`\*\*", section(command), re.MULTILINE)
        self.assertEqual(sorted(documented), names)
        usage = self.assert_success(command, "--help")
        (writes,) = re.findall(r"^Writes (.*?)\.\s", usage, re.MULTILINE | re.DOTALL)
        self.assertEqual(sorted(re.findall(TABLES, writes)), names)

    def assert_images(self, command, of_material, *options):
        """docs/file-formats.md names the files, with NAME for a material."""
        text = section(command).replace("\n", " ")
        names = self.results(command, *options)
        self.assertTrue(any(re.search(of_material, name) for name in names), names)
        for name in names:
            general = re.sub(of_material, "NAME", name)
            general = re.sub(r"^(figure-4\.4-).*(\.\w+)$", r"\1…\2", general)
            stem, kind = general.rsplit(".", 1)
            spellings = f"`{general}`", f"`{stem}.exr` and `.{kind}`"
            self.assertTrue(any(s in text for s in spellings), f"{general} is not documented")

    def test_scan(self):
        self.assert_tables("scan", "--distances", "t.csv")

    def test_scan_of_approximations(self):
        write_rows(self.work / "fits.csv", ["material_a", "material_b", "one", "two"],
                   [["org/m", "a/m", 1, 2], ["org/m", "b/m", 2, 1]])
        names = self.results("scan", "--distances", "fits.csv", "--reference", "org")
        documented = re.findall(rf"^- \*\*`({TABLES})`\*\*", section("scan --reference"), re.MULTILINE)
        self.assertEqual(sorted(documented), names)
        usage = self.assert_success("scan", "--help")
        for name in names:
            self.assertIn(name, usage)

    def test_compare(self):
        self.assert_tables("compare", "--distances", "t.csv")

    def test_score(self):
        self.assert_tables("score", "--distances", "t.csv", "--judgements", "said.csv")

    def test_score_of_ratings(self):
        write_rows(self.work / "r.csv", ["original", "approximation", "rating"],
                   [["m0", "m1", 3], ["m0", "m2", 4]])
        names = self.results("score", "--distances", "t.csv", "--ratings", "r.csv")
        documented = re.findall(rf"^- \*\*`({TABLES})`\*\*", section("score --ratings"), re.MULTILINE)
        self.assertEqual(sorted(documented), names)
        usage = self.assert_success("score", "--help")
        (writes,) = re.findall(r"With --ratings it writes (.*?)\.\s", usage, re.DOTALL)
        self.assertEqual(sorted(re.findall(TABLES, writes)), names)

    def test_tune(self):
        write_rows(self.work / "said.csv", ["reference", "a", "b", "votes_a", "votes_b"],
                   [["m00", "m01", "m02", 3, 1]])
        self.assert_tables("tune", "--metric", "ngan", "--evaluations", "1", "--database", "db", "--judgements",
                           "said.csv")

    def test_votes(self):
        scanned = self.scan("--distances", "t.csv", "--select", "4", out="scanned")
        _, rows = support.read_csv(scanned / "selection.csv")
        write_rows(self.work / "ann.csv", COLUMNS,
                   [["ann", i + 1, row[0], "selection", *row[1:5], 0, 1, 900, 7, "kit-1"]
                    for i, row in enumerate(rows)])
        self.assert_tables("votes", "ann.csv", "--selection", scanned / "selection.csv")

    def test_judge(self):
        scanned = self.scan("--database", "db", "--select", "4", out="scanned")
        self.assert_tables("judge", "--selection", scanned / "selection.csv", "--size", "16",
                           "--sentinels", "0")

    def test_render(self):
        self.assert_images("render", r"m0\d", "--database", "db", "--size", "16")

    def test_slices(self):
        self.assert_images("slices", "chrome", "--materials", "chrome")

    def test_database_write(self):
        self.assert_images("database write", r"m0\d", "--database", "db")


if __name__ == "__main__":
    support.main()
