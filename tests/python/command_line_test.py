"""The module against what the command line writes of the same files: the same bits."""

import importlib.util
import os

# The program lets lavapipe have wider vectors, and with them sums of another order; the module leaves
# the environment alone. Before a driver is loaded.
os.environ["LP_NATIVE_VECTOR_WIDTH"] = "256"

import numpy as np

import exr
import merl_scan as ms
import support

OWN = """// title: Own
// formula: sqrt( 1/|K| sum_k |f1 - f2|^2 )
// source: a test
// degree: 2
// parameter: gamma = 1 in [0.1, 10] the power

vec3 transform(vec3 f, Voxel v) { return pow(f, vec3(gamma)); }

float weight(Voxel v) { return 1.0; }

float difference(float d) { return d * d; }
"""


class CommandLine(support.Case):
    def setUp(self):
        super().setUp()
        support.write_database(self.work / "database", 7)
        self.database = ms.open(self.work / "database")

    def column(self, file, name):
        header, rows = support.read_csv(file)
        return [row[header.index(name)] for row in rows]

    def test_scan(self):
        out = self.scan("--database", "database", "--metrics", "cwcbrt,pawcielab", "--device", "host")
        d = ms.distances(self.database, ["cwcbrt", "pawcielab"], device="host")
        s = ms.scan(d, "cwcbrt", "pawcielab", disagreements=None)
        for metric in d.metrics:
            self.assertEqual([float(x) for x in self.column(out / "pairs.csv", metric)], s.values[metric].tolist())
            self.assertEqual([float(x) for x in self.column(out / "pairs.csv", metric + "_bound")], s.bounds[metric].tolist())
        summary = support.read_json(out / "summary.json")
        self.assertEqual(summary["disagreements"], s.counts["disagreements"])
        self.assertEqual(summary["database"]["content_hash"], d.provenance["database"]["content_hash"])
        self.assertEqual(self.database.content_hash(), d.provenance["database"]["content_hash"])
        names = np.array(s.names)
        for file, rows in (("disagreements.csv", s.disagreements), ("selection.csv", s.selection)):
            self.assertGreater(len(rows), 0)
            for side in ("left_1", "left_2", "right_1", "right_2"):
                self.assertEqual(self.column(out / file, side), names[rows[side]].tolist())
            for field, name in (("first_left", "cwcbrt_left"), ("second_right", "pawcielab_right"), ("agreement", "agreement")):
                self.assertEqual([float(x) for x in self.column(out / file, name)], rows[field].tolist())

    def test_arrays_of_the_same_samples(self):
        arrays = ms.Database.from_arrays({name: self.database[name].samples() for name in self.database})
        for metric in ("rmse", "cwcbrt", "gloss-contrast"):
            try:
                of_files = ms.distances(self.database, metric, device="host")
            except ms.InputError:  # a window without a voxel on so small a grid
                continue
            self.assertEqual(of_files[metric].tolist(), ms.distances(arrays, metric, device="host")[metric].tolist())

    def test_tables(self):
        d = ms.distances(self.database, ["rmse", "cwcbrt"], device="host")
        d.to_csv(self.work / "d.csv")
        again = ms.read_distances(self.work / "d.csv")
        self.assertEqual((again.names, again["rmse"].tolist()), (d.names, d["rmse"].tolist()))
        out = self.scan("--distances", "d.csv")
        self.assertEqual(support.read_json(out / "summary.json")["disagreements"], ms.scan(again).counts["disagreements"])

    def test_score(self):
        rows = ["reference,a,b,votes_a,votes_b"]
        numbers = np.random.default_rng(3)
        for _ in range(30):
            r, a, b = numbers.permutation(7)[:3]
            rows.append(f"m{r:02},m{a:02},m{b:02},{numbers.integers(1, 9)},{numbers.integers(1, 9)}")
        (self.work / "judgements.csv").write_text("\n".join(rows) + "\n")
        self.assert_success("score", "--judgements", "judgements.csv", "--database", "database", "--metrics",
                            "cwcbrt,pawcielab,rmse", "--device", "host", "--out", "scores", "--quiet")
        score = ms.score(ms.distances(self.database, ["cwcbrt", "pawcielab", "rmse"], device="host"),
                         ms.read_judgements(self.work / "judgements.csv"))
        header, table = support.read_csv(self.work / "scores/score.csv")
        by_name = {row[0]: dict(zip(header, row)) for row in table}
        for one in score.metrics:
            self.assertEqual(float(by_name[one.metric]["majorities"]), one.majorities.value)
            self.assertEqual(float(by_name[one.metric]["log_likelihood_per_vote"]), one.log_likelihood.value)
        if importlib.util.find_spec("pandas") is None:
            return
        frame = score.to_pandas().set_index("metric")
        self.assertEqual(sorted(frame.index), sorted(by_name))
        for name, row in by_name.items():
            for column in frame.columns:
                there = row[column.replace("log_likelihood", "log_likelihood_per_vote")]
                np.testing.assert_equal(frame.loc[name, column], float(there) if there else np.nan, column)

    def test_spheres(self):
        self.assert_success("render", "--database", "database", "--materials", "m03", "--size", "24", "--out", "m.exr", "--quiet")
        width, height, channels = exr.read_exr(self.work / "m.exr")
        image = ms.render(self.database["m03"], size=24, encoding="linear")
        self.assertEqual(image.shape, (height, width, 3))
        for c, name in enumerate("RGB"):
            self.assertEqual(image[..., c].ravel().tolist(), channels[name])
        shown = ms.render(self.database["m03"].samples(), size=24)
        self.assertTrue(0 <= shown.min() <= shown.max() <= 1)

    def test_own_metric(self):
        file = self.work / "own.glsl"
        file.write_text(OWN)
        text = f"{file}:gamma=0.5"
        out = self.scan("--database", "database", "--metrics", f"rmse,{text}")
        d = ms.distances(self.database, ["rmse", text])
        # Some are refined there.
        for there, here in zip(self.column(out / "pairs.csv", d.metrics[1]), d.values[d.metrics[1]].tolist(), strict=True):
            self.assertAlmostEqual(float(there) / here, 1, delta=1e-6)
        a, b = (self.database[m].samples() for m in ("m00", "m01"))
        self.assertEqual(ms.distance(text, a, b), d.values[d.metrics[1]][0])
        file.write_text(OWN.replace("vec3(gamma)", "nonsense"))
        with self.assertRaisesRegex(ms.InputError, "nonsense"):
            ms.distance(text, a, b)

    def test_errors_have_the_text_of_the_command_line(self):
        (self.work / "database/m03.binary").write_bytes(b"short")
        line = self.assert_refused(support.INPUT, ["m03"], "scan", "--database", str(self.work / "database"))
        with self.assertRaises(ms.InputError) as caught:
            ms.open(self.work / "database")
        self.assertEqual(line, f"merl-scan: {caught.exception}; --skip-bad leaves them out")


if __name__ == "__main__":
    support.main()
