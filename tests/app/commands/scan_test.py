"""merl-scan scan on databases that it can use: what it computes, writes and prints."""

import decimal
import math
import re
import shutil

import reference
import support
from support import GRID, Case, read_csv, read_json, samples, tree, write_database

CONFIGURATION = ["left_1", "left_2", "right_1", "right_2"]
HEADER = CONFIGURATION + [
    "cwcbrt_left", "cwcbrt_right", "pawcielab_left", "pawcielab_right", "agreement",
]


def pairs_header(first, second):
    return ["material_1", "material_2", first, second, f"{first}_bound", f"{second}_bound",
            f"{first}_precision", f"{second}_precision"]


def pairs_of(results):
    """The rows of pairs.csv as (name, name, d1, d2)."""
    return [(*row[:2], float(row[2]), float(row[3])) for row in read_csv(results / "pairs.csv")[1]]


def precisions_of(results):
    """By metric, what pairs.csv says of its distances; checks that it says so of the bounds too."""
    header, rows = read_csv(results / "pairs.csv")
    result = {}
    for column in 2, 3:
        result[header[column]] = [row[column + 4] for row in rows]
        for row in rows:
            bound = float(row[column + 2])
            assert (bound > 0, row[column + 4]) in ((True, "float32"), (False, "float64")), row
    return result


def flat(configurations):
    """Configurations as the rows of disagreements.csv have them, numbers as numbers."""
    return [
        [*left[:2], *right[:2], left[2], right[2], left[3], right[3], agreement]
        for left, right, agreement in configurations
    ]


def numbers_in(rows, first):
    """Rows with the fields from `first` on as numbers."""
    return [row[:first] + [float(x) for x in row[first:]] for row in rows]


