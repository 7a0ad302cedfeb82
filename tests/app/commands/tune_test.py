"""merl-scan tune: what it fits, what it says that is worth, and what it refuses."""

import math
import os
import random
import re

import support
from support import INPUT, OUTPUT, USAGE, Case, read_csv, read_json, write_database
from tables import write_rows

FILES = ["folds.csv", "parameters.csv", "summary.json", "tune.csv"]

REFERENCE = ["reference", "a", "b", "votes_a", "votes_b"]

GRID = (24, 12, 24)  # enough layers of theta_h for the windows of gloss-contrast

TRUTH = "gloss-contrast:haze=0.2:gloss=2"

# Of few voxels, so that computing it anew for every evaluation takes no time.
OWN = """// title: Weighted channels
// degree: 1
// parameter: red = 1 in [0, 10] weight
// parameter: still = 2 in [2, 2] nothing else
vec3 transform(vec3 f, Voxel v) { return vec3(red * f.x, f.y, still * 0.0); }
float weight(Voxel v) { return 1.0; }
float difference(float d) { return abs(d); }
"""


class Tune(Case):
    warns = True  # of the stand-in, which is meant here

    def said(self, metric, *database, count=500, votes=40, name="said.csv"):
        """Judgements of judges who follow a metric: the choice model with slope 2."""
        results = self.work / "truth"
        self.assert_success("compare", "--metrics", f"{metric},cwcbrt", "--out", results, "--force", *database)
        _, rows = read_csv(results / "distances.csv")
        distance = {frozenset(row[:2]): float(row[2]) for row in rows}
        materials = sorted({material for row in rows for material in row[:2]})
        numbers = random.Random(5)
        judgements = []
        for _ in range(count):
            r, a, b = numbers.sample(materials, 3)
            x = math.log(distance[frozenset((r, b))] / distance[frozenset((r, a))])
            p = 1 / (1 + math.exp(-2 * x))
            votes_a = round(votes * p)
            judgements.append([r, a, b, votes_a, votes - votes_a])
        write_rows(self.work / name, REFERENCE, judgements)
        return distance, judgements

    def tune(self, *options, out="tuned", judgements="said.csv"):
        self.output = self.assert_success("tune", "--judgements", judgements, "--out", out, *options)
        return self.work / out

    def test_finds_what_judges_follow(self):
        distance, judgements = self.said(TRUTH)
        results = self.tune("--metric", "gloss-contrast:gloss=0.5", "--fit", "haze,gloss", "--evaluations", "300")
        self.assertEqual(sorted(os.listdir(results)), FILES)
        header, rows = read_csv(results / "parameters.csv")
        found = {row[0]: dict(zip(header, row)) for row in rows}
        self.assertEqual(list(found), ["haze", "gloss"])
        self.assertEqual((found["haze"]["before"], found["gloss"]["before"]), ("0.44", "0.5"))
        self.assertAlmostEqual(float(found["haze"]["after"]), 0.2, delta=0.02)
        self.assertAlmostEqual(float(found["gloss"]["after"]), 2, delta=0.1)
        for row in found.values():
            self.assertLessEqual(float(row["materials_least"]), float(row["materials_most"]))
            self.assertEqual((row["low"], row["high"]), ("0", "10"))

        # The last line is the metric, and score has the figures of "after" for it.
        metric = self.output.splitlines()[-1]
        self.assertEqual(metric, f"gloss-contrast:haze={found['haze']['after']}:gloss={found['gloss']['after']}")
        self.assert_success("score", "--judgements", "said.csv", "--metrics", metric, "--out", "scores")
        header, (scored,) = read_csv(self.work / "scores" / "score.csv")
        scored = dict(zip(header, scored))
        header, rows = read_csv(results / "tune.csv")
        tuned = {tuple(row[:2]): dict(zip(header, row)) for row in rows}
        self.assertEqual(set(tuned), {(kind, which) for kind in ("nothing", "references", "materials")
                                      for which in ("before", "after", "gain")})
        for column in "majorities", "votes", "log_likelihood_per_vote":
            for end in "", "_low", "_high":
                found_here, there = tuned["nothing", "after"][column + end], scored[column + end]
                if there == "":  # everything is right, and nothing differs
                    self.assertEqual(found_here, "")
                else:
                    self.assertAlmostEqual(float(found_here), float(there), 12)

        # Judges who do not err are predicted where they were not seen.
        right = sum((distance[frozenset((r, a))] < distance[frozenset((r, b))]) == (for_a > for_b)
                    for r, a, b, for_a, for_b in judgements if for_a != for_b)
        self.assertEqual(right, sum(for_a != for_b for *_, for_a, for_b in judgements))
        for kind in "references", "materials":
            self.assertGreater(float(tuned[kind, "after"]["majorities"]), 0.98)
            self.assertEqual(tuned[kind, "after"]["configurations"], tuned["nothing", "after"]["configurations"])

        summary = read_json(results / "summary.json")
        self.assertEqual(summary["for_metrics"], metric)
        self.assertIs(summary["from_means"], True)
        self.assertEqual(summary["metric_after"]["parameters"]["haze"], float(found["haze"]["after"]))
        self.assertEqual(summary["left_out"]["materials"]["folds"], 56)
        self.assertEqual(summary["options"]["seed"], 1)

        # No material is on both sides.
        header, folds = read_csv(results / "folds.csv")
        self.assertEqual([row[1] for row in folds], ["references"] * 10 + ["materials"] * 56)
        for row in folds[10:]:
            fold = dict(zip(header, row))
            left_out = set(fold["materials"].split(" | "))
            sides = [{r, a, b} for r, a, b, *_ in judgements]
            self.assertEqual(int(fold["tested_on"]), sum(side <= left_out for side in sides))
            self.assertEqual(int(fold["fitted_on"]), sum(not side & left_out for side in sides))

    def test_the_seed_and_nothing_else_decides(self):
        write_database(self.work / "db", 12, GRID)
        self.said(TRUTH, "--database", "db", count=120)
        tables = []
        for options in (), ("--threads", "1"), ("--seed", "1", "--memory", "64M"), ("--seed", "2"):
            results = self.tune("--metric", "gloss-contrast", "--fit", "haze", "--evaluations", "40", "--force",
                                "--database", "db", *options)
            tables.append([(results / name).read_bytes() for name in FILES if name.endswith(".csv")])
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0], tables[2])
        self.assertNotEqual(tables[0], tables[3])

    def test_other_metrics_are_computed_for_each_evaluation(self):
        # So few that no material can be left out: each evaluation compiles the file once more.
        write_database(self.work / "db", 5)
        (self.work / "mine.glsl").write_text(OWN)
        self.said("rmse", "--database", "db", count=60)
        for metric, fit, last in (("mine.glsl", "red", "mine.glsl"), ("ngan", "largest_angle", "ngan")):
            with self.subTest(metric=metric):
                results = self.tune("--metric", metric, "--fit", fit, "--database", "db", "--evaluations", "3",
                                    "--force")
                self.assertRegex(self.output, r"\nestimate +at most [0-9,]+ evaluations of [0-9.e-]+ seconds: |"
                                              r"^estimate +at most")
                self.assertTrue(self.output.splitlines()[-1].startswith(last))
                summary = read_json(results / "summary.json")
                self.assertIs(summary["from_means"], False)
                calls = int(re.search(r"at most ([0-9,]+) ev", self.output)[1].replace(",", ""))
                self.assertLessEqual(summary["evaluations"], calls)

    def test_a_summary_of_ones_own(self):
        write_database(self.work / "db", 5, GRID)
        self.said(TRUTH, "--database", "db", count=30)
        text = self.assert_success("metrics", "show", "gloss-contrast")
        (self.work / "mine.glsl").write_text(text)
        found = {}
        for metric in "gloss-contrast", "./mine.glsl":
            self.tune("--metric", f"{metric}:haze=1", "--fit", "haze", "--database", "db", "--evaluations", "8",
                      "--force")
            name, found[metric] = self.output.splitlines()[-1].split(":", 1)
            self.assertEqual(name, metric)
        self.assertEqual(found["./mine.glsl"], found["gloss-contrast"])

    def test_says_what_speaks_against_it(self):
        write_database(self.work / "db", 12, GRID)
        self.said(TRUTH, "--database", "db", count=30)
        self.tune("--metric", "gloss-contrast", "--evaluations", "20", "--database", "db")
        self.assertIn("doubt: ", self.output)
        self.assertRegex(self.output, r"doubt: \d+ configurations with a majority are too few for 9 fitted")
        doubts = read_json(self.work / "tuned" / "summary.json")["doubts"]
        self.assertEqual(["doubt: " + text for text in doubts],
                         [line for line in self.output.splitlines() if line.startswith("doubt: ")])
        write_rows(self.work / "few.csv", REFERENCE, [["m00", "m01", "m02", 3, 1]])
        self.tune("--metric", "gloss-contrast", "--fit", "haze", "--database", "db", judgements="few.csv", out="few")
        self.assertIn("too few materials to leave some out", self.output)
        summary = read_json(self.work / "few" / "summary.json")
        self.assertIsNone(summary["left_out"]["materials"])
        self.assertEqual(len(read_csv(self.work / "few" / "tune.csv")[1]), 3)

    def refuse(self, status, words, *options, judgements="said.csv"):
        self.assert_refused(status, words, "tune", "--judgements", judgements, "--database", "db", "--out", "new",
                            *options)

    def test_what_is_refused(self):
        write_database(self.work / "db", 4)
        write_rows(self.work / "said.csv", REFERENCE, [["m00", "m01", "m02", 3, 1]])
        (self.work / "mine.glsl").write_text(OWN)
        for metric, fit, words in (
            ("gloss-contrast", "hase", ["no parameter \"hase\"", "haze", "profile"]),
            ("gloss-contrast", "haze,haze", ["--fit", "\"haze\" twice"]),
            ("gloss-contrast", "haze,", ["--fit", "an empty name"]),
            ("rmse", "haze", ["rmse", "no parameters"]),
            ("gloss-contrast:haze=11", "haze", ["haze", "\"11\"", "from 0 to 10"]),
            ("gloss-contrast:haze=1:haze=2", "haze", ["haze", "twice"]),
            ("glos-contrast", "haze", ["no metric \"glos-contrast\""]),
            ("all", "haze", ["no metric \"all\""]),
            ("mine.glsl", "still", ["still", "can only be 2"]),
        ):
            with self.subTest(metric=metric, fit=fit):
                self.refuse(USAGE, words, "--metric", metric, "--fit", fit)
        self.refuse(USAGE, ["--evaluations"], "--metric", "ngan", "--evaluations", "0")
        self.refuse(INPUT, ["window", "6 x 5 x 8"], "--metric", "gloss-contrast")
        self.refuse(INPUT, ["other.csv", "cannot be opened"], "--metric", "ngan", judgements="other.csv")
        write_rows(self.work / "said.csv", REFERENCE, [["gold", "m01", "m02", 3, 1]])
        self.refuse(INPUT, ["said.csv", "\"gold\""], "--metric", "ngan")
        (self.work / "new").mkdir()
        self.refuse(OUTPUT, ["new", "--force"], "--metric", "ngan")

    def test_values_that_go_wrong(self):
        write_database(self.work / "db", 4)
        write_rows(self.work / "said.csv", REFERENCE, [["m00", "m01", "m02", 3, 1]])
        (self.work / "mine.glsl").write_text(OWN.replace("red * f.x", "f.x / (red > 0.9 && red < 1.1 ? red : 0.0)"))
        result = self.run_program("tune", "--judgements", "said.csv", "--database", "db", "--metric", "mine.glsl",
                                  "--fit", "red", "--out", "new")
        self.assertEqual(result.returncode, INPUT)
        self.assertIn("(while fitting, with mine.glsl:red=", self.only_line(result.stderr))
        self.assertFalse((self.work / "new").exists())

    def test_judgements_of_votes(self):
        """Those of a selection by the same metric are circular; other content is refused."""
        write_database(self.work / "db", 6)
        write_database(self.work / "other", {f"m{i:02}": support.samples(i + 50) for i in range(6)})
        scanned = self.scan("--database", "db", "--metrics", "ngan,rmse", "--select", "4", out="scanned")
        _, rows = read_csv(scanned / "selection.csv")
        from tables import COLUMNS  # pylint: disable=import-outside-toplevel
        write_rows(self.work / "ann.csv", COLUMNS,
                   [["ann", i + 1, row[0], "selection", *row[1:5], 0, 1, 900, 7, "kit-1"]
                    for i, row in enumerate(rows)])
        self.assert_success("votes", "ann.csv", "--selection", "scanned/selection.csv", "--out", "votes")
        command = ["tune", "--judgements", "votes/judgements.csv", "--metric", "ngan:largest_angle=60",
                   "--evaluations", "2", "--out"]
        result = self.run_program(*command, "one")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("circular", result.stderr)
        self.assertEqual(self.only_line_with("database", result.stdout).split(), ["database", "db,", "MERL", "directory"])
        result = self.run_program(*command, "two", "--database", "other")
        self.assertIn("other content", result.stderr)

    def only_line_with(self, word, text):
        (line,) = [line for line in text.splitlines() if line.startswith(word)]
        return line


if __name__ == "__main__":
    support.main()
