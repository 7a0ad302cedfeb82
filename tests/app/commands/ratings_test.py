"""merl-scan score --ratings: against a plain program, and what is wrong with files."""

import math
import random

import support
from support import INPUT, USAGE, Case, read_csv, read_json, write_database
from tables import write_rows

FILES = ["rating_differences.csv", "rating_scores.csv", "ratings.csv", "summary.json"]
COLUMNS = ["original", "approximation", "rating"]

# Student's t with 9 degrees of freedom, 0.975: scipy.stats.t.ppf of scipy 1.10.1.
T9 = 2.2621571627409915


def sign(x):
    return (x > 0) - (x < 0)


def weighted(xs, ys, weights):
    """Spearman's and Kendall's correlation by their definitions as sums over pairs."""
    n = range(len(xs))
    dx = [[sign(xs[i] - xs[j]) for j in n] for i in n]
    dy = [[sign(ys[i] - ys[j]) for j in n] for i in n]
    pairs = [(i, j, weights[i] * weights[j]) for i in n for j in n]
    tau = (sum(w * dx[i][j] * dy[i][j] for i, j, w in pairs)
           / math.sqrt(sum(w * dx[i][j] ** 2 for i, j, w in pairs)
                       * sum(w * dy[i][j] ** 2 for i, j, w in pairs)))
    rank_x = [sum(weights[j] * dx[i][j] for j in n) for i in n]
    rank_y = [sum(weights[j] * dy[i][j] for j in n) for i in n]
    covariance = sum(weights[i] * rank_x[i] * rank_y[i] for i in n)
    rho = covariance / math.sqrt(sum(weights[i] * rank_x[i] ** 2 for i in n)
                                 * sum(weights[i] * rank_y[i] ** 2 for i in n))
    return rho, tau


def shares(rows, xs, amount, weight):
    """Shares of pairs in people's order: rows are (original, rating)."""
    right = count = 0
    for i, (original, rating) in enumerate(rows):
        for j in range(i):
            if rows[j][0] == original and abs(rating - rows[j][1]) > amount:
                count += weight[original]
                says = -sign(xs[i] - xs[j]) * sign(rating - rows[j][1])
                right += weight[original] * (1 + says) / 2
    return right / count