class ScanCase(Case):
    def assert_distances(self, results, metrics, materials, grid=GRID):
        pairs = pairs_of(results)
        for column, metric in enumerate(metrics, start=2):
            expected = reference.distances(metric, materials, grid)
            self.assertEqual(len(pairs), len(expected))
            for pair, distance in zip(pairs, expected):
                self.assertLess(abs(pair[column] / distance - 1), 2e-6, (metric, pair, distance))

    def assert_decisions(self, results, select=100, per_material=10):
        """disagreements.csv, selection.csv and summary.json follow from pairs.csv."""
        pairs = pairs_of(results)
        ranked = reference.disagreements(pairs)
        written = numbers_in(read_csv(results / "disagreements.csv")[1], 4)
        self.assertEqual(written, flat(ranked))
        chosen = flat(reference.selection(ranked, select, per_material))
        written = numbers_in(read_csv(results / "selection.csv")[1], 5)
        self.assertEqual(written, [[str(n), *row] for n, row in enumerate(chosen, start=1)])
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["pairs"], len(pairs))
        self.assertEqual(summary["configurations"], len(pairs) * (len(pairs) - 1) // 2)
        self.assertEqual(summary["disagreements"], len(ranked))
        self.assertEqual(summary["disagreements_written"], len(ranked))
        self.assertEqual(summary["selection"]["configurations"], len(chosen))
        return summary


class Scan(ScanCase):
    def test_thirteen_materials(self):
        database = write_database(self.work / "db", 13)
        results = self.scan("--database", "db", "--quiet")
        self.assertEqual(sorted(p.name for p in results.iterdir()), support.RESULTS)

        header, rows = read_csv(results / "pairs.csv")
        self.assertEqual(header, pairs_header("cwcbrt", "pawcielab"))
        names = sorted(p.stem for p in database.iterdir())
        expected = [[a, b] for i, a in enumerate(names) for b in names[i + 1 :]]
        self.assertEqual([row[:2] for row in rows], expected)
        self.assertEqual(read_csv(results / "disagreements.csv")[0], HEADER)
        self.assertEqual(read_csv(results / "selection.csv")[0], ["rank", *HEADER])
        for file in results.glob("*.csv"):
            self.assertNotIn(b"\r", file.read_bytes())

        self.assert_distances(results, ["cwcbrt", "pawcielab"], [samples(i) for i in range(13)])
        summary = self.assert_decisions(results)
        self.assertEqual(summary["materials"], 13)
        self.assertEqual((summary["pairs"], summary["configurations"]), (78, 3003))
        self.assertEqual(summary["rate"], summary["disagreements"] / 3003)
        self.assertEqual(summary["metrics"], ["cwcbrt", "pawcielab"])

    def test_the_other_metrics_name_and_fill_the_columns(self):
        write_database(self.work / "db", 5)
        results = self.scan("--database", "db", "--metrics", "rmse,cosine-rmse")
        header, _ = read_csv(results / "pairs.csv")
        self.assertEqual(header, pairs_header("rmse", "cosine-rmse"))
        columns = ["rmse_left", "rmse_right", "cosine-rmse_left", "cosine-rmse_right", "agreement"]
        header, _ = read_csv(results / "disagreements.csv")
        self.assertEqual(header, CONFIGURATION + columns)
        header, _ = read_csv(results / "selection.csv")
        self.assertEqual(header, ["rank", *CONFIGURATION, *columns])
        self.assert_distances(results, ["rmse", "cosine-rmse"], [samples(i) for i in range(5)])
        self.assert_decisions(results)

    def test_the_first_metric_orients(self):
        write_database(self.work / "db", 5)
        for metrics in "rmse,pawcielab", "pawcielab,rmse":
            results = self.scan("--database", "db", "--metrics", metrics, out=metrics)
            self.assertEqual(read_json(results / "summary.json")["metrics"], metrics.split(","))
            self.assert_decisions(results)

    def test_several_blocks(self):
        grid = (30, 30, 40)
        materials = {f"m{i}": samples(i, grid) for i in range(3)}
        write_database(self.work / "db", materials, grid)
        results = self.scan("--database", "db")
        self.assert_distances(results, ["cwcbrt", "pawcielab"], materials.values(), grid)

    def test_awkward_grids(self):
        for grid in (1, 1, 1), (7, 5, 3), (1, 1, 1025), (2, 41, 25):
            materials = {f"m{i}": samples(i, grid) for i in range(3)}
            name = "x".join(map(str, grid))
            write_database(self.work / name, materials, grid)
            results = self.scan("--database", name, out=f"of-{name}")
            self.assert_distances(results, ["cwcbrt", "pawcielab"], materials.values(), grid)

    def test_two_materials_have_one_pair_and_no_configuration(self):
        write_database(self.work / "db", 2)
        output = self.assert_success("scan", "--database", "db", "--out", "out")
        self.assertRegex(output, r"(?m)^configurations +0$")
        summary = self.assert_decisions(self.work / "out")
        self.assertEqual((summary["pairs"], summary["configurations"]), (1, 0))
        self.assertEqual((summary["disagreements"], summary["rate"]), (0, 0))

    def test_identical_materials_tie_exactly(self):
        self.warns = True
        materials = {"a": samples(0), "b": samples(0), "c": samples(0)}
        materials.update({f"m{i}": samples(i) for i in range(1, 11)})
        write_database(self.work / "db", materials)
        results = self.scan("--database", "db")
        distance = {row[:2]: row[2:] for row in pairs_of(results)}
        self.assertEqual(distance["a", "b"], (0, 0))
        for name in materials:
            if name.startswith("m"):
                self.assertEqual(distance["a", name], distance["b", name])
        summary = self.assert_decisions(results)
        # Among the three pairs that are zero, and among the three that each other material has.
        self.assertEqual(summary["counts"]["tied_in_both"], 3 + 10 * 3)

    def test_nothing_but_identical_materials(self):
        self.warns = True
        write_database(self.work / "db", {name: samples(0) for name in "abcde"})
        summary = self.assert_decisions(self.scan("--database", "db"))
        self.assertEqual((summary["disagreements"], summary["rate"]), (0, 0))
        self.assertIsNone(summary["strongest_disagreement"])

    def test_dark_materials(self):
        materials = {f"m{i}": [x * 1e-4 for x in samples(i)] for i in range(5)}
        write_database(self.work / "db", materials)
        results = self.scan("--database", "db")
        self.assert_distances(results, ["cwcbrt", "pawcielab"], materials.values())

    def test_near_duplicates_are_off_by_no_more_than_float32_samples(self):
        one = samples(0)
        other = [x * (1 + 1e-5 * math.sin(k)) for k, x in enumerate(one)]
        write_database(self.work / "db", {"a": one, "b": other})
        results = self.scan("--database", "db", "--metrics", "rmse,cosine-rmse")
        black = [0] * len(one)
        for metric, actual in zip(["rmse", "cosine-rmse"], pairs_of(results)[0][2:]):
            expected, magnitude, _ = reference.distances(metric, [one, other, black], GRID)
            # Half a unit in the last place of every sample of both, by the triangle inequality.
            self.assertLess(abs(actual - expected), 2 * 2**-24 * magnitude + 2e-6 * expected)


class Negatives(ScanCase):
    def test_they_count_as_zero_and_are_counted(self):
        count = support.voxels(GRID)
        visited = reference.above_horizon(GRID)
        below = sorted(set(range(count)) - set(visited))
        materials = {f"m{i}": samples(i) for i in range(4)}
        for plane in range(3):  # a whole triple
            materials["m1"][plane * count + visited[0]] = -1
        materials["m2"][count + visited[5]] = -1e-9  # one channel
        materials["m2"][2 * count + visited[-1]] = -3e5
        for voxel in below[:10]:
            materials["m3"][voxel] = -1
        write_database(self.work / "db", materials)
        results = self.scan("--database", "db")
        self.assert_distances(results, ["cwcbrt", "pawcielab"], materials.values())
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["negative_samples"], {"m0": 0, "m1": 1, "m2": 2, "m3": 10})
        self.assertEqual(summary["negative_samples_above_horizon"],
                         {"m0": 0, "m1": 1, "m2": 2, "m3": 0})
        self.assertEqual(summary["samples_per_material"], count)
        self.assertEqual(summary["samples_above_horizon"], len(visited))

    def test_what_is_below_the_horizon_does_not_matter(self):
        visited = set(reference.above_horizon(GRID))
        materials = {f"m{i}": samples(i) for i in range(3)}
        write_database(self.work / "db", materials)
        before = (self.scan("--database", "db") / "pairs.csv").read_bytes()
        for numbers in materials.values():
            for index in range(len(numbers)):
                if index % support.voxels(GRID) not in visited:
                    numbers[index] = -1.0 if index % 2 else 1e9
        write_database(self.work / "other", materials)
        after = (self.scan("--database", "other", out="after") / "pairs.csv").read_bytes()
        self.assertEqual(before, after)


