"""merl-scan score: judgements of every format against a plain program."""

import csv
import hashlib
import itertools
import json
import math
import os
import random
import re
import xml.etree.ElementTree

import support
from support import INPUT, OUTPUT, USAGE, Case, read_csv, read_json, write_database

FILES = ["score.csv", "score.svg", "score_pairs.csv", "summary.json"]
NAMES = ["chrome", "=1+1", 'a "quoted", <name>', "ä", "Z", "wood", "x&y", "nylon", "pvc", "teflon"]

REFERENCE = ["reference", "a", "b", "votes_a", "votes_b"]
CONFIGURATION = ["left_1", "left_2", "right_1", "right_2", "votes_left", "votes_equal",
                 "votes_right"]


def write_rows(path, header, rows):
    with open(path, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])


def shares(rows, distance):
    """Share of majorities, share of votes, ceiling: rows are (pair, pair, left, equal, right)."""
    right = untied = votes = predicted = best = 0
    for left_pair, right_pair, left, equal, other in rows:
        a, b = distance[frozenset(left_pair)], distance[frozenset(right_pair)]
        side = 1 if a < b else 0 if a > b else 0.5
        votes += left + equal + other
        predicted += side * left + (1 - side) * other + equal / 2
        best += max(left, other) + equal / 2
        if left != other:
            untied += 1
            right += side if left > other else 1 - side
    return right / untied, predicted / votes, best / votes


def slope_is_best(rows, distance, slope):
    """Whether the derivative of the log-likelihood is 0 there, beside what it is made of."""
    derivative = size = 0
    for left_pair, right_pair, left, equal, other in rows:
        x = math.log(distance[frozenset(right_pair)] / distance[frozenset(left_pair)])
        p = 1 / (1 + math.exp(-slope * x))
        derivative += x * ((left + equal / 2) * (1 - p) - (other + equal / 2) * p)
        size += abs(x) * (left + equal + other)
    return abs(derivative) <= 1e-12 * size


