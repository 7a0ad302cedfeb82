"""Metrics on the command line: the library, parameters, and files of a user's own."""

import support
from support import INPUT, USAGE, Case, read_csv, read_json, write_database

TRANSFORM = "vec3 transform(vec3 f, Voxel v) { return f; }\n"
WEIGHT = "float weight(Voxel v) { return v.cos_theta_i * v.cos_theta_i; }\n"
DIFFERENCE = "float difference(vec3 a, vec3 b) { return dot(a - b, a - b); }\n"


class Library(Case):
    def test_list(self):
        output = self.assert_success("metrics")
        for part in ("rmse: Root mean square error", "sum_k s_MERL cos theta_o", "epsilon=0.001",
                     "Ryman 2018", "degree 2/3", "no degree"):
            self.assertIn(part, output)

    def test_what_show_prints_is_a_metric(self):
        text = self.assert_success("metrics", "show", "pawcielab")
        self.assertIn("// parameter: white", text)
        (self.work / "mine.glsl").write_text(text)
        write_database(self.work / "db", 4)
        results = self.scan("--database", "db", "--metrics", "pawcielab:white=2,mine.glsl:white=2")
        header, rows = read_csv(results / "pairs.csv")
        self.assertEqual(header[2:4], ["pawcielab:white=2", "mine.glsl:white=2"])
        for row in rows:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)
            self.assertEqual(row[6:], ["float32", "float32"])
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["metrics"], header[2:4])
        self.assertFalse(summary["exact"])  # it has no float64 twin

    def test_show_refuses_what_is_not_there(self):
        self.assert_refused(USAGE, ["nothing", "pawcielab"], "metrics", "show", "nothing")


class OwnMetric(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 3)

    def scan_with(self, *parts, name="mine.glsl"):
        (self.work / name).write_text("".join(parts))
        return "scan", "--database", "db", "--out", "out", "--metrics", f"cosine-rmse,{name}"

    def assert_bad(self, words, *parts):
        with self.subTest(words):
            self.assert_refused(INPUT, ["mine.glsl", *words], *self.scan_with(*parts))

    def test_without_a_degree(self):
        self.assert_success(*self.scan_with(TRANSFORM, WEIGHT, DIFFERENCE))
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)
            self.assertEqual(row[5], "inf")

    def test_with_a_degree_and_a_loop(self):
        self.assert_success(*self.scan_with(
            "// degree: 2\n", "vec3 transform(vec3 f, Voxel v) {\n", "    vec3 g = vec3(0.0);\n",
            "    for (int i = 0; i < 4; ++i) { g += 0.25 * f; }\n", "    return g;\n}\n", WEIGHT,
            "float difference(float d) { return d * d; }\n"))
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)
            self.assertLess(float(row[5]), 1e-5 * float(row[3]))

    def test_compile_errors(self):
        self.assert_bad(["mine.glsl:3", "colour"], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return colour; }\n")
        self.assert_bad(["float weight(Voxel v)"], TRANSFORM, DIFFERENCE)
        self.assert_bad(["mine.glsl:1", "tilte"], "// tilte: x\n", TRANSFORM, WEIGHT, DIFFERENCE)
        self.assert_bad(["recursion"], TRANSFORM, WEIGHT, "float f(float x) { return f(x); }\n",
                        "float difference(vec3 a, vec3 b) { return f(1.0); }\n")
        self.assert_refused(INPUT, ["no such file"], "scan", "--metrics", "rmse,./none.glsl")

    def test_wrong_values(self):
        places = ["at voxel", "theta_h", "materials \"made-up", "cos_theta_i"]
        self.assert_bad(["difference", "nan", *places], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return sqrt(-1.0 - a.x * b.x); }\n")
        self.assert_bad(["difference", "inf", *places], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return 1.0 / (a.x * 0.0); }\n")
        self.assert_bad(["-3", *places[:2]], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return -3.0; }\n")
        self.assert_bad(["one way", "the other"], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return distance(a, b) * a.x; }\n")
        self.assert_bad(["transform()", "nan"], WEIGHT, DIFFERENCE,
                        "vec3 transform(vec3 f, Voxel v) { return log(-1.0 - f); }\n")
        self.assert_bad(["weight()"], TRANSFORM, DIFFERENCE,
                        "float weight(Voxel v) { return v.cos_theta_i - 0.9; }\n")
        self.assert_bad(["degree 2"], "// degree: 2\n", TRANSFORM, WEIGHT,
                        "float difference(float d) { return abs(d); }\n")

    def test_a_value_that_only_the_database_shows(self):
        self.assert_bad(["-1", "at voxel", "materials \"m0"], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) {\n",
                        "    return a.x > a.y || b.x > b.y ? -1.0 : 1.0;\n}\n")

    def test_what_has_no_end(self):
        self.assert_bad(["loop"], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { float s = 0.0;\n",
                        "for (;;) { s += 1.0; } return s; }\n")
        self.assert_bad(["loop"], WEIGHT, DIFFERENCE, "vec3 transform(vec3 f, Voxel v) {\n",
                        "while (true) { f += 1.0; } return f; }\n")

    def test_two_of_the_same_name(self):
        self.assert_refused(USAGE, ["twice"], "scan", "--metrics", "pawcielab:white=100,pawcielab")
        (self.work / "other").mkdir()
        for path in "mine.glsl", "other/mine.glsl":
            (self.work / path).write_text(TRANSFORM + WEIGHT + DIFFERENCE)
        self.assert_refused(USAGE, ["rename"], "scan", "--metrics", "mine.glsl,other/mine.glsl")


if __name__ == "__main__":
    support.main()