class Options(ScanCase):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 13)

    def test_disagreements_keeps_the_strongest(self):
        all_of_them = read_csv(self.scan("--database", "db") / "disagreements.csv")[1]
        for number in 0, 1, 7, len(all_of_them), len(all_of_them) + 1:
            results = self.scan("--database", "db", "--disagreements", number, out=f"out{number}")
            header, rows = read_csv(results / "disagreements.csv")
            self.assertEqual(header, HEADER)
            self.assertEqual(rows, all_of_them[:number])
            summary = read_json(results / "summary.json")
            self.assertEqual(summary["disagreements"], len(all_of_them))
            self.assertEqual(summary["disagreements_written"], len(rows))

    def test_select_and_per_material(self):
        for select, per_material in (0, 10), (3, 10), (100, 0), (100, 1), (20, 3), (5000, 5000):
            results = self.scan("--database", "db", "--select", select, "--per-material",
                                per_material, out=f"out{select}-{per_material}")
            options = self.assert_decisions(results, select, per_material)["options"]
            self.assertEqual((options["select"], options["per_material"]), (select, per_material))

    def test_quiet_prints_nothing(self):
        self.assertEqual(self.assert_success("scan", "--database", "db", "--quiet"), "")
        self.assertTrue((self.work / "merl-scan-results").is_dir())  # the documented default

    def test_a_large_database_is_refused_all_its_disagreements(self):
        write_database(self.work / "large", {f"m{i}": samples(i, (2, 1, 1)) for i in range(400)},
                       (2, 1, 1))
        self.assert_refused(support.USAGE, ["disagreements", "--disagreements"],
                            "scan", "--database", "large")
        self.scan("--database", "large", "--disagreements", 5)