class Ratings(Case):
    """Ten originals with four approximations each, in a table of these pairs alone."""

    def setUp(self):
        super().setUp()
        self.random = random.Random(11)
        self.originals = [f"o{i}" for i in range(10)]
        self.methods = ["abc", "=1+1", "<b>ward", "sgd"]
        self.metrics = ["net", "two, quoted"]
        self.rows = []
        self.distances = {}
        table = []
        for original in self.originals:
            # All different within an original: so all have six pairs.
            ratings = self.random.sample([1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5], 4)
            for method, rating in zip(self.methods, ratings):
                distances = [round(self.random.lognormvariate(-0.3 * rating, 0.7), 1),
                             round(self.random.lognormvariate(0, 1), 1)]
                self.rows.append([original, method, rating])
                self.distances[original, method] = distances
                table.append([f"{method}/{original}", f"ref/{original}", *distances])
        self.random.shuffle(table)
        write_rows(self.work / "t.csv", ["material_1", "material_2", *self.metrics], table)
        write_rows(self.work / "r.csv", COLUMNS, self.random.sample(self.rows, len(self.rows)))

    def score(self, *options, ratings="r.csv", reference="ref"):
        self.output = self.assert_success(
            "score", "--ratings", ratings, "--distances", "t.csv", "--reference", reference,
            "--out", "out", "--force", *options)
        self.assertEqual(sorted(f.name for f in (self.work / "out").iterdir()), FILES)
        header, rows = read_csv(self.work / "out" / "rating_scores.csv")
        return {row[0]: dict(zip(header, row)) for row in rows}

    def assert_figure(self, row, name, figure):
        """`figure` gives the value when originals weigh so much."""
        value = figure({o: 1 for o in self.originals})
        self.assertAlmostEqual(float(row[name]), value, delta=1e-12)
        step = 1e-4
        influences = []
        for original in self.originals:
            at = [figure({o: 1 + s * (o == original) for o in self.originals})
                  for s in (step, -step)]
            influences.append((at[0] - at[1]) / (2 * step))
        half = T9 * math.sqrt(10 / 9 * sum(i * i for i in influences))
        low, high = (0 if name.startswith("pairs") else -1), 1
        self.assertAlmostEqual(float(row[name + "_low"]), max(low, value - half), delta=1e-7)
        self.assertAlmostEqual(float(row[name + "_high"]), min(high, value + half), delta=1e-7)

    def assert_figures(self, row, xs):
        rated = [(original, rating) for original, _, rating in self.rows]
        people = [-rating for _, rating in rated]
        for place, name in enumerate(("spearman", "kendall")):
            self.assert_figure(
                row, name, lambda w: weighted(xs, people, [w[o] for o, _ in rated])[place])
        self.assert_figure(row, "pairs", lambda w: shares(rated, xs, 0, w))
        return rated

    def test_figures_and_intervals(self):
        scores = self.score()
        self.assertEqual(list(scores), [*self.metrics, "(name alone)"])
        for m, metric in enumerate(self.metrics):
            xs = [self.distances[o, method][m] for o, method, _ in self.rows]
            rated = self.assert_figures(scores[metric], xs)
            self.assertAlmostEqual(float(scores[metric]["pairs_apart"]),
                                   shares(rated, xs, 0.4, {o: 1 for o in self.originals}))
            ties = sum(1 for i, (o, *_) in enumerate(self.rows) for j in range(i)
                       if self.rows[j][0] == o and xs[i] == xs[j])
            self.assertEqual(int(scores[metric]["ties"]), ties)
        of = {}
        for _, method, rating in self.rows:
            of.setdefault(method, []).append(rating)
        alone = [-(sum(of[method]) - rating) / 9 for _, method, rating in self.rows]
        rated = [(original, rating) for original, _, rating in self.rows]
        self.assert_figure(scores["(name alone)"], "pairs", lambda w: shares(rated, alone, 0, w))
        for name in "spearman", "kendall_low":
            self.assertEqual(scores["(name alone)"][name], "")
        summary = read_json(self.work / "out" / "summary.json")
        self.assertEqual(summary["ratings"]["rated_approximations"], 40)
        self.assertEqual(summary["ratings"]["approximation_names"], sorted(self.methods))
        self.assertEqual(summary["intervals"]["pairs"]["pairs"], 60)
        self.assertEqual(summary["intervals"]["correlations"]["effective_clusters"], 10)
        self.assertAlmostEqual(summary["apart"], 0.4)
        self.assertEqual(summary["distances"]["file"], "t.csv")
        self.assertRegex(summary["ratings"]["sha256"], "^[0-9a-f]{64}$")

    def test_tables(self):
        self.score()
        header, rows = read_csv(self.work / "out" / "ratings.csv")
        self.assertEqual(header, [*COLUMNS[:2], "ratings", "rating", "name_alone", *self.metrics])
        expected = sorted(
            [f"ref/{o}", f"{method}/{o}", "1", rating, *self.distances[o, method]]
            for o, method, rating in self.rows)
        self.assertEqual([[*r[:3], float(r[3]), float(r[5]), float(r[6])] for r in rows], expected)
        header, rows = read_csv(self.work / "out" / "rating_differences.csv")
        self.assertEqual([row[:2] for row in rows],
                         [self.metrics, [self.metrics[0], "(name alone)"],
                          [self.metrics[1], "(name alone)"]])
        scores = {r[0]: r for r in read_csv(self.work / "out" / "rating_scores.csv")[1]}
        for row in map(lambda r: dict(zip(header, r)), rows):
            for place, name in (1, "spearman"), (7, "pairs"), (10, "pairs_apart"):
                if name == "spearman" and row["metric_2"] == "(name alone)":
                    self.assertEqual((row[name], row[name + "_clear_of_0"]), ("", "0"))
                    continue
                difference = (float(scores[row["metric_1"]][place])
                              - float(scores[row["metric_2"]][place]))
                self.assertAlmostEqual(float(row[name]), difference)
                low, high = float(row[name + "_low"]), float(row[name + "_high"])
                self.assertEqual(row[name + "_clear_of_0"], str(int(low > 0 or high < 0)))

    def test_nothing_depends_on_the_order_of_rows_or_on_how_it_is_written(self):
        self.score()
        results = {name: (self.work / "out" / name).read_bytes() for name in FILES[:3]}
        comma = lambda x: str(x).replace(".", ",")
        forms = {
            "reversed.csv": "original,approximation,rating\n" + "".join(
                f"{o},{m},{r}\n" for o, m, r in reversed(self.rows)),
            "columns.csv": "note,rating,original,approximation\n" + "".join(
                f"\"a, b\",{r},ref/{o},{m}/{o}\n" for o, m, r in self.rows),
            "german.csv": "original;approximation;rating;\r\n" + "".join(
                f"{o};{m};{comma(float(r))};\r\n" for o, m, r in self.rows),
            "twice.csv": "original,approximation,rating\n" + "".join(
                f"{o},{m},{r - 0.25}\n{o},{m},{r + 0.25}\n" for o, m, r in self.rows),
        }
        for name, text in forms.items():
            with self.subTest(name):
                (self.work / name).write_text(text)
                self.score(ratings=name)
                for file in FILES[:2] if name == "twice.csv" else FILES[:3]:
                    self.assertEqual((self.work / "out" / file).read_bytes(), results[file], file)
        self.assertIn("80 ratings; those of one approximation are averaged, of 40", self.output)

    def test_differences_and_the_format_of_lavoue(self):
        expected = self.score("--differ-by", "0.4")
        write_rows(self.work / "d.csv", ["original", "approximation", "difference"],
                   [[o, m, -r] for o, m, r in self.rows])
        self.assertEqual(self.score("--differ-by", "0.4", ratings="d.csv"), expected)
        text = '"METHOD";"BRDF";"DISTANCE"\n' + "".join(
            f'"{m.upper()}";"{o}";{(5 - r) / 4}\n' for o, m, r in self.rows)
        (self.work / "l.csv").write_text(text)
        write_rows(self.work / "n.csv", ["name_in_ratings", "name"],
                   [[m.upper(), m] for m in self.methods])
        self.assertEqual(self.score("--names", "n.csv", ratings="l.csv"), expected)
        self.assertIn("Lavoué 2021: the lower the better", self.output)
        self.assertRegex(self.output, r"60 of one original .*, \d+ of them by more than 0\.1\n")
        line = self.refuse(INPUT, ["each of the 1 rows", '"ABC" (there is "abc")'],
                           ratings="only.csv", text='METHOD;BRDF;DISTANCE\n"ABC";"o1";0,5\n')
        self.assertIn("--names", line)

    def refuse(self, status, words, *options, text=None, ratings="bad.csv", reference="ref"):
        if text is not None:
            (self.work / ratings).write_text(text)
        return self.assert_refused(status, words, "score", "--ratings", ratings, "--distances",
                                   "t.csv", "--reference", reference, "--out", "new", *options)

    def test_bad_ratings(self):
        header = "original,approximation,rating\n"
        for text, words, *options in (
            ("", ["is empty"]),
            (header, ["line 1", "no row"]),
            ("a,b\n", ["line 1", "a,b", "difference"]),
            (header + "o1,abc,nan\n", ["line 2", "\"nan\""]),
            (header + "o1,abc,3,5\n", ["line 2", "4 fields", "decimal comma"]),
            (header + "o1,abc,7\n", ["line 2", "found 7", "from 1 to 5"], "--scale", "1:5"),
            (header + "o1,abc,3\no1,sgd,3\n", ["all with the rating 3"]),
            (header + "o1,abc,3\n", ["1 rated approximation"]),
            (header + "o1,o1,3\n", ["original itself"]),
            (header + "silk\x1b,abc,3\no1,phong,2\n",
             ["each of the 2 rows", '"phong", "silk\\x1b"', "--names"]),
        ):
            with self.subTest(text):
                self.refuse(INPUT, ["bad.csv", *words], *options, text=text)
        self.refuse(USAGE, ["--reference", '"nope"', "<b>ward, =1+1, abc, ref, sgd"],
                    reference="nope", text=header + "o1,abc,3\n")

    def test_bad_options(self):
        for scale in "1", "5:1", "1:1", "a:b", "1:inf", ":", "1:2:3":
            self.refuse(USAGE, ["--scale", f'"{scale}"', "1:5"], "--scale", scale, ratings="r.csv")
        self.refuse(USAGE, ["--differ-by"], "--differ-by", "-1", ratings="r.csv")
        self.refuse(USAGE, ["--judgements"], "--judgements", "r.csv", ratings="r.csv")
        self.assert_refused(USAGE, ["--judgements or --ratings"], "score", "--distances", "t.csv")
        self.assert_refused(USAGE, ["--ratings"], "score", "--judgements", "r.csv", "--distances",
                            "t.csv", "--reference", "ref")
        self.refuse(INPUT, ["absent.csv"], "--names", "absent.csv", ratings="r.csv")

    def test_unknown_names_and_what_is_printed(self):
        write_rows(self.work / "r.csv", COLUMNS,
                   [*self.rows, ["o1", "SGD", 3], ["gold", "sgd", 3], ["o2", "ref", 5]])
        self.score()
        ratings = read_json(self.work / "out" / "summary.json")["ratings"]
        self.assertEqual(ratings["unknown_names"], {"SGD": 1, "gold": 1})
        self.assertEqual((ratings["rows"], ratings["rows_with_unknown_names"],
                          ratings["rows_of_originals"]), (43, 2, 1))
        self.assertIn("2 names, in 2 of 43 rows: SGD (there is sgd), gold\n", self.output)
        self.assertIn("1 rating of an original itself left out", self.output)
        self.assertRegex(self.output, r"(?m)^metric +spearman +kendall +pairs in order +pairs apart$")
        self.assertRegex(self.output, r"(?m)^\(name alone\) ")
        self.assertRegex(self.output, r"(?m)^  against \(name alone\): ")

    def test_what_a_name_predicts_ties_as_decimals_do(self):
        write_rows(self.work / "t.csv", ["material_1", "material_2", "m"],
                   [["r/x", "a/x", 1], ["r/x", "b/x", 2], ["r/y", "a/y", 3], ["r/y", "b/y", 1], ["r/z", "a/z", 1],
                    ["r/z", "b/z", 2]])
        write_rows(self.work / "r.csv", ["original", "approximation", "rating"],
                   [["r/x", "a/x", 0.1], ["r/x", "b/x", 0.3], ["r/y", "a/y", 1], ["r/y", "b/y", 5],
                    ["r/z", "a/z", 0.7], ["r/z", "b/z", 0.5]])
        self.assert_success("score", "--ratings", "r.csv", "--distances", "t.csv", "--out", "out")
        header, rows = read_csv(self.work / "out" / "ratings.csv")
        alone = [dict(zip(header, row)) for row in rows]
        self.assertEqual([r["name_alone"] for r in alone if r["original"] == "r/y"], ["0.4", "0.4"])

    def test_a_pair_that_the_table_lacks(self):
        header, rows = read_csv(self.work / "t.csv")
        write_rows(self.work / "t.csv", header, rows[1:])
        lost = rows[0][0]
        # Its name is gone with it, so the rating is of something unknown.
        self.score()
        self.assertEqual(
            read_json(self.work / "out" / "summary.json")["ratings"]["unknown_names"], {lost: 1})


