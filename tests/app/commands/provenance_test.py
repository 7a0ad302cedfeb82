"""What comes after a scan shows what was scanned: judge, render, votes and score; files that change
while they are read; formats."""

import csv
import json
import os
import pathlib
import random
import shutil
import subprocess
import tempfile

import support
from support import INPUT, PROGRAM, SUCCESS, Case, merl_bytes, read_json, samples, write_database
from tables import write_table

# Like some of the stand-in, so that nothing but the content tells which database they are of.
NAMES = ["alum-bronze", "aluminium", "black-fabric", "blue-rubber", "chrome", "gold-paint",
         "green-fabric", "teflon", "white-paint"]
OLD = pathlib.Path(__file__).parents[2] / "data" / "before-formats"


def old_samples(m):
    """Of the database that the files in OLD are of: whole numbers, the same on every machine."""
    return [float((i * i + 7 * m * i + 13 * m) % (97 + m) + 1) for i in range(3 * 240)]


class Provenance(Case):
    """Each test has a database `db` and a scan of it in `results`."""

    @classmethod
    def setUpClass(cls):
        cls.scanned = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_database(cls.scanned / "db", {name: samples(i) for i, name in enumerate(NAMES)})
        subprocess.run([PROGRAM, "scan", "--database", "db", "--select", "10", "--out", "results",
                        "--quiet"], cwd=cls.scanned, check=True)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.scanned, self.work, dirs_exist_ok=True, copy_function=shutil.copy)
        # A copied summary names the directory of the first scan; here it is the one of this test.
        self.edit("results/summary.json",
                  lambda summary: summary["database"].update(path=str(self.work / "db")))
        self.summary = read_json(self.work / "results" / "summary.json")

    def edit(self, file, change):
        path = self.work / file
        content = read_json(path)
        change(content)
        path.write_text(json.dumps(content))

    judge = ("judge", "--selection", "results/selection.csv", "--size", "16")

    def make_kit(self, *options, out="kit"):
        self.assert_success(*self.judge, "--out", out, *options)
        return read_json(self.work / out / "kit.json")

    def warned(self, words, *arguments):
        """Runs the program, which must succeed and warn in one line that has all these words."""
        result = self.run_program(*arguments)
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        line = self.only_line(result.stderr)
        for word in ("merl-scan: warning: ", *words):
            self.assertIn(word, line)

    def change(self, directory, material):
        """Changes one sample below the horizon."""
        path = self.work / directory / f"{material}.binary"
        data = bytearray(path.read_bytes())
        data[-8] ^= 1
        path.write_bytes(data)

    def vote(self, kit, name="anna", vote=3):
        """The file of a judge who always says the same."""
        path = self.work / f"votes-{name}.csv"
        with open(path, "w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["judge", "trial", "configuration", "kind", "left_1", "left_2", "right_1",
                           "right_2", "swapped", "vote", "response_ms", "seed", "kit_hash"])
            for i, trial in enumerate(kit["trials"], 1):
                rows.writerow([name, i, trial["configuration"], trial["kind"], *trial["left"],
                               *trial["right"], 0, vote, 1000, kit["seed"], kit["kit_hash"]])
        return path.name