class Summary(ScanCase):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 13)
        self.output = self.assert_success("scan", "--database", "db", "--out", "out")
        self.summary = read_json(self.work / "out" / "summary.json")

    def printed(self, name):
        (line,) = [line for line in self.output.splitlines() if line.startswith(name)]
        return line.removeprefix(name).strip()

    def test_what_is_printed(self):
        s = self.summary
        self.assertIn("db", self.printed("database"))
        self.assertIn("MERL directory", self.printed("database"))
        self.assertTrue(self.printed("materials").startswith("13,"))
        self.assertEqual(self.printed("pairs"), "78")
        self.assertEqual(self.printed("configurations"), "3,003")
        self.assertEqual(self.printed("disagreements"),
                         f"{s['disagreements']:,} ({100 * s['rate']:.2f} %)")
        strongest = s["strongest_disagreement"]
        for name in *strongest["left"], *strongest["right"], f"{strongest['agreement']:.6f}":
            self.assertIn(name, self.printed("strongest"))
        first, last = s["selection"]["agreement_range"]
        self.assertIn(f"{first:.6f} to {last:.6f}", self.printed("selection"))
        self.assertIn("host", self.printed("engine"))
        for stage in "device", "distances", "refine", "count", "select", "list", "write":
            self.assertIn(stage, self.printed("seconds"))
        self.assertEqual(self.printed("results"), "out")

    def test_what_a_machine_reads(self):
        s = self.summary
        ranked = reference.disagreements(pairs_of(self.work / "out"))
        left, right, agreement = ranked[0]
        self.assertEqual(s["strongest_disagreement"],
                         {"left": list(left[:2]), "right": list(right[:2]), "agreement": agreement})
        chosen = reference.selection(ranked, 100, 10)
        self.assertEqual(s["selection"]["agreement_range"], [chosen[0][2], chosen[-1][2]])
        self.assertEqual(s["program"]["name"], "merl-scan")
        self.assertRegex(s["program"]["version"], r"^\d+\.\d+\.\d+$")
        self.assertEqual((s["database"]["name"], s["database"]["kind"]), ("db", "MERL directory"))
        (use,) = s["engines"]
        self.assertEqual((use["engine"], use["metrics"]), ("host", ["cwcbrt", "pawcielab"]))
        self.assertGreater(use["peak_bytes"], 0)
        self.assertRegex(s["database"]["content_hash"], r"^[0-9a-f]{32}$")
        self.assertEqual(list(s["database"]["grid"].values()), [*GRID, "pi"])
        self.assertEqual(list(s["negative_samples"].values()), [0] * 13)
        self.assertEqual(s["options"]["disagreements"], "all")
        self.assertEqual(s["options"]["memory_bytes"], 2**30)
        stages = dict(s["seconds"])
        total = stages.pop("total")
        self.assertEqual(
            set(stages),
            {"device", "distances", "refine", "count", "select", "list", "write"})
        self.assertTrue(math.isclose(total, sum(stages.values())), s["seconds"])

    def test_refinement(self):
        s = self.summary
        self.assertIs(s["exact"], True)
        refined = s["refined_distances"]
        self.assertRegex(
            self.printed("refined"),
            rf"^{refined['cwcbrt']} \+ {refined['pawcielab']} distances in float64; "
            rf"{s['undecided_in_float32']:,} configurations ")
        precisions = precisions_of(self.work / "out")
        self.assertEqual({m: p.count("float64") for m, p in precisions.items()}, refined)
        # Both distances of a pair that is selected, and those few others that are too close.
        selected = {pair for row in read_csv(self.work / "out" / "selection.csv")[1]
                    for pair in ((row[1], row[2]), (row[3], row[4]))}
        for metric in precisions:
            exact = {pair[:2] for pair, precision in zip(pairs_of(self.work / "out"),
                                                         precisions[metric])
                     if precision == "float64"}
            self.assertLessEqual(selected, exact)

    def test_fast(self):
        output = self.assert_success("scan", "--database", "db", "--out", "fast", "--fast",
                                     "--select", 3)
        s = read_json(self.work / "fast" / "summary.json")
        self.assertEqual(s["undecided_in_float32"], self.summary["undecided_in_float32"])
        between = s["disagreements_between"]
        self.assertLessEqual(between["least"], self.summary["disagreements"])
        self.assertGreaterEqual(between["greatest"], self.summary["disagreements"])
        undecided = s["undecided"]["configurations"]
        self.assertEqual(between["greatest"] - between["least"], undecided)
        self.assertEqual((s["exact"], s["exact_selection"]), (undecided == 0, True))
        self.assertEqual(read_csv(self.work / "fast" / "selection.csv")[1],
                         read_csv(self.work / "out" / "selection.csv")[1][:3])
        # Both distances of the six pairs, and few others.
        precisions = precisions_of(self.work / "fast")
        self.assertEqual({m: p.count("float64") for m, p in precisions.items()},
                         s["refined_distances"])
        for metric, refined in s["refined_distances"].items():
            self.assertLess(refined, self.summary["refined_distances"][metric])
        self.assertRegex(output, r"(?m)^refined +\d+ \+ \d+ distances in float64")

    def test_counts_add_up(self):
        counts = dict(self.summary["counts"])
        self.assertIn("streaming", counts.pop("counted_by"))
        self.assertEqual(sum(counts.values()), self.summary["configurations"])