class Database(Case):
    """Ratings on files that are rendered nowhere: only the distances of rated pairs."""

    warns = True

    def setUp(self):
        super().setUp()
        for name, seed in ("ref", 0), ("one", 50), ("two", 90):
            write_database(self.work / name, {f"m{i}": support.samples(i if name == "ref" else seed + i)
                                              for i in range(6)})
        self.random = random.Random(1)
        self.rows = [[f"m{i}", label, self.random.randrange(1, 6)]
                     for i in range(6) for label in ("one", "two")]
        write_rows(self.work / "r.csv", COLUMNS, self.rows)

    def test_distances_are_those_of_a_scan(self):
        databases = [x for name in ("ref", "one", "two") for x in ("--database", name)]
        self.assert_success("compare", *databases, "--metrics", "cwcbrt,pawcielab", "--out", "all")
        output = self.assert_success("score", "--ratings", "r.csv", *databases, "--reference", "ref",
                                     "--metrics", "cwcbrt,pawcielab", "--out", "out")
        _, rows = read_csv(self.work / "all" / "distances.csv")
        distances = {frozenset(r[:2]): [float(x) for x in r[2:]] for r in rows}
        _, rows = read_csv(self.work / "out" / "ratings.csv")
        self.assertEqual(len(rows), 12)
        for row in rows:
            for found, expected in zip(row[5:], distances[frozenset(row[:2])]):
                self.assertAlmostEqual(float(found), expected, delta=1e-5 * expected)
        summary = read_json(self.work / "out" / "summary.json")
        self.assertEqual([m["undecided"] for m in summary["metrics"]], [0, 0])
        self.assertEqual(summary["options"]["reference"], "ref")
        self.assertRegex(output, r"(?m)^databases +one: 6 materials of one, MERL directory$")

    def test_copies_tie_after_refining(self):
        """An approximation that is there twice has one distance, whatever float32 makes of it."""
        write_database(self.work / "three", {f"m{i}": support.samples(50 + i) for i in range(6)})
        rows = [*self.rows, *([f"m{i}", "three", 6 + i % 2] for i in range(6))]
        write_rows(self.work / "r.csv", COLUMNS, rows)
        self.assert_success(
            "score", "--ratings", "r.csv", *(x for name in ("ref", "one", "two", "three")
                                            for x in ("--database", name)),
            "--reference", "ref", "--metrics", "cwcbrt", "--out", "out")
        metric = read_json(self.work / "out" / "summary.json")["metrics"][0]
        self.assertEqual((metric["ties"], metric["undecided"]), (6, 0))
        self.assertGreaterEqual(metric["refined_distances"], 12)


if __name__ == "__main__":
    support.main()
