"""merl-scan compare: every two metrics of a database or a table."""

import math
import random
import signal

import reference
import support
from support import INPUT, OUTPUT, USAGE, Case, Running, read_csv, read_json, samples, tree, write_database
from tables import write_table

FILES = ["compare.csv", "compare.html", "distances.csv", "summary.json"]


def tau_b(first, second):
    """Kendall's tau-b, by looking at every two pairs."""
    total = ordered_first = ordered_second = 0
    for i in range(len(first)):
        for j in range(i):
            one = reference.sign(first[i] - first[j])
            other = reference.sign(second[i] - second[j])
            total += one * other
            ordered_first += one != 0
            ordered_second += other != 0
    if ordered_first == 0 or ordered_second == 0:
        return None
    return total / math.sqrt(ordered_first * ordered_second)


class Compare(Case):
    def compare(self, *options, out="out"):
        self.output = self.assert_success("compare", "--out", out, *options)
        results = self.work / out
        self.assertEqual(sorted(p.name for p in results.iterdir()), FILES)
        return results

    def assert_comparisons(self, results):
        """compare.csv and summary.json follow from distances.csv."""
        header, rows = read_csv(results / "distances.csv")
        metrics = header[2:]
        distances = [[float(row[2 + m]) for row in rows] for m in range(len(metrics))]
        pairs = [(i, j) for i in range(len(metrics)) for j in range(i + 1, len(metrics))]
        columns, comparisons = read_csv(results / "compare.csv")
        comparisons = [dict(zip(columns, row)) for row in comparisons]
        self.assertEqual([(c["metric_1"], c["metric_2"]) for c in comparisons],
                         [(metrics[i], metrics[j]) for i, j in pairs])
        summary = read_json(results / "summary.json")
        self.assertEqual([m["name"] for m in summary["metrics"]], metrics)
        self.assertEqual(len(summary["comparisons"]), len(pairs))
        for (i, j), row, entry in zip(pairs, comparisons, summary["comparisons"]):
            ranked = reference.disagreements(
                [(*r[:2], a, b) for r, a, b in zip(rows, distances[i], distances[j])])
            configurations = len(rows) * (len(rows) - 1) // 2
            self.assertEqual(int(row["configurations"]), configurations)
            self.assertEqual(int(row["disagreements"]), len(ranked))
            self.assertEqual(float(row["rate"]), len(ranked) / configurations)
            expected = tau_b(distances[i], distances[j])
            if expected is None:
                self.assertEqual((row["tau_b"], entry["tau_b"]), ("", None))
            else:
                self.assertAlmostEqual(float(row["tau_b"]), expected, 14)
                self.assertEqual(float(row["tau_b"]), entry["tau_b"])
            self.assertEqual(entry["metrics"], [metrics[i], metrics[j]])
            self.assertEqual(entry["disagreements"], len(ranked))
            self.assertEqual(sum(entry["counts"].values()), configurations)
            chosen = reference.selection(ranked, 5, 1)
            self.assertEqual([(s["left"], s["right"], s["agreement"]) for s in entry["strongest"]],
                             [([*l[:2]], [*r[:2]], a) for l, r, a in chosen])
            if ranked:
                left, right, agreement = ranked[0]
                self.assertEqual([row[c] for c in ("left_1", "left_2", "right_1", "right_2")],
                                 [*left[:2], *right[:2]])
                self.assertEqual(float(row["agreement"]), agreement)
            else:
                self.assertEqual(row["left_1"] + row["agreement"], "")
        return summary

    def test_all_metrics_of_a_database(self):
        write_database(self.work / "db", 8)
        results = self.compare("--database", "db", "--metrics", "all")
        summary = self.assert_comparisons(results)
        header, rows = read_csv(results / "distances.csv")
        self.assertGreaterEqual(len(header), 2 + len(reference.METRICS))
        for metric in reference.METRICS:
            expected = reference.distances(metric, [samples(i) for i in range(8)], support.GRID)
            for row, distance in zip(rows, expected):
                self.assertLess(abs(float(row[header.index(metric)]) / distance - 1), 2e-6)
        self.assertEqual(summary["database"]["kind"], "MERL directory")
        self.assertEqual((summary["materials"], summary["pairs"], summary["configurations"]),
                         (8, 28, 378))
        for metric in summary["metrics"]:
            for key in "title", "formula", "source":
                self.assertTrue(metric[key])

    def test_chosen_metrics_in_their_order(self):
        write_database(self.work / "db", 5)
        results = self.compare("--database", "db", "--metrics", "rmse,cwcbrt,pawcielab")
        self.assert_comparisons(results)
        self.assertEqual(read_csv(results / "distances.csv")[0][2:], ["rmse", "cwcbrt", "pawcielab"])

    def test_a_scan_of_two_counts_the_same(self):
        write_database(self.work / "db", 9)
        compared = self.compare("--database", "db", "--metrics", "cwcbrt,pawcielab")
        scanned = read_json(self.scan("--database", "db", out="scan") / "summary.json")
        row = read_json(compared / "summary.json")["comparisons"][0]
        self.assertEqual((row["disagreements"], row["counts"]["concordant"]),
                         (scanned["disagreements"], scanned["counts"]["concordant"]))

    def test_a_table_with_ties(self):
        numbers = random.Random(3)
        write_table(self.work / "t.csv", ["x", "y", "all the same"], "abcdefgh",
                    lambda m: 1 if m == "all the same" else numbers.randrange(1, 6))
        summary = self.assert_comparisons(self.compare("--distances", "t.csv"))
        self.assertEqual(summary["distances"]["file"], "t.csv")
        self.assertNotIn("device", summary)

    def test_its_distances_can_be_read_again(self):
        write_table(self.work / "t.csv", ['m,"1"', "=m2"], ["ä", "b,c", 'd"e', "=f"],
                    lambda _: random.random())
        first = self.compare("--distances", "t.csv")
        again = self.compare("--distances", first / "distances.csv", out="again")
        for name in "distances.csv", "compare.csv":
            self.assertEqual((first / name).read_bytes(), (again / name).read_bytes())

    def test_what_is_printed(self):
        write_table(self.work / "t.csv", ["net", "image", "other"], "abcde",
                    lambda _: random.random())
        self.compare("--distances", "t.csv")
        self.assertRegex(self.output, r"(?m)^net +image +\d+\.\d\d % +-?\d\.\d{3} +0 ")
        self.assertRegex(self.output, r"(?m)^materials +5$")
        self.assertIn("compare.html", self.output)
        self.assertEqual(self.assert_success("compare", "--distances", "t.csv", "--out", "out",
                                             "--force", "--quiet"), "")

    def test_names_do_nothing_to_a_terminal(self):
        write_table(self.work / "t.csv", ["x\x1b[31m", "y"], ["a\x1b[2J", "b", "c"],
                    lambda _: random.random())
        self.compare("--distances", "t.csv")
        self.assertNotIn("\x1b", self.output)
        self.assertIn("x\\x1b[31m", self.output)
        self.assertNotIn("\x1b", (self.work / "out" / "compare.html").read_text())

    def test_threads_do_not_matter(self):
        write_database(self.work / "db", 6)
        results = [self.compare("--database", "db", "--threads", str(n), out=f"out{n}")
                   for n in (1, 3)]
        for name in "distances.csv", "compare.csv":
            self.assertEqual(*((r / name).read_bytes() for r in results))

    def test_refused(self):
        write_table(self.work / "t.csv", ["x", "y"], "abc", lambda _: 1)
        refuse = self.assert_refused
        refuse(USAGE, ["found 1", "2 metrics or more"], "compare", "--distances", "t.csv",
               "--metrics", "x")
        refuse(USAGE, ["found 1", "2 metrics or more"], "compare", "--metrics", "rmse")
        refuse(USAGE, ["rmsee"], "compare", "--metrics", "rmse,rmsee")
        refuse(USAGE, ["--metrics", "twice"], "compare", "--metrics", "rmse,rmse")
        refuse(USAGE, ["--distances", "--database"], "compare", "--distances", "t.csv",
               "--database", "db")
        refuse(INPUT, ["t.csv", '"z"'], "compare", "--distances", "t.csv", "--metrics", "x,z")
        (self.work / "bad.csv").write_text("material_a,material_b,x,y\na,b,1,nan\n")
        refuse(INPUT, ["bad.csv, line 2", "nan"], "compare", "--distances", "bad.csv")
        self.compare("--distances", "t.csv")
        refuse(OUTPUT, ["out", "--force"], "compare", "--distances", "t.csv", "--out", "out")

    def test_interrupted(self):
        before = tree(self.work)
        for number in signal.SIGINT, signal.SIGTERM:
            with Running(self, "compare", "--metrics", "rmse,cwcbrt", "--out", "out") as running:
                running.wait_for_partial()
                self.assertIn("interrupted", running.stop(number))
            self.assertEqual(tree(self.work), before)


if __name__ == "__main__":
    support.main()
