"""merl-scan scan --reference: originals, their approximations, and two of them against each other."""

import fractions
import itertools
import random
import struct

import reference
import support
from reference import sign
from support import GRID, INPUT, SUCCESS, USAGE, Case, read_csv, read_json, samples, tree, write_database
from tables import COLUMNS, write_rows

FILES = ["approximations.csv", "approximations.html", "disagreements.csv", "selection.csv", "summary.json"]


def near(numbers, seed, scale):
    """A made-up approximation of a material."""
    noise = random.Random(seed)
    return [x * noise.lognormvariate(0, scale) for x in numbers]


def ranks(values):
    """From 1; those that tie have the mean of theirs."""
    return [sum((other < value) + (other == value) / 2 for other in values) + 0.5 for value in values]


class Expected:
    """All that a scan says, from rows (original, approximation, label, distance ...), the plain way."""

    def __init__(self, rows, labels, select=100, per_material=10):
        self.rows = sorted(rows, key=lambda row: (row[0].encode(), row[2].encode()))
        self.groups = [list(group) for _, group in itertools.groupby(self.rows, lambda row: row[0])]
        self.ranks = []
        for group in self.groups:
            columns = [ranks([row[m] for row in group]) for m in range(3, len(group[0]))]
            self.ranks += [list(of_row) for of_row in zip(*columns)]
        found = []
        for group in self.groups:
            pairs = [(*row[:2], row[3], row[4]) for row in group]
            for left, right, agreement in reference.disagreements(pairs):
                order = sorted(sorted([a.encode(), b.encode()]) for a, b, *_ in (left, right))
                found.append((agreement, order, left, right))
        found.sort(key=lambda one: one[:2])
        self.ranked = [(left, right, agreement) for agreement, _, left, right in found]
        self.chosen = reference.selection(self.ranked, select, per_material)
        self.configurations = sum(len(g) * (len(g) - 1) // 2 for g in self.groups)
        self.labels = labels
        self.complete = [g for g in self.groups if len(g) == len(labels)]

    def best(self, group, metric):
        least = min(row[3 + metric] for row in group)
        return {row[2] for row in group if row[3 + metric] == least}

    def of_label(self, label, metric):
        """Mean rank, how often best, in how many of these by a tie."""
        if not self.complete:
            return None, 0, 0
        rank = {(row[0], row[2]): of_row[metric] for row, of_row in zip(self.rows, self.ranks)}
        mean = sum(fractions.Fraction(rank[g[0][0], label]) for g in self.complete) / len(self.complete)
        best = [self.best(g, metric) for g in self.complete]
        return (float(mean), sum(label in b for b in best), sum(label in b and len(b) > 1 for b in best))

    def hardest(self, metric):
        found = []
        for group in self.complete:
            distance = min(row[3 + metric] for row in group)
            found.append((-distance, group[0][0].encode(), group[0][0], min(self.best(group, metric)), distance))
        return [{"original": o, "best": b, "distance": d} for _, _, o, b, d in sorted(found)[:5]]

    def comparison(self, first, second):
        one = [self.best(g, first) for g in self.groups]
        other = [self.best(g, second) for g in self.groups]
        signs = [(sign(a[3 + first] - b[3 + first]), sign(a[3 + second] - b[3 + second]))
                 for g in self.groups for a, b in itertools.combinations(g, 2)]
        return {"different_best": sum(not a & b for a, b in zip(one, other)),
                "partly_different_best": sum(bool(a & b) and a != b for a, b in zip(one, other)),
                "disagreements": sum(a != b for a, b in signs),
                "counts": {"concordant": sum(a == b != 0 for a, b in signs),
                           "discordant": sum(a * b < 0 for a, b in signs),
                           "tied_in_first_only": sum(a == 0 != b for a, b in signs),
                           "tied_in_second_only": sum(a != 0 == b for a, b in signs),
                           "tied_in_both": sum(a == 0 == b for a, b in signs)}}


def flat(configurations):
    return [[*left[:2], *right[:2], left[2], right[2], left[3], right[3], agreement]
            for left, right, agreement in configurations]


class Reference(Case):
    def reference_scan(self, *options, out="out"):
        results = self.scan(*options, "--quiet", out=out)
        self.assertEqual(sorted(p.name for p in results.iterdir()), FILES)
        return results

    def rows_of(self, results, metrics):
        """The rows of approximations.csv up to the distances."""
        header, rows = read_csv(results / "approximations.csv")
        self.assertEqual(header[:3], ["original", "approximation", "label"])
        self.assertEqual(header[3:3 + 2 * len(metrics)], [*metrics, *(f"{m}_rank" for m in metrics)])
        return [[*row[:3], *map(float, row[3:3 + len(metrics)])] for row in rows]

    def assert_decisions(self, results, metrics, labels, **limits):
        """All of it follows from the distances in approximations.csv."""
        rows = self.rows_of(results, metrics)
        expected = Expected(rows, labels, **limits)
        self.assertEqual(rows, expected.rows)
        _, written = read_csv(results / "approximations.csv")
        self.assertEqual([[float(x) for x in row[3 + len(metrics):3 + 2 * len(metrics)]] for row in written],
                         expected.ranks)
        _, written = read_csv(results / "disagreements.csv")
        self.assertEqual([row[:4] + [float(x) for x in row[4:]] for row in written], flat(expected.ranked))
        _, written = read_csv(results / "selection.csv")
        self.assertEqual([row[:5] + [float(x) for x in row[5:]] for row in written],
                         [[str(n), *row] for n, row in enumerate(flat(expected.chosen), 1)])
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["metrics"], metrics)
        self.assertEqual(summary["configurations"], expected.configurations)
        self.assertEqual(summary["disagreements"], len(expected.ranked))
        self.assertEqual(summary["selection"]["configurations"], len(expected.chosen))
        self.assertEqual(summary["pairs"], len(rows))
        said = summary["reference"]
        self.assertEqual(said["with_all"], len(expected.complete))
        self.assertEqual(said["with_two_or_more"], sum(len(g) > 1 for g in expected.groups))
        self.assertEqual(said["approximations"],
                         {label: sum(row[2] == label for row in rows) for label in labels})
        for m, metric in enumerate(metrics):
            figures = summary["ranks"][m]
            self.assertEqual(figures["metric"], metric)
            self.assertEqual(figures["hardest"], expected.hardest(m))
            for label in labels:
                of_label = figures["labels"][label]
                self.assertEqual((of_label["mean_rank"], of_label["best"], of_label["tied_best"]),
                                 expected.of_label(label, m))
        compared = list(itertools.combinations(range(len(metrics)), 2))
        self.assertEqual([c["metrics"] for c in summary["comparisons"]],
                         [[metrics[i], metrics[j]] for i, j in compared])
        for (i, j), comparison in zip(compared, summary["comparisons"]):
            for key, value in expected.comparison(i, j).items():
                self.assertEqual(comparison[key], value, (metrics[i], metrics[j], key))
        self.assertEqual(summary["counts"], expected.comparison(0, 1)["counts"])
        return summary

    def write_databases(self, originals=9):
        materials = {f"m{i}": samples(i) for i in range(originals)}
        write_database(self.work / "measured", materials)
        for k, scale in enumerate((0.1, 0.11, 0.5, 0.3)):
            write_database(self.work / f"fit{k}",
                           {name: near(numbers, 100 * k + i, scale) for i, (name, numbers) in
                            enumerate(materials.items())})
        self.databases = [x for d in ("measured", "fit0", "fit1", "fit2", "fit3") for x in ("--database", d)]
        return materials

    def test_distances_and_decisions(self):
        """On every metric that an independent program has here, ranks, counts and selection are its own."""
        self.write_databases()
        metrics = ["cwcbrt", "pawcielab", "rmse"]
        results = self.reference_scan(*self.databases, "--reference", "measured", "--metrics", ",".join(metrics))
        labels = ["fit0", "fit1", "fit2", "fit3"]
        summary = self.assert_decisions(results, metrics, labels)
        self.assertTrue(summary["exact"])
        self.assertEqual(summary["undecided"]["configurations"], 0)
        self.assertGreater(summary["disagreements"], 0)
        rows = self.rows_of(results, metrics)
        self.assertEqual(len(rows), 36)
        header, written = read_csv(results / "approximations.csv")
        self.assertEqual(header[9:], [f"{m}_bound" for m in metrics] + [f"{m}_precision" for m in metrics])
        for row in written:
            for bound, precision in zip(row[9:12], row[12:15]):
                self.assertEqual(precision, "float64" if float(bound) == 0 else "float32")
        refined = [sum(row[12 + m] == "float64" for row in written) for m in range(3)]
        self.assertEqual(refined, [summary["refined_distances"][m] for m in metrics])
        mine = []
        for i in range(9):
            planes = [samples(i)]
            for label in labels:
                path = self.work / label / f"m{i}.binary"
                planes.append(list(struct.unpack_from(f"<{3 * support.voxels(GRID)}d", path.read_bytes(), 12)))
            of_metric = [reference.distances(m, planes, GRID)[:4] for m in metrics]
            mine += [[f"measured/m{i}", f"{label}/m{i}", label, *(d[k] for d in of_metric)]
                     for k, label in enumerate(labels)]
        for row, expected in zip(rows, mine):
            self.assertEqual(row[:3], expected[:3])
            for d, e in zip(row[3:], expected[3:]):
                self.assertLess(abs(d / e - 1), 2e-6, row)
        independent = Expected(mine, labels)
        self.assertEqual(summary["disagreements"], len(independent.ranked))
        _, selection = read_csv(results / "selection.csv")
        self.assertEqual([row[1:5] for row in selection], [row[:4] for row in flat(independent.chosen)])
        for row in selection:
            self.assertEqual(row[1], row[3])
            self.assertTrue(row[1].startswith("measured/"))

    def test_the_same_pairs_have_the_same_distances_among_all(self):
        self.write_databases(4)
        results = self.reference_scan(*self.databases, "--reference", "measured")
        everything = self.scan(*self.databases, "--metrics", "cwcbrt,pawcielab", "--fast", out="all")
        _, rows = read_csv(everything / "pairs.csv")
        among_all = {frozenset(row[:2]): list(map(float, row[2:6])) for row in rows}
        header, rows = read_csv(results / "approximations.csv")
        for row in rows:
            for i, metric in enumerate(("cwcbrt", "pawcielab")):
                found = among_all[frozenset(row[:2])]
                distance, bound = (float(row[header.index(metric + end)]) for end in ("", "_bound"))
                self.assertLessEqual(abs(distance - found[i]), bound + found[2 + i])

    def test_the_whole_study(self):
        """From the scan to what votes and a score say of it, each from the files of the one before."""
        self.write_databases()
        self.reference_scan(*self.databases, "--reference", "measured", "--spheres", "0")
        self.assert_success("judge", "--selection", "out/selection.csv", "--size", "16", "--out", "kit")
        kit = read_json(self.work / "kit" / "kit.json")
        self.assertEqual(kit["reference"], "measured")
        self.assertTrue(all(t["left"][0] == t["right"][0] for t in kit["trials"]))
        self.assertEqual({t["kind"] for t in kit["trials"]}, {"selection", "sentinel", "repeat", "random"}
                         - (set() if any(t["kind"] == "random" for t in kit["trials"]) else {"random"}))
        for judge in "ann", "bob":
            write_rows(self.work / f"{judge}.csv", COLUMNS,
                       [[judge, i, t["configuration"], t["kind"], *t["left"], *t["right"], 0, t.get("expected") or 1,
                         900, kit["seed"], kit["kit_hash"]] for i, t in enumerate(kit["trials"], 1)])
        self.assert_success("votes", "ann.csv", "bob.csv", "--selection", "out/selection.csv", "--kit", "kit/kit.json",
                            "--out", "said")
        chosen = [t["left"][1].split("/")[0] for t in kit["trials"] if t["kind"] == "selection"]
        table = read_json(self.work / "said" / "summary.json")["figures"]["selection"]["approximations"]
        self.assertEqual({row["label"]: row["votes"][0] for row in table if row["other"] is None},
                         {label: 2 * chosen.count(label) for label in sorted({t.split("/")[0] for k in kit["trials"]
                          if k["kind"] == "selection" for t in (k["left"][1], k["right"][1])})})
        result = self.run_program("score", "--judgements", "said/judgements.csv", "--metrics", "cwcbrt,pawcielab",
                                  "--out", "score")
        self.assertEqual(result.returncode, SUCCESS, result.stderr)
        self.assertIn("circular", result.stderr)
        # What says that these are originals belongs to the selection.
        (self.work / "alone").mkdir()
        (self.work / "out" / "selection.csv").rename(self.work / "alone" / "selection.csv")
        self.assert_refused(INPUT, ["alone/selection.csv", "scan --reference", "summary.json"], "judge", "--selection",
                            "alone/selection.csv", *self.databases, "--sentinels", "0", "--random", "0")
        # A table of approximations that is not of this scan is refused.
        (self.work / "alone" / "selection.csv").rename(self.work / "out" / "selection.csv")
        with open(self.work / "out" / "approximations.csv", "a", encoding="utf-8") as table:
            table.write("x,y,z\n")
        self.assert_refused(INPUT, ["approximations.csv"], "judge", "--selection", "out/selection.csv", "--out", "again")

    def test_limits(self):
        self.write_databases()
        for select, per_material in (5, 10), (100, 2), (7, 1), (0, 10), (100, 0):
            results = self.reference_scan(*self.databases, "--reference", "measured", "--select", select,
                                          "--per-material", per_material, out=f"{select}-{per_material}")
            self.assert_decisions(results, ["cwcbrt", "pawcielab"], ["fit0", "fit1", "fit2", "fit3"], select=select,
                                  per_material=per_material)
        listed = self.reference_scan(*self.databases, "--reference", "measured", "--disagreements", 3, out="listed")
        full = (self.work / "5-10" / "disagreements.csv").read_text().splitlines()
        self.assertEqual((listed / "disagreements.csv").read_text().splitlines(), full[:4])
        fast = self.reference_scan(*self.databases, "--reference", "measured", "--fast", out="fast")
        summary = read_json(fast / "summary.json")
        self.assertFalse(summary["exact"])
        self.assertEqual(summary["refined_distances"], {"cwcbrt": 0, "pawcielab": 0})

    def write_table(self, originals, labels, metrics, value, lacking=()):
        rows = [[f"org/{o}", f"{label}/{o}", *(value() for _ in metrics)]
                for o in originals for label in labels if (o, label) not in lacking]
        shuffled = random.Random(1).sample(rows, len(rows))
        write_rows(self.work / "t.csv", ["material_a", "material_b", *metrics],
                   [[*(row[1::-1] if i % 2 else row[:2]), *row[2:]] for i, row in enumerate(shuffled)])

    def test_tables(self):
        """With ties, originals that lack approximations, labels on both sides of that of the originals, and
        numbers that are 0."""
        numbers = random.Random(9)
        labels = ["a", "b", "x", "y, \"z\""]
        for case, (least, most) in enumerate(((0, 3), (1, 2), (0, 1000), (0, 0), (5, 40))):
            lacking = {(f"m{i}", numbers.choice(labels)) for i in range(0, 12, 3)}
            self.write_table([f"m{i}" for i in range(12)], labels, ["one", "two", "three"],
                             lambda: numbers.randint(least, most), lacking)
            self.warns = most == 0
            results = self.scan("--distances", "t.csv", "--reference", "org", "--quiet", out=f"out{case}")
            summary = self.assert_decisions(results, ["one", "two", "three"], labels)
            self.assertEqual(summary["reference"]["lacking"],
                             {o: [label for label in labels if (o, label) in lacking]
                              for o in sorted({o for o, _ in lacking})})
            self.assertTrue(summary["exact"])
        header, _ = read_csv(results / "approximations.csv")
        self.assertEqual(len(header), 9)  # no bounds

    def test_what_is_missing_is_said(self):
        write_database(self.work / "org", {"m1": samples(1), "m2": samples(2), "m3": samples(3), "m4": samples(4)})
        write_database(self.work / "a", {"m1": samples(11), "m2": samples(12), "n": samples(13)})
        write_database(self.work / "b", {"m1": samples(21), "m3": samples(22)})
        write_database(self.work / "c", {"p": samples(31)})
        self.warns = True
        databases = [x for d in ("org", "a", "b", "c") for x in ("--database", d)]
        printed = self.run_program("scan", *databases, "--reference", "org", "--out", "out")
        self.assertEqual(printed.stderr, "merl-scan: warning: no material of c is called like one of org\n")
        said = read_json(self.work / "out" / "summary.json")["reference"]
        self.assertEqual(said, {
            "label": "org", "originals": 4, "approximated": 3, "with_two_or_more": 1, "with_all": 1,
            "approximations": {"a": 2, "b": 2},
            "lacking": {"m2": ["b"], "m3": ["a"], "m4": ["a", "b"]},
            "without_original": ["a/n", "c/p"], "unrelated_labels": ["c"]})
        self.assertIn("lacking         3 originals: m2 (no b), m3 (no a), m4 (no a, b)\n", printed.stdout)
        self.assertIn("no original     2 materials: a/n, c/p\n", printed.stdout)
        self.assertIn("originals       4 of org, 1 with all of 2 approximations\n", printed.stdout)

    def test_one_approximation(self):
        write_database(self.work / "org", 3)
        write_database(self.work / "fit", {f"m{i:02}": samples(i + 9) for i in range(3)})
        self.warns = True
        printed = self.run_program("scan", "--database", "org", "--database", "fit", "--reference", "org", "--out",
                                   "out")
        self.assertIn("no configurations: no original has two approximations", printed.stderr)
        self.assertEqual(printed.returncode, 0)
        results = self.work / "out"
        summary = self.assert_decisions(results, ["cwcbrt", "pawcielab"], ["fit"])
        self.assertEqual((summary["configurations"], summary["rate"], summary["strongest_disagreement"]),
                         (0, 0, None))
        self.assertEqual({row[5] for row in read_csv(results / "approximations.csv")[1]}, {"1"})
        self.assertNotIn("different best", printed.stdout)

    def test_what_is_refused(self):
        write_database(self.work / "org", 3)
        write_database(self.work / "other", {"n1": samples(1), "n2": samples(2)})
        write_database(self.work / "fit", 3)

        def refuse(status, words, *options):
            self.assert_refused(status, words, "scan", *options, "--out", "new")

        both = ("--database", "org", "--database", "fit")
        refuse(USAGE, ["--reference", '"og"', "fit, org"], *both, "--reference", "og")
        refuse(USAGE, ["--reference", "no labels", '"m00"', '"org/NAME"'], "--database", "org", "--reference", "org")
        refuse(INPUT, ["--reference", '"org"', "another database"], "--database", "org=org", "--reference", "org")
        refuse(INPUT, ["--reference", "m00, m01, m02", '"other" n1, n2'], "--database", "org", "--database", "other",
               "--reference", "org")
        refuse(USAGE, ["--metrics", "found 1", "2 metrics or more"], *both, "--reference", "org", "--metrics", "rmse")
        write_rows(self.work / "t.csv", ["material_a", "material_b", "x", "y"],
                   [["org/a", "fit/a", 1, 2], ["org/b", "fit/c", 1, 2], ["org/c", "fit/b", 1, 2]])
        refuse(INPUT, ["t.csv", "org/b", "fit/b"], "--distances", "t.csv", "--reference", "org")

    def test_what_comes_after_finds_the_databases_again(self):
        self.write_databases(3)
        results = self.reference_scan(*self.databases, "--reference", "measured")
        before = tree(results)
        self.assert_success("render", "--selection", results / "selection.csv", "--size", 16, "--out", "spheres")
        path = self.work / "fit0" / "m0.binary"
        path.write_bytes(path.read_bytes()[:-1] + b"\x12")
        self.assert_refused(INPUT, ['"fit0/m0"', "not those that were scanned"], "render", "--selection",
                            results / "selection.csv", "--out", "again", "--size", 16)
        self.assertEqual(tree(results), before)

    def test_no_bit_depends_on_threads_or_memory(self):
        self.write_databases(5)
        one = self.reference_scan(*self.databases, "--reference", "measured", "--threads", 1, out="one")
        other = self.reference_scan(*self.databases, "--reference", "measured", "--memory", "64M", out="other")
        for name in FILES[:3]:
            self.assertEqual((one / name).read_bytes(), (other / name).read_bytes())


if __name__ == "__main__":
    support.main()