class Judge(Provenance):
    def test_shows_what_was_scanned(self):
        kit = self.make_kit()
        database = kit["database"]
        self.assertEqual((database["name"], database["kind"], database["checked"]),
                         ("db", "MERL directory", True))
        self.assertEqual(database["content_hash"], self.summary["database"]["content_hash"])
        shown = {name for trial in kit["trials"] for name in trial["left"] + trial["right"]}
        self.assertEqual(set(database["material_hashes"]), shown)
        for name, content in database["material_hashes"].items():
            self.assertEqual(content, self.summary["database"]["material_hashes"][name])
        self.assertEqual(kit["warnings"], [])
        # From another working directory too.
        (self.work / "elsewhere").mkdir()
        result = subprocess.run([PROGRAM, "judge", "--selection", "../results/selection.csv", "--size",
                                 "16"], cwd=self.work / "elsewhere", check=False, timeout=300)
        self.assertEqual(result.returncode, SUCCESS)

    def test_a_copy_of_the_database_will_do(self):
        shutil.copytree(self.work / "db", self.work / "copy")
        self.assertEqual(self.make_kit("--database", "copy")["database"]["material_hashes"],
                         self.make_kit(out="kit2")["database"]["material_hashes"])

    def test_other_content_is_refused(self):
        self.assert_refused(INPUT, ["ABC fits", "not those that were scanned", "content hash",
                                    "results/summary.json"], *self.judge, "--database", "built-in")
        self.change("db", "teflon")
        for option in (), ("--database", "db"):
            self.assert_refused(INPUT, ['"teflon" in db', "not those that were scanned"],
                                *self.judge, *option)
        # A material with the samples of another.
        shutil.copy(self.work / "db" / "chrome.binary", self.work / "db" / "teflon.binary")
        self.assert_refused(INPUT, ['"teflon" in db'], *self.judge)

    def test_a_database_that_has_moved(self):
        shutil.move(self.work / "db", self.work / "moved")
        self.assert_refused(INPUT, [f"{self.work}/db", "results/summary.json", "not there any more",
                                    "--database"], *self.judge)
        self.make_kit("--database", "moved")

    def test_a_database_without_a_place(self):
        """As that of another program: in memory."""
        summary = read_json(self.work / "results" / "summary.json")
        summary["database"] |= {"kind": "in memory", "path": None}
        (self.work / "results" / "summary.json").write_text(json.dumps(summary))
        self.assert_refused(INPUT, ["results/summary.json does not say where", "in memory",
                                    "--database"], *self.judge)

    def test_without_a_summary(self):
        (self.work / "results" / "summary.json").unlink()
        self.assert_refused(INPUT, ["results/summary.json is missing", "results/selection.csv",
                                    "--database", "built-in"], *self.judge)
        self.warned(["summary.json is missing", "db", "not checked"], *self.judge, "--database", "db")
        kit = read_json(self.work / "merl-scan-kit" / "kit.json")
        self.assertFalse(kit["database"]["checked"])
        self.assertIn("not checked", kit["warnings"][0])
        for text in " ", "[]", "{", "no", '{"a": 1}':
            (self.work / "results" / "summary.json").write_text(text)
            self.assert_refused(INPUT, ["summary.json is no summary of merl-scan"], *self.judge,
                                "--out", "other")
        (self.work / "results" / "summary.json").write_text("")
        self.assert_refused(INPUT, ["summary.json: is empty", "--database"], *self.judge, "--out",
                            "other")

    def test_results_that_do_not_belong_together(self):
        selection = self.work / "results" / "selection.csv"
        whole = selection.read_text()
        selection.write_text("".join(whole.splitlines(True)[:5]))
        self.assert_refused(INPUT, ["results/summary.json is not of this selection.csv", "edited"],
                            *self.judge)
        selection.write_text(whole)
        pairs = self.work / "results" / "pairs.csv"
        pairs.write_text(pairs.read_text().replace("float32", "float16"))
        self.assert_refused(INPUT, ["results/pairs.csv", "results/summary.json"], *self.judge)
        self.make_kit("--pairs", "results/pairs.csv")

    def test_distances_from_a_table(self):
        numbers = random.Random(3)
        write_table(self.work / "t.csv", ["one", "two"], NAMES, lambda _: numbers.random())
        self.scan("--distances", "t.csv", "--select", "5", out="other")
        judge = ("judge", "--selection", "other/selection.csv", "--size", "16")
        self.assert_refused(INPUT, ["other/summary.json", "t.csv", "--database"], *judge)
        self.warned(["other/summary.json", "not checked"], *judge, "--database", "db", "--quiet")
        kit = read_json(self.work / "merl-scan-kit" / "kit.json")
        self.assertEqual((kit["database"]["checked"], kit["database"]["content_hash"]), (False, None))

    def test_the_built_in_database(self):
        self.scan("--select", "2", "--disagreements", "0", out="abc")
        self.assertEqual(read_json(self.work / "abc" / "summary.json")["database"]["path"], "abc")
        judge = ("judge", "--selection", "abc/selection.csv", "--size", "16", "--sentinels", "0",
                 "--random", "0")
        self.assert_success(*judge)
        database = read_json(self.work / "merl-scan-kit" / "kit.json")["database"]
        self.assertEqual((database["kind"], database["checked"]), ("built-in stand-in", True))
        self.assert_success(*judge, "--database", "built-in", "--force")

    def test_names_that_are_no_text(self):
        directory = os.fsencode(self.work / "d\\x41")
        os.mkdir(directory)
        for i in range(5):
            path = os.path.join(directory, b"\\x5c\\x41%d.binary" % i)
            with open(path, "wb") as file:
                file.write(merl_bytes(samples(i)))
        self.scan("--database", "d\\x41", out="other")
        self.assert_success("judge", "--selection", "other/selection.csv", "--size", "16")


