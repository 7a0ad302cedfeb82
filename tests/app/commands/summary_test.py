"""Summary metrics on the command line: of the library, and files of a user's own."""

import pathlib

import support
from support import INPUT, Case, read_csv, read_json, write_database

GRID = (24, 12, 24)  # enough layers of theta_h for the windows of gloss-contrast

HEADER = """// title: Mean green
// window: whole all of it
// features: 1
"""
WINDOW = "float window(int w, Voxel v) { return 1.0; }\n"
FEATURE = "float feature(int i, Means m) { return m.rgb[whole].y; }\n"


class Summary(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 6, GRID)

    def pairs(self, metrics, *options, out="out"):
        """The rows of a scan, and its summary."""
        results = self.scan("--database", "db", "--metrics", metrics, "--force", *options, out=out)
        return read_csv(results / "pairs.csv")[1], read_json(results / "summary.json")

    def copy_of_the_library(self):
        text = self.assert_success("metrics", "show", "gloss-contrast")
        (self.work / "mine.glsl").write_text(text)

    def test_a_users_copy_is_that_of_the_library(self):
        self.copy_of_the_library()
        for device in (), ("--device", "llvmpipe"):
            rows, summary = self.pairs("gloss-contrast:haze=0.5,mine.glsl:haze=0.5", *device)
            self.assertEqual(len(rows), 15)
            for row in rows:
                first, second, *bounds = map(float, row[2:6])
                self.assertGreater(first, 0)
                self.assertLess(abs(first / second - 1), 1e-12)
                self.assertTrue(all(0 < bound < 1e-12 for bound in bounds), bounds)
                self.assertEqual(row[6:], ["float64", "float64"])
            self.assertEqual(summary["exact"], True)
            self.assertEqual(summary["undecided"], {"configurations": 0, "listed": []})
            engines = {metric: engine["engine"] for engine in summary["engines"] for metric in engine["metrics"]}
            self.assertEqual(engines["gloss-contrast:haze=0.5"], "vulkan" if device else "host")
            self.assertEqual(engines["mine.glsl:haze=0.5"], "vulkan")

    def test_neither_memory_nor_threads_change_a_digit(self):
        self.copy_of_the_library()
        files = set()
        for options in (), ("--threads", "1"), ("--threads", "5", "--memory", "4M"), ("--memory", "3M"):
            self.pairs("gloss-contrast,mine.glsl", *options)
            files.add((self.work / "out" / "pairs.csv").read_bytes())
        self.assertEqual(len(files), 1)

    def test_another_metric_does_not_notice(self):
        found = []
        for other in "pawcielab", "gloss-contrast":
            self.assert_success("compare", "--database", "db", "--metrics", f"cwcbrt,{other}", "--out",
                                other)
            header, rows = read_csv(self.work / other / "distances.csv")
            found.append([row[header.index("cwcbrt")] for row in rows])
        self.assertEqual(*found)

    def test_it_is_in_every_command(self):
        self.assert_success("compare", "--database", "db", "--metrics", "all", "--out", "compared")
        header, rows = read_csv(self.work / "compared" / "distances.csv")
        self.assertIn("gloss-contrast", header)
        self.assertIn("window-log", header)
        summary = read_json(self.work / "compared" / "summary.json")
        self.assertEqual(summary["metrics_left_out"], [])
        for comparison in summary["comparisons"]:
            if comparison["metrics"] == ["gloss-contrast", "window-log"]:
                self.assertEqual(comparison["undecided_in_float32"], 0)
        (self.work / "judgements.csv").write_text(
            "reference,a,b,votes_a,votes_b\n" +
            "".join(f"m00,m0{i},m0{j},{i},{j}\n" for i in range(1, 6) for j in range(i + 1, 6)))
        self.assert_success("score", "--database", "db", "--judgements", "judgements.csv", "--metrics",
                            "gloss-contrast,rmse", "--out", "scored")
        scored = read_json(self.work / "scored" / "summary.json")
        self.assertEqual([m["undecided"] for m in scored["metrics"]], [0, 0])
        listed = self.assert_success("metrics")
        for part in ("summary: 15 features of the means over 13 windows", "lobe: G, 7 <= theta_h < 15", "profile=0.0084"):
            self.assertIn(part, listed)
        self.assertIn("theta_h_between", self.assert_success("metrics", "show", "lib/windows.glsl"))

    def test_distances_that_are_nearer_than_their_bounds(self):
        """Grey materials whose features are 1, 2, nearly 3, and 2 again."""
        self.warns = True  # of the copy
        grid = (6, 5, 8)
        write_database(self.work / "near", {
            f"m{i}": [1500.0 * x] * support.voxels(grid) * 3 for i, x in enumerate((1, 2, 3 * (1 + 1e-14), 2))}, grid)
        (self.work / "mine.glsl").write_text(HEADER + WINDOW + FEATURE.replace(".y", ".x"))
        results = self.scan("--database", "near", "--metrics", "rmse,mine.glsl")
        summary = read_json(results / "summary.json")
        distances = {tuple(row[:2]): float(row[3]) for row in read_csv(results / "pairs.csv")[1]}
        near = distances["m1", "m2"] - distances["m0", "m1"]
        self.assertTrue(0 < abs(near) < 1e-13, near)
        self.assertEqual(distances["m0", "m3"], distances["m0", "m1"])  # which is a tie, and decided
        self.assertEqual(summary["exact"], False)
        listed = [(one["left"], one["right"]) for one in summary["undecided"]["listed"]]
        self.assertEqual(sorted(listed), [([*left], [*right]) for left, right in (
            (("m0", "m1"), ("m1", "m2")), (("m0", "m1"), ("m2", "m3")),
            (("m0", "m3"), ("m1", "m2")), (("m0", "m3"), ("m2", "m3")))])
        self.assertEqual({one["metric"] for one in summary["undecided"]["listed"]}, {"mine.glsl"})
        self.assertEqual(summary["undecided"]["configurations"], len(listed))

    def test_small_grids(self):
        write_database(self.work / "small", 4, (6, 6, 12))
        self.copy_of_the_library()
        for metrics in "rmse,gloss-contrast", "rmse,gloss-contrast:haze=1", "rmse,mine.glsl":
            self.assert_refused(INPUT, ["\"lobe\"", "6 x 6 x 12"], "scan", "--database", "small", "--metrics", metrics)
        output = self.assert_success("compare", "--database", "small", "--out", "compared")
        self.assertRegex(output, "(?m)^left out +gloss-contrast: .*\"lobe\".*6 x 6 x 12")
        summary = read_json(self.work / "compared" / "summary.json")
        self.assertNotIn("gloss-contrast", [metric["name"] for metric in summary["metrics"]])
        (line,) = summary["metrics_left_out"]
        self.assertIn("gloss-contrast", line)
        self.assert_refused(INPUT, ["\"lobe\""], "compare", "--database", "small", "--metrics",
                            "all,gloss-contrast:haze=1")

    def test_a_metric_whose_weight_lies_in_windows_has_voxels_in_them(self):
        """On ten layers of theta_h none is between 0.5 and 2 degrees, where half of window-log is."""
        write_database(self.work / "small", 4, (10, 10, 20))
        words = ["window-log", "window \"highlight\" has no voxel above the horizon", "10 x 10 x 20"]
        for metrics in "rmse,window-log", "rmse,window-log:off=2":
            self.assert_refused(INPUT, words, "scan", "--database", "small", "--metrics", metrics)
        output = self.assert_success("compare", "--database", "small", "--out", "compared")
        self.assertRegex(output, "(?m)^left out +window-log: its window \"highlight\" has no voxel above the horizon")
        summary = read_json(self.work / "compared" / "summary.json")
        self.assertEqual([line.split(":")[0] for line in summary["metrics_left_out"]], ["gloss-contrast", "window-log"])
        self.assertNotIn("window-log", [metric["name"] for metric in summary["metrics"]])

    def test_the_trial_asks_for_no_numbers(self):
        """The materials that a file is tried on are brighter than those of the user's need be."""
        (self.work / "dark.glsl").write_text(HEADER + WINDOW + FEATURE.replace("m.rgb[whole].y", "log(2.0 - m.rgb[whole].y)"))
        write_database(self.work / "dim", {f"m{i}": [1500.0 * 0.1 * i] * support.voxels((6, 5, 8)) * 3 for i in range(3)},
                       (6, 5, 8))
        self.warns = True  # of black
        self.scan("--database", "dim", "--metrics", "rmse,dark.glsl")

    def test_a_file_of_ones_own_is_shown(self):
        text = HEADER + WINDOW + FEATURE
        (self.work / "mine.glsl").write_text(text)
        self.assertEqual(self.assert_success("metrics", "show", "./mine.glsl").rstrip(), text.rstrip())
        self.assert_refused(INPUT, ["none.glsl"], "metrics", "show", "none.glsl")

    def test_what_was_not_measured(self):
        """The mean of the rest; for other metrics it is a zero."""
        grid = (6, 5, 8)
        size = support.voxels(grid)
        half = [1500.0, -1.0] * (size // 2)
        write_database(self.work / "gaps", {
            "gaps": half * 3, "none": [-1.0] * size * 2 + [1500.0] * size, "whole": [1500.0] * size * 3}, grid)
        (self.work / "mine.glsl").write_text(HEADER + WINDOW + FEATURE.replace(".y", ".x"))
        self.warns = True  # of what looks like a broken copy
        for device in (), ("--device", "llvmpipe"):
            results = self.scan("--database", "gaps", "--metrics", "rmse,mine.glsl", "--force", *device)
            found = {tuple(row[:2]): list(map(float, row[2:4])) for row in read_csv(results / "pairs.csv")[1]}
            self.assertEqual(found["gaps", "whole"][1], 0)
            self.assertGreater(found["gaps", "whole"][0], 0.1)
            self.assertAlmostEqual(found["none", "whole"][1], 1, delta=1e-14)

    def test_wrong_files(self):
        bad = {
            "windows without": HEADER.replace("// features: 1\n", "") + WINDOW + FEATURE,
            "a degree beside": HEADER + "// degree: 2\n" + WINDOW + FEATURE,
            "\"float feature(int i, Means m)\"": HEADER + WINDOW,
            "mine.glsl:5": HEADER + WINDOW + "float feature(int i, Means m) { return m.rgb[part].y; }\n",
            "window(whole, v) is -1": HEADER + WINDOW.replace("1.0", "-1.0") + FEATURE,
            "feature(0, m) is ": HEADER + WINDOW + FEATURE.replace("return ", "return sqrt(-1.0 - m.rgb[whole].x) + "),
            "material \"m00\"": HEADER + WINDOW + FEATURE.replace("return m", "return log(0.0 * m.rgb[whole].x) + m"),
            "\"whole\" has no voxel": HEADER + WINDOW.replace("1.0", "0.0") + FEATURE,
            "calls itself": HEADER + WINDOW + "float f(float x) { return f(x); }\n" + FEATURE.replace("m.rgb", "f(1.0) + m.rgb"),
        }
        for words, text in bad.items():
            with self.subTest(words):
                (self.work / "mine.glsl").write_text(text)
                self.assert_refused(INPUT, ["mine.glsl", words], "scan", "--database", "db", "--metrics",
                                    "rmse,mine.glsl")

    def test_the_example_of_the_documents(self):
        text = (pathlib.Path(__file__).parents[3] / "docs" / "metrics.md").read_text(encoding="utf-8")
        example = text.split("## Summaries")[1].split("```glsl\n")[1].split("```")[0]
        (self.work / "mine.glsl").write_text(example)
        rows, summary = self.pairs("mine.glsl,gloss-contrast")
        self.assertTrue(summary["exact"])
        self.assertEqual(len(rows), 15)


if __name__ == "__main__":
    support.main()
