"""merl-scan compare: every two metrics of a database or a table."""

import fractions
import itertools
import math
import random
import signal

import reference
import support
from support import INPUT, OUTPUT, USAGE, Case, Running, read_csv, read_json, samples, tree, write_database
from tables import write_rows, write_table

FILES = ["compare.csv", "compare.html", "distances.csv", "summary.json", "triangle.csv"]
TRIANGLE = ["metric", "triples", "violations", "a", "b", "c", "distance_ab", "distance_bc", "distance_ac",
            "ratio", "excess"]


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
            self.assertEqual(bool(metric["fitted"]), metric["name"] in ("gloss-contrast", "window-log"))
        # The others have a degree, which proves it.
        self.assertEqual(self.triangles(results), ["paw-ciede2000"])

    def triangles(self, results):
        """Holds triangle.csv and summary.json to distances.csv; returns the metrics in them."""
        header, pairs = read_csv(results / "distances.csv")
        names = sorted({row[0] for row in pairs} | {row[1] for row in pairs}, key=str.encode)
        columns, rows = read_csv(results / "triangle.csv")
        self.assertEqual(columns, TRIANGLE)
        entries = read_json(results / "summary.json")["triangle_inequality"]
        self.assertEqual([e["metric"] for e in entries], [row[0] for row in rows])
        for row, entry in zip(rows, entries):
            place = header.index(row[0])
            distance = {frozenset(pair[:2]): float(pair[place]) for pair in pairs}
            found = []
            for a, c in itertools.combinations(names, 2):
                for b in names:
                    if b not in (a, c):
                        numbers = [distance[frozenset(p)] for p in ((a, b), (b, c), (a, c))]
                        # As fractions, which round nothing.
                        one, other, whole = map(fractions.Fraction, numbers)
                        found.append(((whole - one - other) / (one + other), [a, b, c], numbers))
            worst = max(found, key=lambda f: f[0])  # the first of equal ones
            self.assertEqual(row[1:6], [str(len(found)), str(sum(f[0] > 0 for f in found)), *worst[1]])
            self.assertEqual([float(field) for field in row[6:9]], worst[2])
            self.assertLess(abs(float(row[9]) / (1 + worst[0]) - 1), 1e-15)
            self.assertLess(abs(float(row[10]) - worst[0]), 1e-15)
            self.assertEqual((entry["triples"], entry["violations"]), tuple(map(int, row[1:3])))
            self.assertEqual([entry["worst"][key] for key in ("a", "b", "c")], row[3:6])
            self.assertEqual([entry["worst"][key] for key in TRIANGLE[6:]], list(map(float, row[6:])))
        return [row[0] for row in rows]

    def test_the_worst_triple_of_a_metric_of_squares(self):
        """A user's metric whose distances are the squares of those of the RMSE."""
        (self.work / "squares.glsl").write_text(
            "vec3 transform(vec3 f, Voxel v) { return f; }\n"
            "float weight(Voxel v) { return 1.0; }\n"
            "float difference(vec3 a, vec3 b) { float d = a.x - b.x; return d * d * d * d; }\n")
        # Grey materials, so that the distance depends on their place on a line: 1, 5, 6 and 10.
        write_database(self.work / "db", {name: [place * 1e3] * (3 * 240) for name, place in
                                          {"one": 1, "five": 5, "six": 6, "ten": 10}.items()})
        results = self.compare("--database", "db", "--metrics", "rmse,squares.glsl")
        self.assertEqual(self.triangles(results), ["squares.glsl"])
        row = dict(zip(TRIANGLE, read_csv(results / "triangle.csv")[1][0]))
        # 81 against 16 + 25; five and six are as near to the middle of one and ten.
        self.assertEqual((row["violations"], row["a"], row["b"], row["c"]), ("4", "one", "five", "ten"))
        self.assertAlmostEqual(float(row["ratio"]), 81 / 41, 5)
        self.assertRegex(self.output, r"(?m)^squares\.glsl  fails in 4 of 12 triples, most by a factor of "
                                      r"1\.976: one \| ten \S+ > \S+ \+ \S+ through five$")

    def test_the_triangle_inequality_of_a_table(self):
        names = ["a", "b,1", "ç", "=d", "e"]
        place = dict(zip(names, (3, 0, 7, 20, 21)))
        rows = [[a, b, (place[a] - place[b]) ** 2, abs(place[a] - place[b]), 0]
                for a, b in itertools.combinations(names, 2)]
        write_rows(self.work / "t.csv", ["material_1", "material_2", "rmse", "line", "zero"], rows)
        self.output = self.run_program("compare", "--distances", "t.csv", "--out", "out").stdout
        results = self.work / "out"
        header, found = read_csv(results / "triangle.csv")
        # Of a table nothing is known, whatever its columns are called.
        self.assertEqual([row[:3] for row in found],
                         [["rmse", "30", "10"], ["line", "30", "0"], ["zero", "30", "0"]])
        # 7 is nearest to the middle of 0, 7 and 20 (1.84), of 0, 7 and 21 (1.8), and 3 of 0, 3, 7 (1.96).
        self.assertEqual(found[0][3:], ["b,1", "a", "ç", "9", "16", "49", "1.96", "0.96"])
        self.assertEqual(found[1][3:], ["=d", "ç", "a", "13", "4", "17", "1", "0"])
        self.assertEqual(found[2][3:], [""] * 8)
        entries = read_json(results / "summary.json")["triangle_inequality"]
        self.assertEqual(entries[0]["worst"]["ratio"], 1.96)
        self.assertIsNone(entries[2]["worst"])
        for line in (r"rmse  fails in 10 of 30 triples, most by a factor of 1\.96: b,1 \| ç 49 > 9 \+ 16 through a",
                     r"line  holds in all of 30 triples, at most 1 of what it allows: .*",
                     r"zero  holds in all of 30 triples"):
            self.assertRegex(self.output, f"(?m)^{line}$")

    def test_a_distance_beside_two_zeros(self):
        write_rows(self.work / "t.csv", ["material_1", "material_2", "x", "y"],
                   [["a", "b", 0, 1], ["a", "c", 3, 1], ["b", "c", 0, 1]])
        results = self.compare("--distances", "t.csv")
        self.assertEqual(read_csv(results / "triangle.csv")[1][0],
                         ["x", "3", "1", "a", "b", "c", "0", "0", "3", "inf", "inf"])
        entry = read_json(results / "summary.json")["triangle_inequality"][0]
        self.assertEqual((entry["worst"]["ratio"], entry["worst"]["excess"]), ("inf", "inf"))

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
        for name in "distances.csv", "compare.csv", "triangle.csv":
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
        (self.work / "bad.csv").write_text("material_1,material_2,x,y\na,b,1,nan\n")
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