class Render(Provenance):
    def test_the_materials_of_a_selection(self):
        (self.work / "results" / "selection.csv").chmod(0o644)
        self.assert_success("render", "--selection", "results/selection.csv", "--size", "16", "--out",
                            "out")
        with open(self.work / "results" / "selection.csv", newline="", encoding="utf-8") as file:
            selected = {name for row in list(csv.reader(file))[1:] for name in row[1:5]}
        self.assertEqual({p.stem for p in (self.work / "out").glob("*.exr")}, selected)
        for name in selected:
            content = self.summary["database"]["material_hashes"][name].encode()
            for extension in "png", "exr":
                self.assertIn(b"; content " + content,
                              (self.work / "out" / f"{name}.{extension}").read_bytes())
        self.assert_success("render", "--selection", "results/selection.csv", "--size", "16", "--out",
                            "one.exr", "--material", "chrome")
        self.assertEqual((self.work / "one.png").read_bytes(),
                         (self.work / "out" / "chrome.png").read_bytes())

    def test_other_content_is_refused(self):
        self.change("db", "chrome")
        self.assert_refused(INPUT, ['"chrome" in db', "not those that were scanned"], "render",
                            "--selection", "results/selection.csv", "--material", "chrome")
        self.assert_refused(INPUT, ["ABC fits", "not those that were scanned"], "render",
                            "--selection", "results/selection.csv", "--database", "built-in",
                            "--size", "16")
        (self.work / "results" / "summary.json").unlink()
        self.assert_refused(INPUT, ["summary.json is missing"], "render", "--selection",
                            "results/selection.csv")