class Names(ScanCase):
    NAMES = ["a b", " ", "comma,comma", 'say "x"', '"', "\u6771\u4eac-\u00e9", "two\nlines", "cr\r",
             "=1+1", "x.y", "-", "tab\t", "it's", "\\", "\x1b[31m"]

    def test_names_are_data(self):
        write_database(self.work / "db", {n: samples(i) for i, n in enumerate(self.NAMES)})
        results = self.scan("--database", "db")
        names = sorted(self.NAMES, key=lambda n: n.encode())
        pairs = pairs_of(results)
        self.assertEqual([p[:2] for p in pairs],
                         [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]])
        summary = self.assert_decisions(results)
        self.assertEqual(list(summary["negative_samples"]), names)
        quoted = (results / "pairs.csv").read_bytes()
        self.assertIn(b'"say ""x"""', quoted)
        self.assertIn(b'"comma,comma"', quoted)
        self.assertIn(b'"two\nlines"', quoted)

    def test_names_do_nothing_to_a_terminal(self):
        write_database(self.work / "\x1b[2Jdb", {f"{i}\x1b[31m\n": samples(i) for i in range(5)})
        output = self.assert_success("scan", "--database", "\x1b[2Jdb", "--out", "out\x1b[m")
        self.assertIn(r"\x1b[31m\x0a | ", output)
        self.assertIn(r"\x1b[2Jdb", output)
        self.assertIn(r"out\x1b[m", output)
        self.assertNotIn("\x1b", output)

    def test_bytewise_order_without_the_extension(self):
        names = ["chrome-steel", "chrome", "Chrome", "chrome.x", "chromeX"]
        write_database(self.work / "db", {n: samples(i) for i, n in enumerate(names)})
        (self.work / "db" / "chromeX.binary").rename(self.work / "db" / "chromeX.BINARY")
        (self.work / "db" / "notes.txt").write_text("not a material")
        (self.work / "db" / ".hidden.binary").write_text("neither")
        pairs = pairs_of(self.scan("--database", "db"))
        expected = ["chrome", "chrome-steel", "chrome.x", "chromeX"]
        self.assertEqual([pair[1] for pair in pairs[:4]], expected)

    def test_names_that_are_no_utf8(self):
        names = ["a\\xff", "a\udcfe", "a\udcff", "b\u00e9\udced\udca0\udc80"]
        write_database(self.work / "db", {n: samples(i) for i, n in enumerate(names)})
        results = self.scan("--database", "db")
        self.assertEqual([p[:2] for p in pairs_of(results)],
                         [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]])
        self.assertEqual(
            list(read_json(results / "summary.json")["negative_samples"]),
            [r"a\x5cxff", r"a\xfe", r"a\xff", "b\u00e9" + r"\xed\xa0\x80"])


