"""merl-scan judge: what is in a kit, and what is refused."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import support
from reference_selection import write_reference_selection
from support import INPUT, OUTPUT, PROGRAM, USAGE, Case, read_csv, read_json, write_database

KIT = ["index.html", "kit.json"]


def page_data(path):
    """What the script of the page reads: the data, and how many images there are."""
    text = path.read_text(encoding="utf-8")
    def element(name):
        return json.loads(text.split(f'<script type="application/json" id="{name}">')[1]
                          .split("</script>")[0])
    return element("data"), element("images")


class Judge(Case):
    @classmethod
    def setUpClass(cls):
        """One scan is enough for all tests."""
        cls.scanned = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        write_database(cls.scanned / "db", 9)
        subprocess.run([PROGRAM, "scan", "--database", "db", "--select", "10", "--out", "results",
                        "--quiet"], cwd=cls.scanned, check=True)

    def make_selection(self):
        shutil.copytree(self.scanned, self.work, dirs_exist_ok=True)

    def judge(self, *options, out="kit"):
        output = self.assert_success("judge", "--selection", "results/selection.csv", "--database",
                                     "db", "--size", "32", "--out", out, *options)
        return output, read_json(self.work / out / "kit.json")

    def test_kit(self):
        self.make_selection()
        output, kit = self.judge("--sentinels", "2", "--random", "3", "--repeats", "20")
        self.assertEqual(sorted(p.name for p in (self.work / "kit").iterdir()), KIT)
        header, rows = read_csv(self.work / "results" / "selection.csv")
        self.assertEqual(kit["metrics"], ["cwcbrt", "pawcielab"])
        kinds = [t["kind"] for t in kit["trials"]]
        self.assertEqual(kinds[:10], ["selection"] * 10)
        self.assertEqual(kinds.count("random"), 3)
        self.assertEqual(kinds.count("repeat"), 2)
        self.assertIn(f"{len(kinds)}: 10 of the selection, 2 repeats", output)
        pairs = len(read_csv(self.work / "results" / "pairs.csv")[1])
        candidates = max(20, pairs // 50)
        self.assertIn(f"2 of 2, from the {candidates} closest and the {candidates} farthest", output)
        self.assertEqual(kit["options"]["sentinel_pairs"], candidates)
        for number, (trial, row) in enumerate(zip(kit["trials"], rows), 1):
            self.assertEqual((trial["configuration"], trial["left"] + trial["right"]),
                             (number, row[1:5]))
            self.assertEqual(trial["agreement"], float(row[-1]))
        distances = {frozenset(r[:2]): (float(r[2]), float(r[3]))
                     for r in read_csv(self.work / "results" / "pairs.csv")[1]}
        for trial in kit["trials"][10:]:
            left, right = (distances[frozenset(trial[side])] for side in ("left", "right"))
            if trial["kind"] == "sentinel":
                near, far = (left, right) if trial["expected"] == 1 else (right, left)
                self.assertTrue(near[0] < far[0] and near[1] < far[1])
            elif trial["kind"] == "random":
                self.assertTrue(left[0] <= right[0] and left[1] >= right[1])
        data, images = page_data(self.work / "kit" / "index.html")
        self.assertEqual(data["kit_hash"], kit["kit_hash"])
        self.assertEqual(len(images), len(data["materials"]))
        shown = [[[data["materials"][m] for m in t[side]] for side in ("left", "right")]
                 for t in data["trials"]]
        self.assertEqual(shown, [[t["left"], t["right"]] for t in kit["trials"]])
        # Judges, and whoever looks at the page's source, see no metric and no expectation.
        self.assertNotIn("expected", json.dumps(data))
        self.assertNotIn("pawcielab", json.dumps(data))

    def test_same_seed_same_kit(self):
        self.make_selection()
        kits = [self.judge("--seed", seed, out=f"kit{i}")[1]["kit_hash"]
                for i, seed in enumerate(("1", "1", "2"))]
        self.assertEqual(kits[0], kits[1])
        self.assertNotEqual(kits[0], kits[2])
        brighter = self.judge("--seed", "1", "--exposure", "1", out="brighter")[1]["kit_hash"]
        self.assertNotEqual(kits[0], brighter)

    def test_several_lights(self):
        self.make_selection()
        _, kit = self.judge("--light", "1,1,1", "--light", "-1,0,1", "--light", "0,0,1")
        self.assertEqual(kit["options"]["lights"], [[1, 1, 1], [-1, 0, 1], [0, 0, 1]])
        images = page_data(self.work / "kit" / "index.html")[1]
        self.assertEqual({len(lights) for lights in images}, {3})
        self.assertEqual(len({image for lights in images for image in lights}), 3 * len(images))

    def test_pairs_are_elsewhere_or_missing(self):
        self.make_selection()
        shutil.move(self.work / "results" / "pairs.csv", self.work / "p.csv")
        arguments = ("judge", "--selection", "results/selection.csv", "--database", "db", "--out",
                     "kit", "--size", "16")
        self.assert_refused(INPUT, ["pairs.csv is missing", "--pairs", "--sentinels 0"], *arguments)
        self.assert_success(*arguments, "--pairs", "p.csv")
        self.assert_success(*arguments, "--sentinels", "0", "--random", "0", "--force")
        self.assertEqual({t["kind"] for t in read_json(self.work / "kit" / "kit.json")["trials"]},
                         {"selection", "repeat"})

    def test_other_scan(self):
        self.make_selection()
        self.scan("--database", "db", "--metrics", "rmse,pawcielab", out="other")
        arguments = ("judge", "--selection", "results/selection.csv", "--database", "db")
        self.assert_refused(INPUT, ["other/pairs.csv", "cwcbrt"], *arguments, "--pairs",
                            "other/pairs.csv")
        text = (self.work / "results" / "pairs.csv").read_text()
        first, rest = text.split("\n", 1)
        (self.work / "edited.csv").write_text(first + "\n" + rest.replace(",0.", ",1.").replace(
            ",1", ",2"))
        self.assert_refused(INPUT, ["edited.csv", "same scan"], *arguments, "--pairs", "edited.csv")
        self.assert_refused(INPUT, ["material \"m0", "--database"], "judge", "--selection",
                            "results/selection.csv", "--database", "built-in")

    def test_bad_selection(self):
        self.make_selection()
        path = self.work / "results" / "selection.csv"
        lines = path.read_text().splitlines()
        for words, text in (
            (["no row after the header"], lines[0]),
            (["empty"], ""),
            (["rank"], "\n".join([lines[0], lines[2]])),
            (["columns"], "a,b\n1,2"),
        ):
            path.write_text(text)
            self.assert_refused(INPUT, ["selection.csv", *words], "judge", "--selection",
                                "results/selection.csv", "--database", "db")
        self.assert_refused(INPUT, ["nope.csv"], "judge", "--selection", "nope.csv")

    def test_name_that_is_no_text(self):
        os.makedirs(self.work / "db")
        write_database(self.work / "db2", 5)
        for i, file in enumerate(sorted((self.work / "db2").iterdir())):
            os.rename(file, os.fsencode(self.work / "db") + b"/\xff%d.binary" % i)
        (self.work / "db2").rmdir()
        self.scan("--database", "db", out="results")
        self.assert_refused(INPUT, ["UTF-8", "\\xff"], "judge", "--selection",
                            "results/selection.csv", "--database", "db")

    def test_bad_options(self):
        self.make_selection()
        for words, *options in (
            (["--repeats", '"101"'], "--repeats", "101"), (["--seed", '"-1"'], "--seed", "-1"),
            (["--seed"], "--seed", str(2 ** 53)), (["--light", '"0,0,0"'], "--light", "0,0,0"),
            (["--sentinels"], "--sentinels", "2000"),
        ):
            self.assert_refused(USAGE, words, "judge", "--selection", "results/selection.csv",
                                "--database", "db", *options)
        (self.work / "there").mkdir()
        self.assert_refused(OUTPUT, ["there", "--force"], "judge", "--selection",
                            "results/selection.csv", "--database", "db", "--out", "there")


class ReferenceJudge(Case):
    """The kit of a reference scan: an original between two approximations."""

    @classmethod
    def setUpClass(cls):
        cls.scanned = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.disagreements = write_reference_selection(cls.scanned)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.scanned, self.work, dirs_exist_ok=True)

    def judge(self, *options, out="kit"):
        output = self.assert_success("judge", "--selection", "results/selection.csv", "--size", "16",
                                     "--out", out, *options)
        return output, read_json(self.work / out / "kit.json")

    def test_kit(self):
        self.assertGreater(self.disagreements, 11)
        output, kit = self.judge("--sentinels", "3", "--random", "2", "--repeats", "20")
        self.assertIn('looks more like the original, of "measured"?', output)
        self.assertIn("15: 8 of the selection, 2 repeats, 3 sentinels, 2 random disagreements", output)
        self.assertIn("3 of 3, an original itself against one of the 20 farthest approximations",
                      output)
        self.assertEqual((kit["reference"], kit["options"]["sentinel_pairs"]), ("measured", 20))
        # The original has a place of its own on the screen.
        self.assertEqual(kit["options"]["randomise"], {"sides": True, "pairs": False, "order": True})
        _, rows = read_csv(self.work / "results" / "selection.csv")
        for trial, row in zip(kit["trials"], rows):
            self.assertEqual(trial["left"] + trial["right"], row[1:5])
        header, rows = read_csv(self.work / "results" / "approximations.csv")
        distances = {row[1]: tuple(map(float, row[3:5])) for row in rows}
        selected = {frozenset((t["left"][1], t["right"][1])) for t in kit["trials"][:8]}
        for trial in kit["trials"]:
            original, left = trial["left"]
            same, right = trial["right"]
            self.assertEqual(original, same)
            self.assertTrue(original.startswith("measured/"))
            name = original.removeprefix("measured/")
            if trial["kind"] == "sentinel":
                itself, other = (left, right) if trial["expected"] == 1 else (right, left)
                self.assertEqual(itself, original)
                self.assertTrue(other.endswith("/" + name) and other != original)
            else:
                self.assertEqual({m.split("/")[1] for m in (left, right)}, {name})
                self.assertEqual(len({left, right, original}), 3)
            if trial["kind"] == "random":
                self.assertNotIn(frozenset((left, right)), selected)
                self.assertLessEqual(distances[left][0], distances[right][0])
                self.assertGreaterEqual(distances[left][1], distances[right][1])
        practice = kit["practice"]
        self.assertEqual(practice["left"], [practice["right"][0]] * 2)
        data, images = page_data(self.work / "kit" / "index.html")
        self.assertEqual((data["task"], len(images)), ("reference", len(data["materials"])))
        self.assertNotIn("expected", json.dumps(data))
        self.assertNotIn("cwcbrt", json.dumps(data))

    def test_all_disagreements_there_are(self):
        output, kit = self.judge("--random", "1000", "--sentinels", "0")
        there = self.disagreements - 8
        self.assertEqual([t["kind"] for t in kit["trials"]].count("random"), there)
        self.assertIn(f"random          {there} of 1000: no more disagreements were found", output)

    def test_a_selection_of_pairs_is_of_pairs(self):
        write_database(self.work / "db", 6)
        self.scan("--database", "db", "--select", "3", out="other")
        self.assert_success("judge", "--selection", "other/selection.csv", "--size", "16", "--out",
                            "kit", "--sentinels", "0", "--random", "0")
        self.assertNotIn("reference", read_json(self.work / "kit" / "kit.json"))
        self.assertEqual(page_data(self.work / "kit" / "index.html")[0]["task"], "pairs")

    def test_approximations_are_missing_or_of_another_scan(self):
        arguments = ("judge", "--selection", "results/selection.csv", "--size", "16", "--out", "kit")
        path = self.work / "results" / "approximations.csv"
        text = path.read_text()
        path.rename(self.work / "a.csv")
        self.assert_refused(INPUT, ["approximations.csv is missing", "--pairs", "--sentinels 0"],
                            *arguments)
        self.assert_success(*arguments, "--pairs", "a.csv")
        self.assert_success(*arguments, "--sentinels", "0", "--random", "0", "--force")
        self.assertEqual({t["kind"] for t in read_json(self.work / "kit" / "kit.json")["trials"]},
                         {"selection", "repeat"})
        first = read_csv(self.work / "results" / "selection.csv")[1][0]
        path.write_text(text.replace(f"{first[2]},", "other/m00,", 1))
        arguments = (*arguments, "--force")
        self.assert_refused(INPUT, ["approximations.csv", first[2], "same scan"], *arguments)
        path.write_text(text.replace(first[5], "123", 1))
        self.assert_refused(INPUT, ["approximations.csv", "at 123 and", "row 1"], *arguments)
        path.write_text(text.replace(",pawcielab", ",other", 1))
        self.assert_refused(INPUT, ["approximations.csv", '"pawcielab"'], *arguments)

    def test_the_selection_is_not_of_originals(self):
        summary = read_json(self.work / "results" / "summary.json")
        summary["reference"]["label"] = "abc"
        (self.work / "results" / "summary.json").write_text(json.dumps(summary))
        self.assert_refused(INPUT, ["selection.csv, row 1", '"abc/…", first on both sides'], "judge",
                            "--selection", "results/selection.csv")


if __name__ == "__main__":
    support.main()