class Score(Case):
    def setUp(self):
        super().setUp()
        self.random = random.Random(7)
        self.metrics = ["net", "=SUM(A1)", "<b>\x07"]
        self.distance = {}
        rows = []
        for pair in itertools.combinations(NAMES, 2):
            numbers = [self.random.lognormvariate(0, 1), self.random.randrange(1, 4), 1]
            self.distance[frozenset(pair)] = numbers
            rows.append([*pair, *numbers])
        write_rows(self.work / "t.csv", ["material_1", "material_2", *self.metrics], rows)

    def under(self, metric):
        return {pair: numbers[metric] for pair, numbers in self.distance.items()}

    def votes(self):
        return self.random.randrange(6)

    def reference_rows(self):
        return [[*row, self.votes(), self.votes()]
                for row in self.random.sample(list(itertools.permutations(NAMES, 3)), 160)]

    def score(self, *options, judgements="votes.csv", out="out", distances="t.csv"):
        self.output = self.assert_success("score", "--judgements", judgements, "--distances",
                                          distances, "--out", out, *options)
        return self.work / out

    def assert_scores(self, results, rows):
        header, table = read_csv(results / "score.csv")
        self.assertEqual([row[0] for row in table], self.metrics)
        for metric, row in enumerate(table):
            row = dict(zip(header, row))
            right, votes, ceiling = shares(rows, self.under(metric))
            self.assertAlmostEqual(float(row["majorities"]), right, 14)
            self.assertAlmostEqual(float(row["votes"]), votes, 14)
            self.assertTrue(slope_is_best(rows, self.under(metric), float(row["slope"])))
            for figure in "majorities", "votes", "slope", "log_likelihood_per_vote":
                if figure.startswith("log") and float(row["slope"]) < 0:  # that of chance
                    self.assertEqual(row[figure + "_low"], "")
                    continue
                if int(row["ties"]) == len(rows):  # nothing that could differ between samples
                    self.assertEqual((row[figure + "_low"], row[figure + "_high"]), ("", ""))
                    continue
                self.assertLessEqual(float(row[figure + "_low"]), float(row[figure]))
                self.assertGreaterEqual(float(row[figure + "_high"]), float(row[figure]))
        summary = read_json(results / "summary.json")
        self.assertAlmostEqual(summary["ceiling"]["votes"]["value"], ceiling, 14)
        return summary

    def merged(self, rows):
        """Rows of (reference, a, b, for a, for b) as configurations, equal ones added up."""
        votes = {}
        for r, a, b, for_a, for_b in rows:
            pairs = sorted([((r, a), for_a), ((r, b), for_b)], key=lambda x: sorted(x[0]))
            key = tuple(tuple(sorted(pair)) for pair, _ in pairs)
            have = votes.setdefault(key, [0, 0])
            have[0] += pairs[0][1]
            have[1] += pairs[1][1]
        return [(*key, left, 0, right) for key, (left, right) in votes.items()]

    def test_with_a_reference(self):
        rows = self.reference_rows()
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        results = self.score()
        self.assertEqual(sorted(os.listdir(results)), FILES)
        everything = self.merged(rows)
        merged = [row for row in everything if row[2] + row[4] > 0]
        summary = self.assert_scores(results, merged)
        judgements = summary["judgements"]
        self.assertEqual(judgements["format"], "reference CSV")
        self.assertEqual((judgements["rows"], judgements["configurations"]), (160, len(merged)))
        self.assertEqual(judgements["without_votes"], len(everything) - len(merged))
        self.assertEqual(judgements["untied"], sum(left != right for *_, left, _, right in merged))
        self.assertEqual(judgements["votes"], sum(row[3] + row[4] for row in rows))
        intervals = summary["intervals"]
        self.assertEqual(intervals["references"], len({r[0] for r in rows}))
        self.assertEqual(intervals["materials"], len(NAMES))
        self.assertEqual(intervals["configurations_without_reference"], 0)
        self.assertIsNone(intervals["too_few"])
        self.assertEqual(summary["distances"]["file"], "t.csv")
        self.assertEqual([m["name"] for m in summary["metrics"]], self.metrics)
        header, pairs = read_csv(results / "score_pairs.csv")
        self.assertEqual(len(pairs), 3)
        for row in pairs:
            row = dict(zip(header, row))
            one, other = (self.under(self.metrics.index(row[m])) for m in ("metric_1", "metric_2"))
            wins = [0, 0]
            for judgement in merged:
                if judgement[2] != judgement[4]:
                    first, second = shares([judgement], one)[0], shares([judgement], other)[0]
                    wins[0] += first > second
                    wins[1] += second > first
            self.assertEqual([int(row["right_1"]), int(row["right_2"])], wins)
            low, high = float(row["difference_low"]), float(row["difference_high"])
            self.assertAlmostEqual((low + high) / 2, float(row["difference"]), 14)
            self.assertEqual(row["clear_of_0"], "1" if low > 0 or high < 0 else "0")
            self.assertTrue(0 < float(row["p_holm"]) <= 1)

    def test_configurations(self):
        rows = []
        pairs = list(itertools.combinations(NAMES, 2))
        for left, right in self.random.sample(list(itertools.combinations(pairs, 2)), 60):
            rows.append((left, right, self.votes(), self.votes(), self.votes()))
        write_rows(self.work / "votes.csv", CONFIGURATION,
                   [[*left, *right, *votes] for left, right, *votes in rows])
        rows = [row for row in rows if any(row[2:])]  # the others nobody judged
        summary = self.assert_scores(self.score(), rows)
        shared = {m for left, right, *_ in rows for m in set(left) & set(right)}
        alone = sum(not set(left) & set(right) for left, right, *_ in rows)
        self.assertEqual(summary["intervals"]["references"], len(shared))
        self.assertEqual(summary["intervals"]["configurations_without_reference"], alone)
        self.assertEqual(summary["judgements"]["equal_votes"], sum(row[3] for row in rows))

    def test_nothing_depends_on_order_sides_or_threads(self):
        rows = self.reference_rows()
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        first = self.score("--threads", "1")
        self.random.shuffle(rows)
        write_rows(self.work / "other.csv", REFERENCE,
                   [(r, b, a, for_b, for_a) for r, a, b, for_a, for_b in rows])
        second = self.score("--threads", "3", judgements="other.csv", out="second")
        for name in "score.csv", "score_pairs.csv":
            self.assertEqual((first / name).read_bytes(), (second / name).read_bytes())

    def test_simulated_judges(self):
        rows = []
        for r, a, b in itertools.permutations(NAMES, 3):
            closer = self.distance[frozenset((r, a))][0], self.distance[frozenset((r, b))][0]
            p = 1 / (1 + (closer[0] / closer[1]) ** 1.5)
            for_a = sum(self.random.random() < p for _ in range(200))
            rows.append([r, a, b, for_a, 200 - for_a])
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        metric = read_json(self.score() / "summary.json")["metrics"][0]
        self.assertAlmostEqual(metric["slope"]["value"], 1.5, delta=0.05)
        self.assertGreater(metric["majorities"]["value"], 0.9)
        self.assertLess(metric["slope"]["low"], 1.5)
        self.assertGreater(metric["slope"]["high"], 1.5)

    def test_the_plot_is_well_formed_and_self_contained(self):
        write_rows(self.work / "<votes>.csv", REFERENCE, self.reference_rows())
        text = (self.score(judgements="<votes>.csv") / "score.svg").read_text(encoding="utf-8")
        root = xml.etree.ElementTree.fromstring(text)
        texts = [node.text for node in root.iter("{http://www.w3.org/2000/svg}text")]
        for metric in "net", "=SUM(A1)", "<b>\\x07":
            self.assertIn(metric, texts)
        self.assertTrue(any(t.startswith("<votes>.csv: ") for t in texts))
        self.assertEqual(text.count("http"), 1)  # the name space
        self.assertNotIn("<script", text)

    def test_a_metric_that_people_oppose(self):
        """Its likelihood is that of what it says, which is no better than chance."""
        near = self.under(0)
        rows = []
        for r, a, b, _, _ in self.reference_rows():
            far_a = near[frozenset((r, a))] > near[frozenset((r, b))]
            rows.append([r, a, b, 8 if far_a else 1, 1 if far_a else 8])
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        results = self.score()
        header, table = read_csv(results / "score.csv")
        row = dict(zip(header, table[0]))
        self.assertLess(float(row["slope_high"]), 0)
        self.assertEqual(float(row["log_likelihood_per_vote"]), math.log(0.5))
        self.assertAlmostEqual(float(row["log_likelihood"]), len(rows) * 9 * math.log(0.5))
        self.assertEqual(row["log_likelihood_per_vote_low"], "")
        metric = read_json(results / "summary.json")["metrics"][0]
        self.assertIn("below 0", metric["log_likelihood_per_vote"]["too_few"])
        self.assertRegex(self.output, r"(?m)^net .* -0\.693 \[opposed\]$")
        self.assertIn("[opposed]: the slope is below 0", self.output)
        root = xml.etree.ElementTree.parse(results / "score.svg").getroot()
        svg = "{http://www.w3.org/2000/svg}"
        panel = [g for g in root.iter(f"{svg}g") if g[0].text == "Log-likelihood per vote"][0]
        opposed = [c for c in panel.iter(f"{svg}circle") if c.get("class") == "opposed"]
        chance = next(c for c in panel.iter(f"{svg}line") if c.get("class") == "chance")
        self.assertIn(chance.get("x1"), [c.get("cx") for c in opposed])
        self.assertEqual(len([c for c in root.iter(f"{svg}circle") if c.get("class")]), len(opposed))
        self.assertIn("Open circles", "".join(root.itertext()))

    def test_a_metric_that_is_no_better_than_chance(self):
        """A slope below 0 that is not clear of it is not called the opposite of what people do."""
        rows = [[r, a, b, 5, 4] if k % 2 else [r, a, b, 4, 5]
                for k, (r, a, b, _, _) in enumerate(self.reference_rows())]
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        header, table = read_csv(self.score() / "score.csv")
        slopes = [{key: float(dict(zip(header, row))[key] or "nan") for key in ("slope", "slope_high")}
                  for row in table]
        self.assertTrue(any(s["slope"] < 0 < s["slope_high"] for s in slopes), slopes)
        self.assertEqual(self.output.count("-0.693 [chance]"), sum(s["slope"] < 0 < s["slope_high"] for s in slopes))
        self.assertEqual(self.output.count("-0.693 [opposed]"), sum(s["slope_high"] < 0 for s in slopes))
        self.assertIn("[chance]: the slope is below 0, but not clear of it", self.output)

    def test_the_table_in_the_terminal(self):
        write_rows(self.work / "votes.csv", REFERENCE, self.reference_rows())
        self.score()
        for metric in "net", "=SUM(A1)", "<b>\\x07":
            self.assertRegex(self.output, rf"(?m)^{re.escape(metric)} +0")
        self.score("--quiet", "--force")
        self.assertEqual(self.output, "")

    def test_too_few_for_certainty(self):
        names = sorted(NAMES)
        write_rows(self.work / "votes.csv", REFERENCE,
                   [[names[0], a, b, 9, 0] for a, b in itertools.combinations(names[1:], 2)])
        results = self.score()
        reason = "references and configurations without one: 1; expected 5 or more"
        self.assertIn("[too few]", self.output)
        self.assertIn(f"intervals       none; {reason}", self.output)
        self.assertNotIn("clear of 0", self.output)
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["intervals"]["too_few"], reason)
        for metric in summary["metrics"]:
            self.assertEqual((metric["votes"]["low"], metric["votes"]["too_few"]), (None, reason))
        header, pairs = read_csv(results / "score_pairs.csv")
        for row in pairs:
            row = dict(zip(header, row))
            self.assertEqual((row["p_holm"], row["difference_low"], row["clear_of_0"]),
                             ("", "", "0"))

    def test_a_difference_is_clear_of_0_or_said_not_to_be(self):
        rows = []
        for r, a, b in itertools.permutations(NAMES, 3):
            near = self.distance[frozenset((r, a))][0] < self.distance[frozenset((r, b))][0]
            rows.append([r, a, b, 3 if near else 1, 1 if near else 3])
        write_rows(self.work / "votes.csv", REFERENCE, rows[::3])
        header, pairs = read_csv(self.score() / "score_pairs.csv")
        pairs = {(row["metric_1"], row["metric_2"]): row for row in
                 (dict(zip(header, row)) for row in pairs)}
        self.assertEqual(pairs["net", "=SUM(A1)"]["clear_of_0"], "1")
        self.assertLess(float(pairs["net", "=SUM(A1)"]["p_holm"]), 0.05)
        self.assertEqual(pairs["=SUM(A1)", "<b>\x07"]["clear_of_0"], "0")
        self.assertNotIn("not clear", self.output)  # of the best metric: what it shows
        # The other way round people follow none, and the difference of the best is small.
        write_rows(self.work / "coin.csv", REFERENCE,
                   [[*row[:3], k % 2 + 1, 2 - k % 2] for k, row in enumerate(rows[::3])])
        self.score(judgements="coin.csv", out="coin")
        self.assertIn("; not clear of 0", self.output)
        self.assertNotIn(" p ", self.output)

    def test_the_hash_of_the_file(self):
        write_rows(self.work / "votes.csv", REFERENCE, self.reference_rows())
        summary = read_json(self.score() / "summary.json")
        self.assertEqual(summary["judgements"]["sha256"],
                         hashlib.sha256((self.work / "votes.csv").read_bytes()).hexdigest())
        # Of metrics from a table nothing is known but the name.
        self.assertEqual([m["fitted_to_judgements"] for m in summary["metrics"]], [False] * 3)
        self.assertNotIn("fitted", summary["metrics"][0])

    def test_a_metric_that_is_always_right(self):
        near, far = sorted(self.distance, key=lambda pair: self.distance[pair][0])[:2]
        write_rows(self.work / "votes.csv", CONFIGURATION, [[*near, *far, 5, 0, 0]])
        metric = read_json(self.score() / "summary.json")["metrics"][0]
        self.assertEqual((metric["slope"]["value"], metric["log_likelihood"]), ("inf", 0))

    def test_unknown_materials(self):
        rows = [["chrome", "wood", "Z", 3, 1], ["chrome", "gold", "Z", 3, 1],
                ["gold", "silk\x1b[31m", "Z", 3, 1]]
        write_rows(self.work / "votes.csv", REFERENCE, rows)
        judgements = read_json(self.score() / "summary.json")["judgements"]
        self.assertEqual(judgements["unknown_materials"], {"gold": 2, "silk\x1b[31m": 1})
        self.assertEqual((judgements["rows"], judgements["rows_with_unknown_materials"]), (3, 2))
        self.assertIn("2 materials, in 2 of 3 rows: gold, silk\\x1b[31m", self.output)
        write_rows(self.work / "votes.csv", REFERENCE, rows[1:])
        self.refuse(INPUT, ["votes.csv", "each of the 2 rows", "\"gold\", \"silk\\x1b[31m\""])

    def refuse(self, status, words, *options, judgements="votes.csv"):
        self.assert_refused(status, words, "score", "--judgements", judgements, "--distances",
                            "t.csv", "--out", "new", *options)

    def test_bad_judgements(self):
        self.refuse(INPUT, ["votes.csv", "cannot be opened"])
        (self.work / "votes.csv").mkdir()
        self.refuse(INPUT, ["votes.csv", "not a regular file"])
        (self.work / "votes.csv").rmdir()
        (self.work / "votes.csv").write_text("")
        self.refuse(INPUT, ["votes.csv", "is empty"])
        os.truncate(self.work / "votes.csv", (1 << 30) + 1)
        self.refuse(INPUT, ["votes.csv", "1073741825 bytes"])
        for row, words in (
            (["chrome", "wood", "Z", 3, -1], ["votes_b", "\"-1\""]),
            (["chrome", "wood", "Z", "three", 1], ["votes_a", "\"three\""]),
            (["chrome", "chrome", "Z", 3, 1], ["\"chrome\"", "reference and a"]),
            (["chrome", "wood", "Z", 3], ["4 fields"]),
        ):
            write_rows(self.work / "votes.csv", REFERENCE, [["chrome", "Z", "ä", 1, 1], row])
            self.refuse(INPUT, ["votes.csv, line 3", *words])
        write_rows(self.work / "votes.csv", ["who", "what"], [])
        self.refuse(INPUT, ["votes.csv, line 1", "who,what", "votes_a"])
        (self.work / "votes.json").write_text('{"answers": [[0, 1, 100]], "agreement": [[1, 2]]}')
        self.refuse(INPUT, ["votes.json", "answers[0]", "found 100"], judgements="votes.json")

    def test_bad_options(self):
        write_rows(self.work / "votes.csv", REFERENCE, [["chrome", "wood", "Z", 3, 1]])
        self.assert_refused(USAGE, ["--judgements"], "score")
        self.refuse(USAGE, ["--replicates"], "--replicates", "10")
        self.refuse(INPUT, ["t.csv", "\"w\""], "--metrics", "net,w")
        (self.work / "new").mkdir()
        self.refuse(OUTPUT, ["new", "exists"])