class Exact(ScanCase):
    """What float32 cannot tell apart is decided in float64, on every device and however the work is
    cut."""

    METRICS = ["cwcbrt", "pawcielab"]
    warns = True  # of black materials and copies

    @staticmethod
    def adversaries(grid):
        base = samples(0, grid)
        count = len(base)
        per_steradian = [c for c in reference.SCALE for _ in range(count // 3)]
        return {
            "base": base,
            "base-copy": list(base),
            "base-near": [x * (1 + 1e-9 * math.sin(k)) for k, x in enumerate(base)],
            "base-nearest": [math.nextafter(x, math.inf) for x in base],
            "black": [0.0] * count,
            "black-negative": [-x for x in base],
            "blinding": [1e6 / scale for scale in per_steradian],
            "dark": [1e-8 / scale for scale in per_steradian],
            "dark-nearest": [math.nextafter(1e-8 / scale, 1) for scale in per_steradian],
            "other": samples(1, grid),
            "other-copy": samples(1, grid),
            **{f"plain{i}": samples(i, grid) for i in range(2, 10)},
        }

    def truth(self, materials, grid=GRID):
        """The pairs of a database, when every distance is refined on which a disagreement rests."""
        write_database(self.work / "db", materials, grid)
        results = self.scan("--database", "db", "--select", 100000, "--per-material", 100000,
                            out="truth")
        summary = self.assert_decisions(results, 100000, 100000)
        pairs = pairs_of(results)
        listed = {pair for row in read_csv(results / "selection.csv")[1]
                  for pair in ((row[1], row[2]), (row[3], row[4]))}
        self.assertEqual(summary["selection"]["configurations"], summary["disagreements"])
        for precisions in precisions_of(results).values():
            exact = {pair[:2] for pair, p in zip(pairs, precisions) if p == "float64"}
            self.assertLessEqual(listed, exact)
        return pairs

    def test_distances_are_in_the_order_of_float64(self):
        materials = self.adversaries(GRID)
        pairs = self.truth(materials)
        for column, metric in enumerate(self.METRICS, start=2):
            ranges = []
            expected = reference.distances(metric, materials.values(), GRID)
            for pair, distance in zip(pairs, expected):
                kinds = {name.split("-")[0] for name in pair[:2]}
                # Nothing but the rounding of samples is left of the nearest of all.
                alike = len(kinds) == 1 and "copy" not in pair[0] + pair[1]
                if kinds == {"black"} or (alike and "nearest" in pair[0] + pair[1]):
                    low, high = 0, 10 * distance
                elif alike:
                    low, high = distance * (1 - 1e-5), distance * (1 + 1e-5)
                else:
                    low, high = distance * (1 - 1e-11), distance * (1 + 1e-11)
                ranges.append((low, high, pair))
            for k, (low, _, one) in enumerate(ranges):
                for _, high, other in ranges[:k] + ranges[k + 1 :]:
                    if low > high:
                        self.assertGreater(one[column], other[column], (metric, one, other))

    def test_copies_tie(self):
        materials = self.adversaries(GRID)
        distance = {frozenset(pair[:2]): pair[2:] for pair in self.truth(materials)}
        copies = ("base", "base-copy"), ("other", "other-copy"), ("black", "black-negative")
        for one, copy in copies:
            self.assertEqual(distance[frozenset((one, copy))], (0, 0))
            for name in set(materials) - {one, copy}:
                self.assertEqual(distance[frozenset((one, name))],
                                 distance[frozenset((copy, name))], (one, name))
        for near in "base-near", "base-nearest":
            self.assertGreater(distance[frozenset(("base", near))][0], 0)

    def test_same_decisions_on_every_device(self):
        grid = (16, 16, 40)  # several blocks of 1024 voxels above the horizon
        truth = reference.disagreements(self.truth(self.adversaries(grid), grid))
        chosen = flat(reference.selection(truth, 20, 5))
        options = ["--database", "db", "--select", 20, "--per-material", 5, "--disagreements", 0,
                   "--quiet"]
        refusal = self.run_program("scan", "--database", "db", "--memory", 1).stderr
        least = int(re.search(r"\((\d+) bytes\)", refusal)[1])
        runs = [([], {})]
        runs += [(["--threads", n], {"LP_NUM_THREADS": str(n)}) for n in (1, 2)]
        runs += [(["--memory", memory], {}) for memory in (least, 3 * least)]
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            widths = [128, 256] + ([512] if "avx512f" in file.read() else [])
        runs += [([], {"LP_NATIVE_VECTOR_WIDTH": str(width)}) for width in widths]
        selection = None
        slabs = set()
        for number, (more, environment) in enumerate(runs):
            with self.subTest(options=more, environment=environment):
                out = f"run{number}"
                self.assert_success("scan", "--out", out, *options, *more, **environment)
                results = self.work / out
                summary = read_json(results / "summary.json")
                self.assertEqual(summary["disagreements"], len(truth))
                for metric, precisions in precisions_of(results).items():
                    self.assertEqual(set(precisions), {"float32", "float64"}, metric)
                slabs.add(summary["slabs"])
                selection = selection or (results / "selection.csv").read_bytes()
                self.assertEqual((results / "selection.csv").read_bytes(), selection)
                rows = numbers_in(read_csv(results / "selection.csv")[1], 5)
                self.assertEqual(rows, [[str(n), *row] for n, row in enumerate(chosen, start=1)])
        self.assertGreater(len(slabs), 1)

    def test_fast_says_what_it_leaves_open(self):
        write_database(self.work / "db", self.adversaries(GRID))
        summaries = [read_json(self.scan("--database", "db", *options, out=out) / "summary.json")
                     for out, *options in (["exact", "--select", 4],
                                           ["fast", "--fast", "--select", 4])]
        self.assertEqual([s["exact"] for s in summaries], [True, False])
        exact, fast = summaries
        self.assertGreater(fast["undecided_in_float32"], 100)
        self.assertEqual(fast["undecided_in_float32"], exact["undecided_in_float32"])
        least, greatest = fast["disagreements_between"].values()
        self.assertLess(least, greatest)
        for count in exact["disagreements"], fast["disagreements"]:
            self.assertLessEqual(least, count)
            self.assertGreaterEqual(greatest, count)
        self.assertEqual(fast["undecided"]["configurations"], greatest - least)
        self.assertEqual(exact["disagreements_between"],
                         dict.fromkeys(("least", "greatest"), exact["disagreements"]))
        self.assertIs(fast["exact_selection"], True)
        selections = [(self.work / out / "selection.csv").read_bytes() for out in ("exact", "fast")]
        self.assertEqual(*selections)


class Range(ScanCase):
    """Samples of any size that float64 has: what is called float64 is as good as float64 can be,
    and the bounds of the others hold."""

    GRID = (4, 3, 5)

    def compared(self, scales, metrics, out):
        """Scans materials of these sizes; checks the distances; returns the exact pairs."""
        materials = {f"m{i:02}": [x * scale for x in samples(i, self.GRID)]
                     for i, scale in enumerate(scales)}
        if not (self.work / out).exists():
            write_database(self.work / out, materials, self.GRID)
        results = self.scan("--database", out, "--metrics", ",".join(metrics), "--quiet",
                            out=f"{out}-{metrics[0]}")
        _, rows = read_csv(results / "pairs.csv")
        exact = [reference.exact_distances(metric, materials.values(), self.GRID)
                 for metric in metrics]
        for row, *distances in zip(rows, *exact, strict=True):
            for column, distance in enumerate(distances):
                found, bound = (decimal.Decimal(row[i]) for i in (2 + column, 4 + column))
                allowed = bound + distance * decimal.Decimal("1e-13")
                self.assertLessEqual(abs(found - distance), allowed, (metrics[column], row))
        written = reference.disagreements([(*row[:2], *map(decimal.Decimal, row[2:4]))
                                           for row in rows])
        listed = read_csv(results / "disagreements.csv")[1]
        self.assertEqual(sorted(row[:4] for row in listed),
                         sorted([*left[:2], *right[:2]] for left, right, _ in written))
        return results, [(*row[:2], *distances) for row, *distances in zip(rows, *exact)]

    def test_tiny(self):
        for exponent in 20, 30, 35, 37, 40, 100, 160, 200, 300:
            for metrics in ("cwcbrt", "pawcielab"), ("rmse", "cosine-rmse"):
                with self.subTest(exponent=exponent, metrics=metrics):
                    scales = [10.0**-exponent * (1 + i / 8) for i in range(6)]
                    results, pairs = self.compared(scales, metrics, f"tiny{exponent}")
                    ranked = reference.disagreements(pairs)
                    chosen = reference.selection(ranked, 100, 10)
                    rows = read_csv(results / "selection.csv")[1]
                    self.assertEqual([row[1:5] for row in rows],
                                     [[*left[:2], *right[:2]] for left, right, _ in chosen])
                    self.assertEqual(read_json(results / "summary.json")["disagreements"],
                                     len(ranked))
                    # Of the smallest float32 knows nothing.
                    for precisions in precisions_of(results).values():
                        self.assertIn("float64", precisions)
                        if exponent >= 35:
                            self.assertEqual(set(precisions), {"float64"})

    def test_tiny_and_huge_together(self):
        scales = [1e-300, 2e-300, 1e-200, 1e-160, 1e-35, 1e-37, 1e-20, 1, 2, 1e9]
        for metrics in ("cwcbrt", "rmse"), ("rmse", "cosine-rmse"):
            self.compared(scales, metrics, "mixed")
        self.compared(scales[:-3], ("cwcbrt", "pawcielab"), "dark")


class SameNumbers(ScanCase):
    """Results do not depend on how the work was cut."""

    GRID = (30, 30, 40)  # about 27 blocks of 1024 voxels above the horizon

    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 4, self.GRID)
        self.first = self.scan("--database", "db", "--threads", 1)

    def assert_same(self, *options, out):
        results = self.scan("--database", "db", *options, out=out)
        for table in "pairs.csv", "selection.csv", "disagreements.csv":
            self.assertEqual((results / table).read_bytes(), (self.first / table).read_bytes())
        summary = read_json(results / "summary.json")
        first = read_json(self.first / "summary.json")
        self.assertEqual(summary["database"], first["database"])
        return summary

    def test_threads(self):
        self.assert_same("--threads", 2, out="two")
        self.assertEqual(self.assert_same("--threads", 7, out="seven")["options"]["threads"], 7)

    def test_memory(self):
        slabs = set()
        refusal = self.run_program("scan", "--database", "db", "--memory", 1).stderr
        least = int(re.search(r"\((\d+) bytes\)", refusal)[1])
        for memory in least, f"{2 * least // 1024 + 1}k", 5 * least, "8M", "64MB", "4G":
            summary = self.assert_same("--memory", memory, out=f"memory-{memory}")
            (use,) = summary["engines"]
            slabs.add(summary["slabs"])
            self.assertLessEqual(use["peak_bytes"], summary["options"]["memory_bytes"])
        self.assertGreaterEqual(len(slabs), 3, slabs)

    def test_refining_in_pieces(self):
        """A quarter of the memory is for what is asked for at a time: no bit depends on how much that is."""
        found = []
        for memory in "1M", "1G":
            out = self.scan("--database", "blends:300", "--grid", "6x6x12", "--device", "host", "--memory", memory,
                            "--disagreements", 0, out=memory)
            refined = sum(read_json(out / "summary.json")["refined_distances"].values())
            self.assertGreater(refined, 3 * 2**18 // 80)  # three pieces of 1M
            found.append((refined, [(out / name).read_bytes() for name in ("pairs.csv", "selection.csv")]))
        self.assertEqual(found[0], found[1])

    def test_content_hash(self):
        def content_hash(directory):
            results = self.scan("--database", directory, "--force", out="again")
            return read_json(results / "summary.json")["database"]["content_hash"]

        expected = content_hash("db")
        shutil.copytree(self.work / "db", self.work / "copy")
        self.assertEqual(content_hash("copy"), expected)
        file = self.work / "copy" / "m02.binary"
        data = bytearray(file.read_bytes())
        data[-8] ^= 1  # the last bit of the last number, which is below the horizon
        file.write_bytes(data)
        self.assertNotEqual(content_hash("copy"), expected)

    def test_the_database_is_only_read(self):
        before = tree(self.work / "db")
        self.scan("--database", "db", out="again")
        self.assertEqual(tree(self.work / "db"), before)


if __name__ == "__main__":
    support.main()