class Votes(Provenance):
    def setUp(self):
        super().setUp()
        self.votes = ("votes", "votes-anna.csv", "--selection", "results/selection.csv")

    def test_one_sequence_without_naming_the_database_again(self):
        """What README shows: scan, judge, render, votes, score."""
        self.vote(self.make_kit("--sentinels", "0", "--random", "2"))
        self.assert_success("render", "--selection", "results/selection.csv", "--size", "16", "--out",
                            "spheres")
        self.assert_success(*self.votes, "--kit", "kit/kit.json", "--spheres", "spheres", "--out",
                            "analysis")
        summary = read_json(self.work / "analysis" / "summary.json")
        self.assertEqual(summary["database"], self.summary["database"])
        self.assertEqual(summary["warnings"], [])
        # The page is for others, whom it does not concern where the database is.
        self.assertNotIn(str(self.work), (self.work / "analysis" / "votes.html").read_text())
        score = ("score", "--judgements", "analysis/judgements.csv", "--metrics", "rmse",
                 "--out", "score", "--force")
        self.assert_success(*score)
        scored = read_json(self.work / "score" / "summary.json")
        self.assertEqual(scored["database"], self.summary["database"])
        # Another database is the user's explicit choice, and said.
        self.warned(["ABC fits", "other content", "analysis/summary.json"], *score, "--database",
                    "built-in")
        self.assertIn("other content", read_json(self.work / "score" / "summary.json")["warnings"][0])
        self.change("db", "chrome")
        self.assert_refused(INPUT, ["db: the content is not what was scanned", "--database"], *score)
        shutil.move(self.work / "db", self.work / "moved")
        self.assert_refused(INPUT, ["not there any more", "--database"], *score)

    def test_judgements_that_do_not_say_what_was_judged(self):
        self.vote(self.make_kit())
        self.assert_success(*self.votes, "--kit", "kit/kit.json", "--out", "analysis")
        score = ("score", "--metrics", "rmse", "--quiet", "--judgements")
        (self.work / "alone").mkdir()
        shutil.copy(self.work / "analysis" / "judgements.csv", self.work / "alone")
        self.warned(["alone/judgements.csv", "built-in stand-in"], *score, "alone/judgements.csv",
                    "--out", "alone/score")
        self.assertIn("stand-in", read_json(self.work / "alone" / "score" / "summary.json")["warnings"][0])
        self.assertIn("stand-in", (self.work / "alone" / "score" / "score.svg").read_text())
        self.assert_success(*score, "alone/judgements.csv", "--database", "db", "--out", "scored")
        judgements = self.work / "analysis" / "judgements.csv"
        judgements.write_text("".join(judgements.read_text().splitlines(True)[:-1]))
        self.assert_refused(INPUT, ["analysis/summary.json is not of this", "--database"], *score,
                            "analysis/judgements.csv", "--out", "again")

    def test_spheres_that_nothing_can_be_compared_with(self):
        self.vote(self.make_kit())
        (self.work / "alone").mkdir()
        shutil.copy(self.work / "results" / "selection.csv", self.work / "alone")
        self.assert_success("render", "--database", "db", "--size", "16", "--out", "spheres")
        self.warned(["spheres", "not checked"], "votes", "votes-anna.csv", "--selection",
                    "alone/selection.csv", "--spheres", "spheres", "--out", "analysis")

    def test_a_kit_of_other_materials_is_refused(self):
        # As an older version made it: of the stand-in, for votes on the user's own files.
        (self.work / "copy").mkdir()
        shutil.copy(self.work / "results" / "selection.csv", self.work / "copy")
        self.warned(["not checked"], "judge", "--selection", "copy/selection.csv", "--database",
                    "built-in", "--size", "16", "--sentinels", "0", "--random", "0", "--out", "kit")
        kit = read_json(self.work / "kit" / "kit.json")
        self.vote(kit)
        refused = (*self.votes, "--kit", "kit/kit.json")
        self.assert_refused(INPUT, ["kit.json", "built-in stand-in", "MERL directory",
                                    "results/summary.json"], *refused)
        self.edit("kit/kit.json", lambda kit: kit["database"].pop("material_hashes"))
        self.assert_refused(INPUT, ["kit.json", "built-in stand-in"], *refused)
        # Other files of the same kind.
        self.edit("kit/kit.json", lambda kit: kit.update(database={
            "name": "db", "kind": "MERL directory",
            "material_hashes": {"chrome": self.summary["database"]["material_hashes"]["teflon"]}}))
        self.assert_refused(INPUT, ["kit.json", '"chrome" has other content'], *refused)
        self.edit("kit/kit.json", lambda kit: kit["database"].pop("material_hashes"))
        self.warned(["kit.json", "not checked"], *refused)
        self.assertIn("not checked",
                      read_json(self.work / "merl-scan-votes" / "summary.json")["warnings"][0])

    def test_spheres_of_other_materials_are_refused(self):
        self.vote(self.make_kit("--sentinels", "0", "--random", "0"))
        self.assert_success("render", "--material", ",".join(NAMES[:5]), "--size", "16", "--out",
                            "stand-in")
        refused = (*self.votes, "--spheres")
        self.assert_refused(INPUT, ["stand-in/", ".png: shows other content", "render --selection"],
                            *refused, "stand-in")
        self.assert_success("render", "--database", "db", "--size", "16", "--out", "good")
        self.assert_success(*refused, "good", "--out", "out")
        shutil.copytree(self.work / "good", self.work / "mixed")
        os.replace(self.work / "mixed" / "chrome.png", self.work / "mixed" / "teflon.png")
        self.assert_refused(INPUT, ["mixed/teflon.png: shows other content"], *refused, "mixed")
        # Images from elsewhere say nothing.
        (self.work / "bare").mkdir()
        for name in NAMES[:3]:
            data = (self.work / "good" / f"{name}.png").read_bytes()
            length = int.from_bytes(data[33:37])
            self.assertEqual(data[37:41], b"iTXt")
            (self.work / "bare" / f"{name}.png").write_bytes(data[:33] + data[45 + length:])
        self.warned(["--spheres bare", "3 of 3 images", "not checked"], *refused, "bare", "--out",
                    "out2")
        # Without a summary the kit says what was shown.
        (self.work / "results" / "summary.json").unlink()
        self.warned(["results/summary.json is missing", "kit/kit.json", "not checked"], *self.votes,
                    "--kit", "kit/kit.json", "--out", "out3")
        self.assert_refused(INPUT, ["mixed/teflon.png"], *refused, "mixed", "--kit", "kit/kit.json")