class Database(Case):
    """Distances of a database, on the device."""

    def test_a_metric_that_was_fitted_to_the_judgements(self):
        write_database(self.work / "db", {name: support.samples(i) for i, name in enumerate("abcd")})
        # With a byte order mark, which is part of the file.
        (self.work / "votes.csv").write_bytes(b"\xef\xbb\xbfreference,a,b,votes_a,votes_b\r\na,b,c,3,1\r\n")
        (self.work / "other.csv").write_bytes(b"reference,a,b,votes_a,votes_b\r\na,b,c,3,1\r\n")
        this = hashlib.sha256((self.work / "votes.csv").read_bytes()).hexdigest()
        text = ("// fitted: " + "0" * 64 + " Nobody 2001\n"
                f"// fitted: {this} Somebody\x1b[31m 2019,\n//   the training part\n"
                "// degree: 2\n// parameter: k = 1 in [0, 9] a factor\n"
                "vec3 transform(vec3 f, Voxel v) { return k * f; }\nfloat weight(Voxel v) { return 1.0; }\n"
                "float difference(float d) { return d * d; }\n")
        (self.work / "mine.glsl").write_text(text)
        score = ("score", "--database", "db", "--metrics", "rmse,mine.glsl:k=2", "--force", "--out", "out",
                 "--judgements")
        result = self.run_program(*score, "votes.csv")
        self.assertEqual(result.returncode, 0, result.stderr)
        line = self.only_line(result.stderr)
        for words in ("merl-scan: warning: mine.glsl:k=2 was fitted to votes.csv",
                      "(Somebody\\x1b[31m 2019, the training part)", "not how well it predicts"):
            self.assertIn(words, line)
        summary = read_json(self.work / "out" / "summary.json")
        self.assertEqual(summary["judgements"]["sha256"], this)
        self.assertEqual([m["fitted_to_judgements"] for m in summary["metrics"]], [False, True])
        self.assertEqual(summary["metrics"][1]["fitted"],
                         [{"sha256": "0" * 64, "citation": "Nobody 2001"},
                          {"sha256": this, "citation": "Somebody\x1b[31m 2019, the training part"}])
        (warning,) = summary["warnings"]
        self.assertIn("mine.glsl:k=2 was fitted to votes.csv", warning)
        header, table = read_csv(self.work / "out" / "score.csv")
        self.assertEqual([dict(zip(header, row))["fitted"] for row in table], ["0", "1"])
        self.assertRegex(result.stdout, r"(?m)^mine\.glsl:k=2 \+ +\d")
        self.assertRegex(result.stdout, r"(?m)^\+ fitted to these judgements")
        plot = (self.work / "out" / "score.svg").read_text(encoding="utf-8")
        self.assertIn("mine.glsl:k=2 †", plot)
        self.assertIn("† Fitted to these judgements", plot)
        # The same rows in another file are not known again.
        self.assert_success(*score, "other.csv")
        summary = read_json(self.work / "out" / "summary.json")
        self.assertEqual([m["fitted_to_judgements"] for m in summary["metrics"]], [False, False])
        self.assertEqual(summary["warnings"], [])
        (self.work / "mine.glsl").write_text(text.replace("0" * 64, "0" * 63))
        self.assert_refused(INPUT, ["mine.glsl:1: ", "SHA-256", "sha256sum"], *score, "votes.csv")

    def test_indices_are_those_of_the_100_materials(self):
        # 17 and 18 are chrome-steel and chrome, in the order of the files' names; 0 is alum-bronze.
        materials = {name: support.samples(i) for i, name in
                     enumerate(["alum-bronze", "chrome", "chrome-steel", "aluminium"])}
        write_database(self.work / "db", materials)
        (self.work / "votes.json").write_text(json.dumps(
            {"answers": [[17, 0, 18], [18, 2, 0], [99, 0, 1]], "agreement": [[5, 0], [1, 3], [1, 1]]}))
        write_rows(self.work / "votes.csv", REFERENCE, [
            ["chrome-steel", "alum-bronze", "chrome", 5, 0],
            ["chrome", "aluminium", "alum-bronze", 1, 3]])
        for votes in "votes.json", "votes.csv":
            self.assert_success("score", "--judgements", votes, "--database", "db", "--out",
                                votes + ".out")
        json_results, csv_results = self.work / "votes.json.out", self.work / "votes.csv.out"
        for name in "score.csv", "score_pairs.csv":
            self.assertEqual((json_results / name).read_bytes(), (csv_results / name).read_bytes())
        summary = read_json(json_results / "summary.json")
        self.assertEqual(summary["judgements"]["format"], "Lagunas 2019 JSON")
        self.assertEqual(summary["judgements"]["unknown_materials"],
                         {"alumina-oxide": 1, "yellow-plastic": 1})
        self.assertEqual(summary["database"]["kind"], "MERL directory")
        self.assertGreaterEqual(len(summary["metrics"]), 4)  # all that there are
        self.assertEqual(summary["intervals"]["references"], 2)
        self.assertTrue(summary["engines"])


if __name__ == "__main__":
    support.main()
