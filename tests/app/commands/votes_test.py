"""merl-scan votes and power: judges' files, through to tables, report and score."""

import base64
import collections
import itertools
import json
import math
import os
import random
import re
import statistics
import struct
import subprocess
import time
import zlib
from xml.etree import ElementTree

import support
from browser import CHROMIUM, Browser
from reference_selection import write_reference_selection
from support import INPUT, USAGE, Case, read_csv, read_json
from tables import COLUMNS, write_rows, write_table

FILES = ["configurations.csv", "judgements.csv", "judgements_kept.csv", "judges.csv", "summary.json",
         "survey.csv", "votes.html"]

# The votes of the thesis: 85 configurations with 3,3,3,3,3 and so on.
THESIS = ["33333"] * 85 + ["33332"] * 13 + ["33322", "33331"]

HOSTILE = ["=1+1", '</script><script>document.title="hit"</script>', "<img src=x onerror=alert(1)>",
           'a "quoted", name', "ä\u202e", "%DATA%", "../../etc/passwd", "x\x07y",
           "no\uffffcharacter"]


class Votes(Case):
    def setUp(self):
        super().setUp()
        self.random = random.Random(11)

    def select(self, materials, count=100):
        """A selection under two made-up metrics; returns its rows."""
        write_table(self.work / "t.csv", ["one", "two"], materials,
                    lambda _: self.random.lognormvariate(0, 1))
        results = self.scan("--distances", "t.csv", "--select", str(count), out="scan")
        self.selection = results / "selection.csv"
        return read_csv(self.selection)[1]

    def trials(self, rows, side, swap=lambda: False, kind="selection"):
        """Rows of a vote file without the judge: side(i) is the un-randomised vote."""
        made = []
        for i, row in enumerate(rows):
            swapped = swap()
            pairs = [row[1:3], row[3:5]]
            for pair in pairs:
                self.random.shuffle(pair)
            left, right = reversed(pairs) if swapped else pairs
            vote = side(i)
            vote = "" if vote is None else 4 - vote if swapped else vote
            made.append([row[0], kind, *left, *right, int(swapped), vote,
                         round(self.random.uniform(800, 5000), 1)])
        return made

    def write_judge(self, name, trials, file=None, kit="kit-1"):
        path = self.work / (file or f"{name}.csv")
        write_rows(path, COLUMNS, [[name, i + 1, *trial, 7, kit] for i, trial in enumerate(trials)])
        return path.name

    def write_thesis(self):
        rows = self.select([f"m{i:02}" for i in range(45)])
        self.assertEqual(len(rows), 100)
        # Votes that differ fall on another judge each time.
        return [self.write_judge(f"judge {j}", self.trials(rows, lambda k: int(THESIS[k][(j + k) % 5])))
                for j in range(5)]

    def test_the_thesis(self):
        files = self.write_thesis()
        table = self.assert_success("votes", *files, "--selection", self.selection, "--thesis")
        for line in ("33333  3.00               85  0.0041", "33332  2.80               13  0.0247",
                     "33322  2.60                1  0.0864", "33331  2.60                1  0.0864",
                     "option 1 (one)  1", "option 2 (equal)  15", "option 3 (two)  484",
                     "98 of 100 configurations favour two at 0.05"):
            self.assertIn(line, table)
        self.assertFalse((self.work / "merl-scan-votes").exists())
        output = self.assert_success("votes", *files, "--selection", self.selection, "--out", "out")
        self.assertIn("one by one: two 98, one 0", output)
        self.assertIn("with Holm's correction for all 100: two 0, one 0", output)
        self.assertIn("takes 7 judges or more who all say the same, 10 if", output)
        self.assertEqual(sorted(os.listdir(self.work / "out")), FILES)
        header, rows = read_csv(self.work / "out" / "configurations.csv")
        rows = [dict(zip(header, row)) for row in rows]
        self.assertEqual(sum(row["favours"] == "two" for row in rows), 98)
        self.assertEqual({round(float(row["p_two"]), 4) for row in rows}, {0.0041, 0.0247, 0.0864})
        self.assertTrue(all(float(row["p_two_holm"]) > 0.05 for row in rows))
        figures = read_json(self.work / "out" / "summary.json")["figures"]
        self.assertEqual(figures["selection"]["votes"], [1, 15, 484])
        significance = figures["significance"]
        self.assertEqual((significance["alone"], significance["holm"]), ([0, 98], [0, 0]))
        self.assertEqual(significance["fewest_judges_by_equal_votes"], [7, 10, 11])
        self.assertEqual(significance["most_votes"], 5)
        self.assertAlmostEqual(significance["least_p"], 3 ** -5)
        self.assertAlmostEqual(significance["least_p_needed"], 0.05 / 100)
        self.assertIsNone(figures["side_bias"]["p_value"])

    def experiment(self):
        """A whole experiment with a kit: judges who are right with 0.75, equal with 0.1, and press
        the left key in a tenth of the trials."""
        rows = self.select([f"m{i:02}" for i in range(30)], 60)
        names = [f"m{i:02}" for i in range(30)]
        others = [[str(61 + i), *self.random.sample(names, 4)] for i in range(15)]
        sentinels, lots = others[:10], others[10:]
        repeats = self.random.sample(rows, 10)
        trials = []
        for kind, some in (("selection", rows), ("repeat", repeats), ("sentinel", sentinels),
                           ("random", lots)):
            for row in some:
                trials.append({"configuration": int(row[0]), "kind": kind, "left": row[1:3],
                               "right": row[3:5], "agreement": 0.5})
                if kind == "sentinel":
                    trials[-1]["expected"] = 1
        summary = self.assert_success("votes", self.write_judge("probe", self.trials(rows, lambda _: 3)),
                                      "--selection", self.selection, "--out", "probe", "--quiet")
        self.assertEqual(summary, "")
        selection_hash = read_json(self.work / "probe" / "summary.json")["selection"]["content_hash"]
        kit = {"kit_hash": "kit-1", "seed": 7, "selection_hash": selection_hash,
               "metrics": ["one", "two"], "trials": trials}
        (self.work / "kit.json").write_text(json.dumps(kit))
        files = []
        for j in range(12):
            made = []
            for kind, some in (("selection", rows), ("repeat", repeats), ("sentinel", sentinels),
                               ("random", lots)):
                for trial in self.trials(some, lambda _, kind=kind: self.answer(kind),
                                         lambda: self.random.random() < 0.5, kind):
                    if self.random.random() < 0.1:
                        trial[7] = 1
                    made.append(trial)
            self.random.shuffle(made)
            files.append(self.write_judge(f"judge {j}", made))
        return files, rows

    def answer(self, kind):
        if kind == "sentinel":
            return 1
        return self.random.choices([3, 2, 1], [0.75, 0.1, 0.15])[0]

    def test_simulated_judges(self):
        files, rows = self.experiment()
        self.assert_success("votes", *files, "--selection", self.selection, "--kit", "kit.json",
                            "--out", "out")
        figures = read_json(self.work / "out" / "summary.json")["figures"]
        # A tenth of the votes is left whatever was to be said: half of them for either metric.
        for share, truth in zip(figures["selection"]["shares"], (0.185, 0.09, 0.725)):
            self.assertLessEqual(share["low"], truth)
            self.assertGreaterEqual(share["high"], truth)
        self.assertLess(figures["selection"]["p_value"], 0.01)
        self.assertEqual(figures["random"]["missing"], 0)
        self.assertEqual(sum(figures["random"]["votes"]), 12 * 5)
        bias = figures["side_bias"]
        self.assertGreater(bias["left"], bias["right"])
        self.assertLess(bias["p_value"], 0.05)
        # Two independent answers: the same with 0.725^2 + 0.09^2 + 0.185^2 and a little more.
        self.assertEqual(figures["repeats"]["answered"], 120)
        self.assertLess(figures["repeats"]["share"]["low"], 0.57)
        self.assertGreater(figures["repeats"]["share"]["high"], 0.57)
        # Sentinels fail where the left key was pressed and left was wrong.
        self.assertEqual(figures["sentinels"]["answered"], 120)
        self.assertLess(figures["sentinels"]["share"]["low"], 0.95)
        self.assertGreater(figures["sentinels"]["share"]["high"], 0.95)
        self.assertEqual(figures["response_ms"]["count"], 12 * 85)
        # What score makes of the same votes.
        result = self.run_program("score", "--judgements", "out/judgements.csv", "--distances",
                                  "t.csv", "--out", "score")
        self.assertEqual(result.returncode, 0, result.stderr)
        score = read_json(self.work / "score" / "summary.json")
        self.assert_circular(result, score)
        votes = [a + b for a, b in zip(figures["selection"]["votes"], figures["random"]["votes"])]
        self.assertEqual(score["judgements"]["votes"], sum(votes))
        self.assertEqual(score["judgements"]["equal_votes"], votes[1])
        # The same votes give the same results, bit for bit, and another seed other intervals.
        self.assert_success("votes", *files, "--selection", self.selection, "--kit", "kit.json",
                            "--out", "again")
        for name in FILES:
            self.assertEqual((self.work / "out" / name).read_bytes(),
                             (self.work / "again" / name).read_bytes())
        self.assert_success("votes", *files, "--selection", self.selection, "--kit", "kit.json",
                            "--out", "again", "--force", "--seed", "2")
        other = read_json(self.work / "again" / "summary.json")["figures"]
        self.assertEqual(other["selection"]["lead"], figures["selection"]["lead"])
        self.assertNotEqual(other["krippendorff_alpha"], figures["krippendorff_alpha"])

    def careless(self, file):
        """Makes the votes of a file those of a judge who pressed one key after a tenth of a second."""
        header, rows = read_csv(self.work / file)
        for row in rows:
            row[9], row[10] = "1", "100"
        write_rows(self.work / file, header, rows)

    def plain_figures(self, files):
        """By judge: failed and answered sentinels, repeats alike and answered, median seconds, answers
        by key; and the un-randomised votes by configuration."""
        kit = read_json(self.work / "kit.json")
        expected = {t["configuration"]: t["expected"] for t in kit["trials"] if "expected" in t}
        judges, votes = [], []
        for file in files:
            sides, repeats, failed, times, keys = {}, {}, 0, [], [0, 0, 0]
            for row in (dict(zip(COLUMNS, row)) for row in read_csv(self.work / file)[1]):
                if not row["vote"]:
                    continue
                key, number = int(row["vote"]), int(row["configuration"])
                side = 4 - key if row["swapped"] == "1" else key
                keys[key - 1] += 1
                times.append(float(row["response_ms"]) / 1000)
                if row["kind"] == "sentinel":
                    failed += side != expected[number]
                (repeats if row["kind"] == "repeat" else sides)[number] = side
            alike = sum(sides[number] == side for number, side in repeats.items())
            judges.append({"failed": failed, "sentinels": len(expected), "alike": alike,
                           "repeats": len(repeats), "seconds": statistics.median(times), "keys": keys})
            votes.append(sides)
        return judges, votes

    def test_careless_judges_are_named_and_left_out(self):
        files, rows = self.experiment()
        self.careless(files[4])
        judges, votes = self.plain_figures(files)
        arguments = ("votes", *files, "--selection", self.selection, "--kit", "kit.json")
        rules = {"sentinels_failed": 3, "repeats_below": 0.3, "median_time_below": 0.5,
                 "same_key_above": 0.9}
        def falls(judge):
            tests = {"sentinels_failed": judge["failed"] >= 3,
                     "repeats_below": judge["alike"] / judge["repeats"] < 0.3,
                     "median_time_below": judge["seconds"] < 0.5,
                     "same_key_above": max(judge["keys"]) / sum(judge["keys"]) > 0.9}
            return [rule for rule, holds in tests.items() if holds]
        expected = [falls(judge) for judge in judges]
        self.assertGreaterEqual(len(expected[4]), 2)
        kept = [file for file, reasons in zip(files, expected) if not reasons]
        self.assertLess(len(kept), len(files))
        # Nothing is left out unasked, but it is said what looks wrong, and how it would come by lot.
        output = self.assert_success(*arguments, "--out", "plain")
        plain = read_json(self.work / "plain" / "summary.json")
        self.assertIsNone(plain["exclusion"])
        self.assertEqual((self.work / "plain" / "judgements_kept.csv").read_bytes(),
                         (self.work / "plain" / "judgements.csv").read_bytes())
        careless = judges[4]
        passed = careless["sentinels"] - careless["failed"]
        right = sum(math.comb(10, k) for k in range(passed, 11)) / 2 ** 10
        for words in (f"failed {careless['failed']} of 10 sentinels: answers by lot fail as few with "
                      f"p {right:.2g}",
                      "answered left 75 of 75 times: by lot p 5.3e-23",
                      "has a median response of 0.1 s, in which both materials of a side cannot"):
            self.assertRegex(output, rf"(?m)^(looks wrong|) +judge 4 {re.escape(words)}")
        # Every figure without them is that of a run without their files.
        options = [f"--exclude={rule}={value}" for rule, value in rules.items()]
        output = self.assert_success(*arguments, *options, "--out", "out")
        self.assert_success("votes", *kept, "--selection", self.selection, "--kit", "kit.json",
                            "--out", "kept")
        summary = read_json(self.work / "out" / "summary.json")
        self.assertEqual(summary["figures"], plain["figures"])
        alone = read_json(self.work / "kept" / "summary.json")["figures"]
        self.assertEqual(summary["exclusion"]["figures"], alone)
        self.assertEqual(summary["exclusion"]["rules"],
                         [{"rule": rule, "value": value, "from": "--exclude"} for rule, value in rules.items()])
        self.assertEqual([[j["judge"], [r["rule"] for r in j["rules"]]] for j in summary["exclusion"]["judges"]],
                         [[f"judge {i}", reasons] for i, reasons in enumerate(expected) if reasons])
        self.assertEqual((self.work / "out" / "judgements_kept.csv").read_bytes(),
                         (self.work / "kept" / "judgements.csv").read_bytes())
        self.assertIn(f"excluded        {len(files) - len(kept)} of 12 judges, by sentinels_failed=3, ", output)
        self.assertRegex(output, r"(?m)^ +judge 4: 85 of 85 answers with one key, left \(same_key_above\)$")
        self.assertEqual(output.count("Krippendorff's alpha"), 2)
        header, table = read_csv(self.work / "out" / "judges.csv")
        self.assertEqual([dict(zip(header, row))["excluded_by"].split() for row in table], expected)
        header, table = read_csv(self.work / "out" / "configurations.csv")
        for row in (dict(zip(header, row)) for row in table):
            mine = [sides[int(row["configuration"])] for sides, reasons in zip(votes, expected) if not reasons]
            self.assertEqual([int(row[f"kept_votes_{side}"]) for side in ("one", "equal", "two")],
                             [mine.count(side) for side in (1, 2, 3)])
            ways = [1]  # by lot, to each sum
            for _ in mine:
                ways = [sum(ways[max(0, s - 2):s + 1]) for s in range(len(ways) + 2)]
            chance = sum(ways[sum(mine) - len(mine):]) / 3 ** len(mine)
            self.assertAlmostEqual(float(row["kept_p_two"]), chance, delta=1e-12)
        table = self.assert_success(*arguments, *options, "--thesis")
        self.assertIn(f"without {len(files) - len(kept)} of 12 judges, by sentinels_failed=3", table)
        self.assertEqual(table.count("of 60 configurations favour two"), 2)
        # The votes that were kept are of the same selection.
        result = self.run_program("score", "--judgements", "out/judgements_kept.csv", "--distances",
                                  "t.csv", "--out", "score")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(read_json(self.work / "score" / "summary.json")["judgements"]["selected_by"],
                         ["one", "two"])
        self.assert_exclusion_page(self.work / "out" / "votes.html", summary)
        self.assert_rules_of_kit(arguments, kept, alone)

    def assert_exclusion_page(self, page, summary):
        """votes.html shows the figures of everybody, and those of the others at a click."""
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        lost = len(summary["exclusion"]["judges"])
        with Browser() as browser:
            for width in 1200, 390:
                browser.open(page, width=width)
                self.assertEqual(browser.complaints(), [])
                self.assertLessEqual(browser.run("document.documentElement.scrollWidth"), width)
                self.assertRegex(browser.text("#rules"), rf" {lost} judges? of 12 falls? under one\.$")
                self.assertIn("answered left 75 of 75 times", browser.text("#doubts"))
                for value, figures in (("all", summary["figures"]), ("kept", summary["exclusion"]["figures"])):
                    button = f"#counted input[value={value}]"
                    browser.run(f"document.querySelector('{button}').scrollIntoView({{block: 'center'}})")
                    browser.click(button)
                    shares = browser.run("[...document.querySelectorAll('#shares td:last-child')]"
                                         ".map(cell => Number(cell.textContent))")
                    self.assertEqual(shares, figures["selection"]["votes"])
                    self.assertEqual(browser.run("document.querySelectorAll('#judges tbody tr').length"),
                                     len(figures["judges"]))
                    titles = browser.run("[...document.querySelectorAll('figure svg > title')].map(t => t.textContent)")
                    self.assertEqual([f"({12 - lost} of 12 judges)" in title for title in titles],
                                     [value == "kept"] * 4)
                self.assertEqual(browser.complaints(), [])

    def assert_rules_of_kit(self, arguments, kept, alone):
        """What the study stated beforehand counts without being asked for."""
        path = self.work / "kit.json"
        kit = read_json(path)
        kit["exclusion"] = {"sentinels_failed": 3, "repeats_below": 0.3, "median_time_below": 0.5,
                            "same_key_above": 0.5, "calibration_failed": False}
        path.write_text(json.dumps(kit))
        output = self.assert_success(*arguments, "--exclude", "same_key_above=0.9", "--out", "stated")
        self.assertIn("sentinels_failed=3 (kit.json), ", output)
        self.assertIn("same_key_above=0.9\n", output)
        exclusion = read_json(self.work / "stated" / "summary.json")["exclusion"]
        self.assertEqual(exclusion["figures"], alone)
        self.assertEqual([rule["from"] for rule in exclusion["rules"]], ["kit.json"] * 3 + ["--exclude"])
        # A rule without data: of the kit it is a warning, of the command line an error.
        kit["exclusion"] = {"calibration_failed": True}
        path.write_text(json.dumps(kit))
        result = self.run_program(*arguments, "--out", "uncalibrated", "--quiet")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("cannot be applied: the rule calibration_failed=true of kit.json: no file has a "
                      "calibration", self.only_line(result.stderr))
        self.assert_refused(INPUT, ["--exclude calibration_failed=true", "no file has a calibration"],
                            *arguments, "--exclude", "calibration_failed=true")
        for exclusion, words in (({"sentinels": 2}, ["kit.json, exclusion", "sentinels_failed, repeats_below"]),
                                 ({"repeats_below": 2}, ["kit.json, exclusion, repeats_below", "found 2"]),
                                 ({"repeats_below": True}, ["repeats_below", "found true"]),
                                 ({"calibration_failed": 1}, ["calibration_failed", "true or false"]),
                                 ([], ["kit.json, exclusion", "expected an object"])):
            kit["exclusion"] = exclusion
            path.write_text(json.dumps(kit))
            self.assert_refused(INPUT, words, *arguments)
        del kit["exclusion"]
        path.write_text(json.dumps(kit))
        # Where nobody is left all files are there, and the error says so.
        result = self.run_program(*arguments, "--exclude", "median_time_below=3600", "--out", "nobody")
        self.assertEqual(result.returncode, INPUT)
        self.assertIn("every judge falls under a rule of exclusion (median_time_below=3600)",
                      self.only_line(result.stderr))
        self.assertIn("the results are complete and in place", result.stderr)
        self.assertEqual(sorted(os.listdir(self.work / "nobody")), FILES)
        nobody = read_json(self.work / "nobody" / "summary.json")
        self.assertEqual(nobody["exclusion"]["figures"]["selection"]["votes"], [0, 0, 0])
        with Browser() as browser:
            browser.open(self.work / "nobody" / "votes.html")
            self.assertEqual(browser.complaints(), [])
            self.assertIn("nobody is left", browser.text("#rules"))

    def test_bad_rules_of_exclusion(self):
        rows = self.select([f"m{i}" for i in range(8)], 10)
        good = self.write_judge("good", self.trials(rows, lambda _: 3))
        arguments = ("votes", good, "--selection", self.selection, "--exclude")
        for rule, words in (("sentinels=2", ['"sentinels=2"', "sentinels_failed, repeats_below"]),
                            ("sentinels_failed", ["RULE=VALUE"]),
                            ("sentinels_failed=0", ["whole number from 1"]),
                            ("sentinels_failed=1.5", ["whole number from 1"]),
                            ("repeats_below=1.1", ["fraction above 0"]),
                            ("median_time_below=-1", ["seconds above 0"]),
                            ("median_time_below=nan", ["seconds above 0"]),
                            ("same_key_above=1", ["below 1"]),
                            ("calibration_failed=yes", ["true or false"])):
            self.assert_refused(USAGE, ["--exclude", *words], *arguments, rule)
        self.assert_refused(USAGE, ["--exclude", "repeats_below twice"], *arguments, "repeats_below=0.5",
                            "--exclude", "repeats_below=0.6")
        for rule, words in (("sentinels_failed=2", ["there are no sentinels"]),
                            ("repeats_below=0.5", ["there are no repeats"]),
                            ("same_key_above=0.9", ["sides were never exchanged"])):
            self.assert_refused(INPUT, [f"--exclude {rule}", *words], *arguments, rule)
        untimed = self.trials(rows, lambda _: 3)
        for trial in untimed:
            trial[8] = ""
        self.assert_refused(INPUT, ["median_time_below=1", "no file has response times"], "votes",
                            self.write_judge("untimed", untimed), "--selection", self.selection,
                            "--exclude", "median_time_below=1")
        # One of them has times: of the other the rule says nothing.
        output = self.assert_success("votes", good, "untimed.csv", "--selection", self.selection,
                                     "--exclude", "median_time_below=0.1", "--out", "out")
        self.assertIn("median_time_below=0.1 says nothing of untimed, who has no response times", output)
        others = [["11", *rows[0][1:5]]]
        sentinel = self.write_judge("sentinel", [*self.trials(rows, lambda _: 3),
                                                 *self.trials(others, lambda _: 3, kind="sentinel")])
        self.assert_refused(INPUT, ["sentinels_failed=1", "--kit"], "votes", sentinel, "--selection",
                            self.selection, "--exclude", "sentinels_failed=1")

    def assert_circular(self, result, score):
        """Votes on a selection say of the two metrics that chose it only which is right."""
        [warning] = score["warnings"]
        self.assertEqual(result.stderr.splitlines(), [f"merl-scan: warning: {warning}"])
        self.assertIn("disagreements of one and two, as out/summary.json says", warning)
        self.assertIn("circular", warning)
        self.assertEqual(score["judgements"]["selected_by"], ["one", "two"])
        self.assertEqual([m["selected"] for m in score["metrics"]], [True, True])
        # What one gains the other loses (but on the few random ones here, which are made up).
        self.assertAlmostEqual(sum(m["votes"]["value"] for m in score["metrics"]), 1, delta=0.02)
        self.assertRegex(result.stdout, r"(?m)^two \* +0\.")
        self.assertRegex(result.stdout, r"(?m)^\* circular")
        header, rows = read_csv(self.work / "score" / "score.csv")
        self.assertEqual([dict(zip(header, row))["selected"] for row in rows], ["1", "1"])
        plot = (self.work / "score" / "score.svg").read_text()
        self.assertIn(">two *<", plot)
        self.assertIn("* Circular", plot)
        # Other metrics have not chosen it.
        write_table(self.work / "other.csv", ["three"], [f"m{i:02}" for i in range(30)],
                    lambda _: self.random.lognormvariate(0, 1))
        output = self.assert_success("score", "--judgements", "out/judgements.csv", "--distances",
                                     "other.csv", "--out", "other")
        self.assertNotIn("circular", output)
        other = read_json(self.work / "other" / "summary.json")
        self.assertEqual(other["judgements"]["selected_by"], ["one", "two"])
        self.assertEqual((other["metrics"][0]["selected"], other["warnings"]), (False, []))

    def test_what_nobody_voted_on_is_not_judged(self):
        rows = self.select([f"m{i:02}" for i in range(45)])
        files = [self.write_judge(f"judge {j}", self.trials(rows[:7], lambda _: 3)) for j in range(9)]
        output = self.assert_success("votes", *files, "--selection", self.selection, "--out", "out")
        self.assertIn("of 7 configurations judged at 0.05, one by one: two 7, one 0", output)
        self.assertIn("with Holm's correction for all 100: two 7, one 0", output)
        significance = read_json(self.work / "out" / "summary.json")["figures"]["significance"]
        self.assertEqual((significance["configurations"], significance["judged"]), (100, 7))
        output = self.assert_success("votes", *files, "--selection", self.selection, "--thesis")
        self.assertIn("7 of 7 configurations favour two", output)
        if CHROMIUM is not None:
            with Browser() as browser:
                browser.open(self.work / "out" / "votes.html")
                self.assertEqual(browser.complaints(), [])
                self.assertIn("100 configurations of the selection, 7 of them judged;",
                              browser.text("#lead"))
                self.assertIn("7 of 7 judged configurations favour two", browser.text("#tests"))
        write_table(self.work / "other.csv", ["three"], [f"m{i:02}" for i in range(45)],
                    lambda _: self.random.lognormvariate(0, 1))
        output = self.assert_success("score", "--judgements", "out/judgements.csv", "--distances",
                                     "other.csv", "--out", "score")
        self.assertIn("7 configurations, 7 with a majority; 63 votes", output)
        self.assertIn("93 configurations without a vote left out", output)
        judgements = read_json(self.work / "score" / "summary.json")["judgements"]
        self.assertEqual((judgements["configurations"], judgements["without_votes"]), (7, 93))

    def assert_too_few(self, files, reason, judges_p, out):
        """No interval and no overall p anywhere, but the reason."""
        output = self.assert_success("votes", *files, "--selection", self.selection, "--out", out)
        self.assertIn("overall p [too few] (judges and materials as clusters)", output)
        self.assertIn(f"sign test p {judges_p}\n", output)
        self.assertIn(f"too few for intervals: {reason}\n", output)
        self.assertNotRegex(output, r"(right|equal) .*\[\d")
        selection = read_json(self.work / out / "summary.json")["figures"]["selection"]
        self.assertIsNone(selection["p_value"])
        self.assertNotIn("too_few", selection)  # it is said once, of each figure
        for estimate in *selection["shares"], selection["lead"]:
            self.assertEqual((estimate["low"], estimate["high"]), (None, None))
            self.assertEqual(estimate["too_few"], reason)
        return output

    def test_too_few_for_certainty(self):
        rows = self.select([f"m{i:02}" for i in range(45)])
        def judges(count, votes, side):
            return [self.write_judge(f"{count}-{j}", self.trials(rows[:votes], side))
                    for j in range(count)]
        three = judges(3, 1, lambda _: 3)
        output = self.assert_too_few(three, "configurations: 1; expected 5 or more", 0.25, "three")
        self.assertIn("1.000 [too few]", output)
        # Holm's correction is for all 100, not for the one that was voted on.
        self.assertIn("with Holm's correction for all 100: two 0, one 0", output)
        significance = read_json(self.work / "three" / "summary.json")["figures"]["significance"]
        self.assertEqual((significance["configurations"], significance["holm"]), (100, [0, 0]))
        header, table = read_csv(self.work / "three" / "configurations.csv")
        self.assertEqual(dict(zip(header, table[0]))["p_two_holm"], "1")
        if CHROMIUM is not None:
            with Browser() as browser:
                browser.open(self.work / "three" / "votes.html")
                self.assertEqual(browser.complaints(), [])
                self.assertIn("100.0 % [too few]", browser.text("#shares"))
                self.assertIn("too few votes for intervals and an overall p (configurations: 1; "
                              "expected 5 or more)", browser.text("#overall"))
        few = "judges: {}; expected 3 or more"
        self.assert_too_few(judges(1, 100, lambda k: 1 + k % 3), few.format(1), 1, "one")
        self.assert_too_few(judges(2, 100, lambda k: 3), few.format(2), 0.5, "two")
        alike = "no judge or material makes a difference"
        self.assert_too_few(judges(6, 100, lambda _: 3), alike, 0.031, "alike")
        self.assert_too_few(judges(7, 100, lambda _: 2), alike, 1, "equal")
        self.assert_too_few(judges(8, 1, lambda _: 3), "configurations: 1; expected 5 or more",
                            0.0078, "configuration")
        self.assert_too_few(judges(9, 100, lambda _: None), few.format(0), 1, "nobody")

    def test_missing_trials_count(self):
        rows = self.select([f"m{i}" for i in range(9)], 20)
        count = len(rows)
        half = self.write_judge("half", self.trials(rows[:5], lambda k: 3 if k else None))
        whole = self.write_judge("whole", self.trials(rows, lambda _: 3))
        output = self.assert_success("votes", half, whole, "--selection", self.selection, "--out",
                                     "out")
        self.assertIn(f"half: {count - 4} of {count} trials", output)
        header, judges = read_csv(self.work / "out" / "judges.csv")
        self.assertEqual([dict(zip(header, row))["missing"] for row in judges], [str(count - 4), "0"])
        header, table = read_csv(self.work / "out" / "configurations.csv")
        self.assertEqual([dict(zip(header, row))["missing"] for row in table],
                         ["1" if k == 0 or k >= 5 else "0" for k in range(count)])

    def test_bad_votes(self):
        rows = self.select([f"m{i}" for i in range(8)], 10)
        good = self.write_judge("good", self.trials(rows, lambda _: 3))

        def refused(words, *files, selection=None, status=INPUT, options=()):
            self.assert_refused(status, words, "votes", *files, "--selection",
                                selection or self.selection, *options)

        # A column without a name that is not empty, in every table that is read.
        (self.work / "answers.csv").write_text("judge,question,answer\nanna,comments,none\n")
        for name, columns, files, options in (
            ("good.csv", 13, ["comma.csv"], {}),
            (self.selection, 10, [good], {"selection": "comma.csv"}),
            ("answers.csv", 3, [good], {"options": ["--survey", "comma.csv"]}),
        ):
            text = (self.work / name).read_text()
            (self.work / "comma.csv").write_text(text.replace("\n", ",\n", 1).rstrip("\n") + ",x\n")
            refused(["comma.csv", f'"x" in column {columns + 1}, which is without a name'], *files, **options)
        refused(["other.csv", "kit-2", "kit-1"], good,
                self.write_judge("other", self.trials(rows, lambda _: 3), kit="kit-2"))
        bad = self.trials(rows, lambda _: 3)
        bad[3][7] = 4
        refused(["bad.csv, line 5", "vote: found \"4\""], self.write_judge("bad", bad))
        bad[3][7] = 3
        bad[3][2] = "gold"
        refused(["bad.csv, line 5", "gold", "configuration 4"], self.write_judge("bad", bad))
        header, table = read_csv(self.selection)
        write_rows(self.work / "empty.csv", header, [])
        refused(["empty.csv", "no row"], good, selection="empty.csv")
        refused(["nothing.csv", "cannot be opened"], good, selection="nothing.csv")
        refused(["nothing.csv", "cannot be opened"], "nothing.csv")
        (self.work / "kit.json").write_text('{"kit_hash": "kit-1"}')
        refused(["kit.json", "metrics"], good, options=["--kit", "kit.json"])
        (self.work / "survey.csv").write_text("who,what\n")
        refused(["survey.csv", "who,what", "judge,question,answer"], good,
                options=["--survey", "survey.csv"])
        (self.work / "answers.csv").write_text("judge,question,answer\nanna,comments,none\n")
        refused(["answers.csv", "a survey belongs to --survey"], good, "answers.csv")
        refused(["--spheres nowhere", "no directory"], good, options=["--spheres", "nowhere"])
        (self.work / "empty").mkdir()
        refused(["--spheres empty", "found none of the images"], good,
                options=["--spheres", "empty"])
        (self.work / "spheres").mkdir()
        (self.work / "spheres" / "m0.png").write_text("no image")
        refused(["m0.png", "no PNG"], good, options=["--spheres", "spheres"])
        refused(["--out excludes --thesis"], good, status=USAGE, options=["--thesis", "--out", "x"])
        self.assert_refused(USAGE, ["files"], "votes", "--selection", self.selection)

    def test_saves_of_a_judge_count_once(self):
        """A second save, an earlier one, another spelling of the name: the figures do not change."""
        rows = self.select([f"m{i}" for i in range(9)], 20)
        trials = self.trials(rows, lambda _: self.answer("selection"), lambda: self.random.random() < 0.5)
        whole = self.write_judge("Åsa", trials)
        earlier = self.write_judge("åsa", [[*t[:7], *(["", ""] if i > 8 else t[7:])]
                                           for i, t in enumerate(trials)], file="earlier.csv")
        other = self.write_judge("bo", self.trials(rows, lambda _: 3))
        write_rows(self.work / "answers.csv", ["judge", "question", "answer"],
                   [["Åsa", "comments", "good"], ["Åsa", "keys_easy", ""]])
        write_rows(self.work / "answers2.csv", ["judge", "question", "answer"],
                   [["åsa", "comments", "good"], ["Åsa", "keys_easy", "5"]])

        def figures(*files, warnings=(), out):
            survey = ["--survey", "answers.csv", "--survey", "answers2.csv"]
            result = self.run_program("votes", *files, "--selection", self.selection, "--out", out,
                                      *survey, "--quiet")
            self.assertEqual(result.returncode, 0, result.stderr)
            lines = result.stderr.splitlines()
            self.assertEqual(len(lines), len(warnings) + 1, lines)
            for line, words in zip(lines, warnings):
                self.assertTrue(line.startswith("merl-scan: warning: "), line)
                self.assertIn(words, line)
            self.assertIn("--survey: 2 answers", lines[-1])
            self.assertEqual(read_csv(self.work / out / "survey.csv")[1],
                             [["Åsa", "comments", "good"], ["Åsa", "keys_easy", "5"]])
            summary = read_json(self.work / out / "summary.json")
            self.assertEqual([f"merl-scan: warning: {text}" for text in summary["warnings"]], lines)
            return summary["figures"]

        plain = figures(whole, other, out="plain")
        (self.work / "again.csv").write_bytes((self.work / whole).read_bytes())
        self.assertEqual(figures(whole, "again.csv", other, warnings=["has the same votes of"],
                                 out="again"), plain)
        self.assertEqual(figures(earlier, other, whole, warnings=["earlier.csv: is an earlier save"],
                                 out="fuller"), plain)
        # What contradicts is for the researcher to decide.
        trials[4][7] = 2 if trials[4][7] != 2 else 3
        changed = self.write_judge("Åsa", trials, file="changed.csv")
        self.assert_refused(INPUT, ["changed.csv, line 6", "Åsa.csv, line 6", "give only the last save"],
                            "votes", whole, changed, "--selection", self.selection)

    def test_report(self):
        """votes.html in a browser, with texts that would be markup or a formula."""
        self.warns = True  # of images that do not say what they show
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        rows = self.select(HOSTILE, 20)
        files = [self.write_judge(name, self.trials(rows, lambda _: self.answer("selection"),
                                                    lambda: self.random.random() < 0.5),
                                  file=f"judge-{i}.csv") for i, name in enumerate(HOSTILE)]
        write_rows(self.work / "answers.csv", ["judge", "question", "answer"],
                   [[name, "comment", f"{other}\n=SUM(A1)"]
                    for name, other in itertools.pairwise(HOSTILE)])
        # Of two materials there are images; no name leads out of the directory.
        (self.work / "spheres").mkdir()
        pixel = (lambda kind, data: struct.pack(">I", len(data)) + kind + data +
                 struct.pack(">I", zlib.crc32(kind + data)))
        image = (b"\x89PNG\r\n\x1a\n" + pixel(b"IHDR", struct.pack(">2I5B", 1, 1, 8, 0, 0, 0, 0)) +
                 pixel(b"IDAT", zlib.compress(b"\0\x80")) + pixel(b"IEND", b""))
        for name in HOSTILE[0], HOSTILE[3]:
            (self.work / "spheres" / f"{name}.png").write_bytes(image)
        self.assert_success("votes", *files, "--selection", self.selection, "--survey",
                            "answers.csv", "--spheres", "spheres", "--out", "out")
        for name in "judges.csv", "survey.csv":
            self.assertNotIn("\n=", (self.work / "out" / name).read_text().replace("\n=SUM", ""))
        self.assertEqual(read_csv(self.work / "out" / "judges.csv")[1][0][0], "'=1+1")
        page = self.work / "out" / "votes.html"
        with Browser() as browser:
            for width in 1200, 360:
                browser.open(page, width=width)
                self.assertEqual(browser.complaints(), [])
                self.assertEqual([address for address in browser.requests()
                                  if not address.startswith("data:")], [page.resolve().as_uri()])
                self.assertEqual(browser.run("document.title"), "What the judges say")
                self.assertEqual(browser.run("document.querySelectorAll('#rows li').length"), len(rows))
                self.assertEqual(browser.run("document.querySelectorAll('[data-plot=p-values] circle').length"),
                                 len(rows) + 2)  # and those that say what the colours are
                self.assertLessEqual(browser.run("document.documentElement.scrollWidth"), width)
                images = browser.run("[...document.querySelectorAll('#rows img')].map(i => [i.alt, i.src])")
                self.assertEqual({name for name, _ in images}, {HOSTILE[0], HOSTILE[3]})
                for _, source in images:
                    self.assertEqual(base64.b64decode(source.split(",")[1]), image)
            judges = browser.run("[...document.querySelectorAll('#judges td.name')].map(c => c.textContent)")
            self.assertEqual(judges, [support.visible(name) for name in HOSTILE])
            answers = browser.text("#survey")
            for text in HOSTILE[1:]:
                self.assertIn(support.visible(text), answers)
            browser.run("(s => { s.value = 'share'; s.dispatchEvent(new Event('change')); })"
                        "(document.getElementById('order'))")
            shares = browser.run("[...document.querySelectorAll('#rows .bar')].map(b => b.title)")
            counts = [[int(part.split()[-1]) for part in text.split(", ")] for text in shares]
            leads = [two - one for one, _, two, _ in counts]
            self.assertEqual(leads, sorted(leads, reverse=True))

    def save_pictures(self, browser, selector):
        """Clicks every button that saves a picture; returns the files by name, each with its bytes."""
        buttons = browser.run(f"document.querySelectorAll('{selector} button').length")
        files = {}
        for number in range(buttons):
            button = f"[data-test='{number}']"
            browser.run(f"(b => {{ b.dataset.test = '{number}'; b.scrollIntoView({{block: 'center'}}); }})"
                        f"(document.querySelectorAll('{selector} button')[{number}])")
            browser.click(button)
            end = time.monotonic() + 60
            while not (new := [path for path in self.work.glob("saved/*.[sp]*g") if path.name not in files]):
                self.assertLess(time.monotonic(), end)
                time.sleep(0.02)
            files[new[0].name] = new[0].read_bytes()
        return files

    def texts_of(self, svg):
        """Everything that can be read in a picture, which needs nothing from elsewhere."""
        root = ElementTree.fromstring(svg)
        self.assertEqual({element.tag.split("}")[1] for element in root.iter()} -
                         {"svg", "title", "rect", "line", "text", "circle", "path"}, set())
        self.assertNotIn(b"href", svg)
        return root, [element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text")]

    def test_pictures_of_the_thesis(self):
        """Figures 5.2 and 6.1 to 6.4, in the page and as the files that it saves."""
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        files = self.write_thesis()
        answers = {"instructions_clear": ["yes", "yes", "no", "no", "no"],
                   "preferred_question": ["larger", "larger", "smaller", "smaller", "either"],
                   "frequency": ["about right"] * 4 + ["too fast"], "sphere_size": ["about right"] * 5,
                   "keys_easy": ["5", "5", "5", "4", "4"], "vision_impairment": ["no"] * 5,
                   "comments": ["", "", "", "more & <b>better</b>", "more"], "hand": ["left", "right", "right", "left", ""],
                   "likely": ["10", "0", "10", "7", "7"]}
        write_rows(self.work / "answers.csv", ["judge", "question", "answer"],
                   [[f"judge {j}", question, given[j]] for question, given in answers.items() for j in range(5)])
        self.assert_success("votes", *files, "--selection", self.selection, "--survey", "answers.csv",
                            "--out", "out")
        names = ["judgement-summary", "shares", "p-values", "agreement"]
        names += [f"survey-{question.replace('_', '-')}" for question in answers if question != "comments"]
        (self.work / "saved").mkdir()
        with Browser() as browser:
            browser.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(self.work / "saved"))
            browser.open(self.work / "out" / "votes.html", width=390)
            self.assertEqual(browser.complaints(), [])
            widths = browser.run("[...document.querySelectorAll('figure svg')].map(svg => svg.getBoundingClientRect().width)")
            self.assertEqual((len(widths), max(widths)), (len(names), 320))
            self.assertLessEqual(browser.run("document.documentElement.scrollWidth"), 390)
            browser.open(self.work / "out" / "votes.html")
            saved = self.save_pictures(browser, "figure")
            self.assertEqual(browser.complaints(), [])
            self.assertEqual([address for address in browser.requests() if not address.startswith(("data:", "blob:"))],
                             [(self.work / "out" / "votes.html").resolve().as_uri()])
        self.assertEqual(sorted(saved), sorted(f"{name}.{kind}" for name in names for kind in ("svg", "png")))
        pictures = {name: self.texts_of(saved[f"{name}.svg"]) for name in names}
        for name, (_, texts) in pictures.items():
            self.assertNotIn("judge ", " ".join(texts), name)
        of = lambda name, tag: list(pictures[name][0].iter(f"{{http://www.w3.org/2000/svg}}{tag}"))
        # The areas are as the votes.
        radii = [float(disc.get("r")) for disc in of("judgement-summary", "circle")]
        for radius, votes in zip(radii, (1, 15, 484)):
            self.assertAlmostEqual((radius / radii[2]) ** 2, votes / 484, delta=0.001)
        for words in ("1 (0.2 %)", "15 (3.0 %)", "484 (96.8 %)"):
            self.assertIn(words, pictures["judgement-summary"][1])
        # The lengths of the bars are as the shares: the boxes but for the ground.
        bars = [float(box.get("width")) for box in of("shares", "rect")[1:]]
        for bar, votes in zip(bars, (1, 15, 484)):
            self.assertAlmostEqual(bar / bars[2], votes / 484, delta=0.001)
        # A point for each configuration, where its p-value is.
        lines = {text: y for text, y in zip(pictures["p-values"][1],
                 [float(e.get("y") or "nan") for e in of("p-values", "text")])}
        discs = of("p-values", "circle")[2:]
        heights = collections.Counter(float(disc.get("cy")) for disc in discs)
        self.assertEqual(sorted(heights.values()), [2, 13, 85])
        decade = (lines["0.01"] - lines["1"]) / -2
        self.assertAlmostEqual((max(heights) - min(heights)) / abs(decade),
                               math.log10(0.0864) - math.log10(0.004115), delta=0.01)
        # Four of five: the sector ends at four fifths of the turn.
        sectors = of("survey-frequency", "path")
        self.assertEqual(len(sectors), 2)
        x, y, left, top, end, bottom = (float(n) for n in re.match(
            r"M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)A[\d.]+ [\d.]+ 0 1 1 ([\d.]+) ([\d.]+)Z", sectors[0].get("d")).groups())
        self.assertAlmostEqual(math.atan2(end - x, y - bottom) % math.tau, 0.8 * math.tau, delta=0.01)
        self.assertAlmostEqual(math.atan2(left - x, y - top), 0, delta=0.01)
        self.assertIn("about right: 4", pictures["survey-frequency"][1])
        self.assertIn("too slow: 0", pictures["survey-frequency"][1])
        # Everybody: a whole disc. And columns as high as the counts.
        self.assertEqual(len(of("survey-sphere-size", "circle")), 1)
        self.assertEqual([float(box.get("height")) for box in of("survey-keys-easy", "rect")[1:4]], [0, 0, 0])
        four, five = [float(box.get("height")) for box in of("survey-keys-easy", "rect")[4:]]
        self.assertAlmostEqual(four / five, 2 / 3, delta=0.01)
        # A scale from 0 to 10, in its order.
        self.assertEqual([float(box.get("height")) > 0 for box in of("survey-likely", "rect")[1:]],
                         [step in (0, 7, 10) for step in range(11)])
        self.assertIn("no answer: 1", pictures["survey-hand"][1])
        for name in names:
            root, image = pictures[name][0], saved[f"{name}.png"]
            size = struct.unpack(">II", image[16:24])
            self.assertEqual(size, (3 * int(root.get("width")), 3 * int(root.get("height"))))
            self.assertGreater(len(image), 2000)  # more than a ground
            other = subprocess.run(["rsvg-convert", "-z", "3"], input=saved[f"{name}.svg"],
                                   capture_output=True, check=True).stdout
            self.assertEqual(struct.unpack(">II", other[16:24]), size)

    def reference_experiment(self, judges=6):
        """Votes on a kit of originals, by judges who mostly find "mine" more like them than "ward",
        and that than "abc". Returns the files, the kit, and the votes on each configuration: for the
        left approximation, equal, for the right one."""
        write_reference_selection(self.work)
        self.selection = self.work / "results" / "selection.csv"
        self.assert_success("judge", "--selection", self.selection, "--size", "16", "--sentinels", "3",
                            "--random", "4", "--repeats", "25", "--out", "kit", "--quiet")
        kit = read_json(self.work / "kit" / "kit.json")
        counts, files = {}, []
        for judge in range(judges):
            rows = []
            for trial in kit["trials"]:
                places = [["mine", "ward", "abc"].index(trial[side][1].split("/")[0])
                          if trial[side][1] != trial[side][0] else -1 for side in ("left", "right")]
                better = 1 if places[0] < places[1] else 3
                vote = self.random.choices([better, 2, 4 - better], [0.75, 0.1, 0.15])[0]
                if trial["kind"] == "sentinel":
                    self.assertEqual(better, trial["expected"])
                    vote = 4 - better if judge == 0 else better
                elif trial["kind"] != "repeat":
                    of = counts.setdefault((trial["kind"], *trial["left"], trial["right"][1]), [0, 0, 0])
                    of[vote - 1] += 1
                swapped = self.random.random() < 0.5
                sides = [trial["left"], trial["right"]]
                rows.append([trial["configuration"], trial["kind"],
                             *sum(reversed(sides) if swapped else sides, []), int(swapped),
                             4 - vote if swapped else vote, 1000])
            files.append(self.write_judge(f"judge {judge}", rows, kit=kit["kit_hash"]))
        return files, kit, counts

    def test_which_approximation_people_take_for_the_original(self):
        files, kit, counts = self.reference_experiment()
        arguments = ("votes", *files, "--selection", self.selection)
        output = self.assert_success(*arguments, "--kit", "kit/kit.json", "--out", "out")
        self.assertIn('which approximation looks more like the original, of "measured"?', output)
        self.assertIn("overall p", output)
        self.assertNotIn("judges and materials", output)
        self.assertIn("judges and originals as clusters", output)
        figures = read_json(self.work / "out" / "summary.json")["figures"]
        self.assertEqual(figures["reference"], "measured")
        self.assertEqual((figures["sentinels"]["answered"], figures["sentinels"]["passed"]), (18, 15))
        self.assertEqual(sum(figures["selection"]["votes"]), 6 * 8)
        for kind in "selection", "random":
            plain = {}
            for (of, original, left, right), votes in counts.items():
                labels = [name.split("/")[0] for name in (left, right)]
                both = sorted(labels)
                for label, other, mine in ((labels[0], None, votes), (labels[1], None, votes[::-1]),
                                           (*both, votes if both == labels else votes[::-1])):
                    if of == kind:
                        row = plain.setdefault((label, other), [0, 0, 0, 0])
                        for i, number in enumerate([1, *mine]):
                            row[i] += number
            found = {(r["label"], r["other"]): [r["configurations"], *r["votes"]]
                     for r in figures[kind]["approximations"]}
            self.assertEqual(found, plain)
            for row in figures[kind]["approximations"]:
                chosen, equal, _ = row["votes"]
                self.assertAlmostEqual(row["share"]["value"], (chosen + equal / 2) / sum(row["votes"]))
        best = {r["label"]: r["share"]["value"] for r in figures["selection"]["approximations"]
                if r["other"] is None}
        self.assertEqual(max(best, key=best.get), "mine")
        # Without the kit the summary beside the selection says what was asked.
        self.assert_success(*arguments, "--out", "without")
        without = read_json(self.work / "without" / "summary.json")["figures"]
        self.assertEqual(without["selection"], figures["selection"])
        self.assertIsNone(without["sentinels"])
        # `score` takes the judgements, and its share of majorities is what can be counted.
        result = self.run_program("score", "--judgements", "out/judgements.csv", "--metrics",
                                  "cwcbrt,pawcielab", "--out", "score")
        self.assertEqual(result.returncode, 0, result.stderr)
        score = read_json(self.work / "score" / "summary.json")
        self.assertEqual(score["judgements"]["configurations"], 12)
        self.assertEqual(score["intervals"]["configurations_without_reference"], 0)
        untied = [votes for votes in counts.values() if votes[0] != votes[2]]
        first = sum(votes[0] > votes[2] for votes in untied) / len(untied)
        for metric, share in zip(score["metrics"], (first, 1 - first)):
            self.assertAlmostEqual(metric["majorities"]["value"], share)
        if CHROMIUM is None:
            raise AssertionError("there is no chromium; scripts/setup.sh installs it")
        with Browser() as browser:
            for width in 1200, 390:
                browser.open(self.work / "out" / "votes.html", width=width)
                self.assertEqual(browser.complaints(), [])
                self.assertLessEqual(browser.run("document.documentElement.scrollWidth"), width)
            rows = browser.run("[...document.querySelectorAll('#approximations tbody')].map(b => "
                               "[...b.rows].map(r => [...r.cells].map(c => c.textContent)))")
            self.assertEqual(rows[0][0][0], "mine")
            for row in rows[0]:
                label, other = row[0], None if row[1] == "all others" else row[1]
                turned = other is not None and label > other
                key = (other, label) if turned else (label, other)
                [known] = [r for r in figures["selection"]["approximations"]
                           if (r["label"], r["other"]) == key]
                votes = known["votes"][::-1] if turned else known["votes"]
                self.assertEqual(row[3:7], [*map(str, votes), str(known["configurations"])])
                share = known["share"]["value"]
                self.assertTrue(row[2].startswith(f"{100 * (1 - share if turned else share):.1f} %"), row)
            self.assertEqual(len(rows[0]), len(figures["selection"]["approximations"]))
            self.assertEqual(rows[1][0], ["of random disagreements"])
            self.assertIn("nearer to it under cwcbrt", browser.text("#rows-hint"))
            self.assertIn("with the original itself on one side, 3 got another", browser.text("#checks"))
            self.assertIn("judges and originals as clusters", browser.text("#lead"))

    def test_votes_on_approximations_of_other_originals(self):
        files, kit, _ = self.reference_experiment(judges=1)
        path = self.work / "kit" / "kit.json"
        kit["trials"][0]["left"].reverse()
        path.write_text(json.dumps(kit))
        self.assert_refused(INPUT, ["kit.json, trials[0]", '"measured/…", first on both sides'],
                            "votes", *files, "--selection", self.selection, "--kit", path)
        summary = self.work / "results" / "summary.json"
        summary.write_text(summary.read_text().replace('{"label": "measured"}', '{"label": "abc"}'))
        self.assert_refused(INPUT, ["selection.csv, row 1", '"abc/…", first on both sides'],
                            "votes", *files, "--selection", self.selection)

    def test_power(self):
        output = self.assert_success("power", "--judges", "6:8", "--configurations", "100", "--p", "1")
        lines = [line.split() for line in output.splitlines()]
        self.assertIn(["6", "1.000", "0.000"], lines)
        self.assertIn(["7", "1.000", "1.000"], lines)
        self.assertIn("100 configurations: 7 judges", output)
        for options, words in ((["--judges", "5:4"], ["FROM first", "5:4"]),
                               (["--judges", "0"], ["from 1 to", "\"0\""]),
                               (["--judges", "5:x"], ["5:x"]),
                               (["--configurations", "1:2:3"], ["1:2:3"]),
                               (["--p", "1.5"], ["--p", "1.5"]),
                               (["--p", "nan"], ["--p", "nan"]),
                               (["--p", "0.9", "--equal", "0.2"], ["sum of 1"])):
            self.assert_refused(USAGE, words, "power", *options)


if __name__ == "__main__":
    support.main()