class Formats(Provenance):
    def test_every_file_has_one(self):
        kit = self.make_kit()
        self.vote(kit)
        self.assert_success("votes", "votes-anna.csv", "--selection", "results/selection.csv", "--out",
                            "votes")
        self.assert_success("compare", "--database", "db", "--metrics", "rmse,cwcbrt", "--out",
                            "compare")
        self.assert_success("score", "--judgements", "votes/judgements.csv", "--metrics", "rmse",
                            "--out", "score")
        for directory in "results", "votes", "compare", "score":
            self.assertEqual(read_json(self.work / directory / "summary.json")["format"], 1)
        self.assertEqual(kit["format"], 1)

    def test_newer_and_impossible_ones_are_refused(self):
        self.vote(self.make_kit())
        votes = ("votes", "votes-anna.csv", "--selection", "results/selection.csv", "--kit",
                 "kit/kit.json")
        for value, words in ((2, ["written by a newer merl-scan", "format 2"]), (0, ["found 0"]),
                             ("1", ['found "1"']), (1.5, ["found 1.5"]), (None, ["found null"])):
            self.edit("kit/kit.json", lambda kit, value=value: kit.update(format=value))
            self.assert_refused(INPUT, ["kit/kit.json", *words], *votes)
            self.edit("results/summary.json", lambda summary, value=value: summary.update(format=value))
            self.assert_refused(INPUT, ["results/summary.json", *words], *self.judge)
            self.assert_refused(INPUT, ["results/summary.json", *words], *votes[:-2])
            self.edit("results/summary.json", lambda summary: summary.update(format=1))
        for bad in [2], {"a": 2}, "2", -1:
            self.edit("kit/kit.json", lambda kit: kit.update(format=bad))
            self.assert_refused(INPUT, ["kit/kit.json", "format"], *votes)
            self.edit("kit/kit.json", lambda kit: kit.update(format=1))

    def test_files_of_before_are_read(self):
        """OLD was written by version 0.1.0 before there were formats."""
        shutil.copytree(OLD, self.work / "old")
        shutil.rmtree(self.work / "db")
        write_database(self.work / "db", {f"m{m}": old_samples(m) for m in range(5)})
        judge = ("judge", "--selection", "old/selection.csv", "--size", "16", "--out", "new")
        self.assert_success(*judge)
        database = read_json(self.work / "new" / "kit.json")["database"]
        self.assertTrue(database["checked"])
        self.assertEqual(database["content_hash"],
                         read_json(OLD / "summary.json")["database"]["content_hash"])
        self.vote(read_json(OLD / "kit.json"))
        self.warned(["old/kit.json", "not checked"], "votes", "votes-anna.csv", "--selection",
                    "old/selection.csv", "--kit", "old/kit.json", "--out", "votes")
        # The new kit's hashes have nothing to be compared with in the old summary.
        self.vote(read_json(self.work / "new" / "kit.json"))
        self.warned(["old/summary.json", "not checked"], "votes", "votes-anna.csv", "--selection",
                    "old/selection.csv", "--kit", "new/kit.json", "--out", "votes2")
        self.change("db", "m1")
        self.assert_refused(INPUT, ["db: the content is not what was scanned", "old/summary.json"],
                            *judge, "--force")
        selection = self.work / "old" / "selection.csv"
        selection.write_text("".join(selection.read_text().splitlines(True)[:3]))
        self.assert_refused(INPUT, ["old/summary.json is not of this"], *judge, "--force")


class Changing(Case):
    """A file that is replaced by another at its Nth opening."""

    def test_between_the_passes(self):
        write_database(self.work / "db", 13, (20, 20, 30))
        # The seventh takes part in what is refined; its place is taken by another whole file.
        (self.work / "other").write_bytes(merl_bytes(samples(99, (20, 20, 30)), (20, 20, 30)))
        change = {"LD_PRELOAD": os.environ["CHANGE_ON_OPEN"], "CHANGE_FILE": "/m06.binary",
                  "CHANGE_TO": "other", "CHANGE_COUNT": "count",
                  # AddressSanitizer would be first.
                  "ASAN_OPTIONS": "verify_asan_link_order=0"}

        def openings(*command):
            self.assert_success(*command, "--database", "db", "--out", command[0], **change,
                                CHANGE_AT="0")
            return int((self.work / "count").read_text())

        # What is compared is not refined.
        fast, all_of_them = openings("compare", "--metrics", "cwcbrt,pawcielab"), openings("scan")
        self.assertGreater(all_of_them, fast)
        keep = (self.work / "db" / "m06.binary").read_bytes()
        for at in 2, fast, fast + 1, all_of_them:
            with self.subTest(at):
                result = self.run_program("scan", "--database", "db", **change, CHANGE_AT=str(at))
                self.assertEqual(result.returncode, INPUT, result.stderr)
                line = self.only_line(result.stderr)
                self.assertIn("db/m06.binary: changed while it was read", line)
                self.assertFalse((self.work / "merl-scan-results").exists())
            (self.work / "db" / "m06.binary").rename(self.work / "other")
            (self.work / "db" / "m06.binary").write_bytes(keep)
        # Before it is opened first, it is simply what is scanned.
        self.assert_success("scan", "--database", "db", **change, CHANGE_AT="1")


if __name__ == "__main__":
    support.main()
