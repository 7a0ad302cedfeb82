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
            self.assertEqual(row[6], row[7])
        summary = read_json(results / "summary.json")
        self.assertEqual(summary["metrics"], header[2:4])
        self.assertTrue(summary["exact"])  # the device refines what has no twin
        self.assertEqual(summary["refined_by"], {header[2]: "host", header[3]: "vulkan"})

    def test_show_refuses_what_is_not_there(self):
        self.assert_refused(USAGE, ["nothing", "pawcielab"], "metrics", "show", "nothing")


class Exact(Case):
    """A user's metric with a degree is as exact as the library's, and refined to its numbers."""

    GRID = "--grid", "18x18x36"

    def of(self, metrics, out, *options):
        results = self.scan("--metrics", metrics, *self.GRID, *options, out=out)
        summary = read_json(results / "summary.json")
        return summary, read_csv(results / "pairs.csv"), (results / "selection.csv").read_text()

    def copies(self):
        for name in "cwcbrt", "pawcielab":
            text = self.assert_success("metrics", "show", name)
            (self.work / f"{name}.glsl").write_text(text)

    def test_of_a_copy_of_the_library(self):
        self.copies()
        library, (_, expected), selected = self.of("cwcbrt,pawcielab", "library")
        self.assertTrue(library["exact"])
        for options in [], ["--memory", "64M"], ["--threads", "1"]:
            mine, (_, rows), selection = self.of("cwcbrt.glsl,pawcielab.glsl", "mine", "--force", *options)
            self.assertTrue(mine["exact"])
            self.assertGreater(min(mine["refined_distances"].values()), 10)
            self.assertEqual(set(mine["refined_by"].values()), {"vulkan"})
            for key in "disagreements", "counts":
                self.assertEqual(mine[key], library[key])
            self.assertEqual([line.split(",")[:4] for line in selection.splitlines()[1:]],
                             [line.split(",")[:4] for line in selected.splitlines()[1:]])
            refined = 0
            for row, other in zip(rows, expected, strict=True):
                for metric in 0, 1:
                    if row[6 + metric] == other[6 + metric] == "float64":
                        refined += 1
                        self.assertLess(abs(float(row[2 + metric]) / float(other[2 + metric]) - 1), 1e-13)
                        self.assertEqual(float(row[4 + metric]), 0)
            self.assertGreater(refined, 10)

    def test_beside_one_of_the_library_and_fast(self):
        self.copies()
        library = self.of("cwcbrt,pawcielab", "library")[0]
        mixed = self.of("cwcbrt.glsl,pawcielab", "mixed")[0]
        self.assertTrue(mixed["exact"])
        self.assertEqual(mixed["disagreements"], library["disagreements"])
        self.assertEqual(mixed["refined_by"], {"cwcbrt.glsl": "vulkan", "pawcielab": "host"})
        fast = self.of("cwcbrt.glsl,pawcielab", "fast", "--fast")[0]
        self.assertTrue(fast["exact_selection"])
        self.assertEqual(fast["selection"], mixed["selection"])
        for metric, refined in fast["refined_distances"].items():
            self.assertLessEqual(refined, mixed["refined_distances"][metric])
        between = fast["disagreements_between"]
        self.assertLessEqual(between["least"], mixed["disagreements"])
        self.assertGreaterEqual(between["greatest"], mixed["disagreements"])

    def test_without_a_degree_it_is_not(self):
        (self.work / "mine.glsl").write_text(TRANSFORM + WEIGHT + DIFFERENCE)
        summary = self.of("cwcbrt,mine.glsl", "mine")[0]
        self.assertFalse(summary["exact"])
        self.assertEqual(summary["refined_by"], {"cwcbrt": "host", "mine.glsl": None})


class WithDatabase(Case):
    def setUp(self):
        super().setUp()
        write_database(self.work / "db", 3)

    def scan_with(self, *parts, name="mine.glsl"):
        (self.work / name).write_text("".join(parts))
        return ("scan", "--database", "db", "--out", "out", "--force", "--metrics",
                f"cosine-rmse,{name}")

    def assert_bad(self, words, *parts):
        with self.subTest(f"{words} {parts}"):
            self.assert_refused(INPUT, ["mine.glsl", *words], *self.scan_with(*parts))


class OwnMetric(WithDatabase):
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
        self.assert_refused(INPUT, ["No such file"], "scan", "--metrics", "rmse,./none.glsl")

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


# Conditions and bodies of loops of this many iterations; the second many are more than there are, and
# more than lavapipe ends without a word.
FEW, MANY = 5, 70000
LOOPS = {
    "for": "for (int i = 0; i < N; ++i) { s += 1.0; }",
    "parenthesis on the next line": "for // (\n\n  (int i = 0; i < N; ++i) s += 1.0;",
    "while": "int i = 0; while (i < N) { s += 1.0; ++i; }",
    "do": "int i = 0; do { s += 1.0; ++i; } while (i < N);",
    "do without braces": "do s += 1.0; while (s < float(N));",
    "break": "for (int i = 0; true; ++i) { if (i >= N) { break; } s += 1.0; }",
    "continue": "for (int i = 0; i < N; ++i) { if (i >= 0) { s += 1.0; continue; } s = 0.0; }",
    "return": "s = returns(N);",
    "comma": "for (int i = 0, j = 0; ++j, i < N; ++i) { s += 1.0; }",
    "declared in the condition": "int i = 0; while (bool more = i < N) { s += 1.0; ++i; }",
    "carriage return": "// a comment\r for (int i = 0; i < N; ++i) { s += 1.0; }",
    "comment in a comment": "/*/ // */ for (int i = 0; i < N; ++i) { s += 1.0; } /**/",
    "backslash": "// a \\\n comment (\n for (int i = 0; i < N; ++i) { s += 1.0; }",
    "word on two lines": "fo\\\nr (int i = 0; i < N; ++i) { s += 1.0; }",
    "macro": "\n#define LOOP for (int i = 0; i < N; ++i)\nLOOP { s += 1.0; }",
    "macro of half a loop": "\n#define LOOP for\n#define OPEN (\nLOOP OPEN int i = 0; i < N; ++i) { s += 1.0; }",
    "macro function": "\n#define LOOP(n, x) for (int i = 0; i < n; ++i) { x; }\nLOOP(N, s += 1.0)",
    "macro of if": "\n#define if for\n if (int i = 0; i < N; ++i) { s += 1.0; }\n#undef if\n",
    "pasted": "int i = 0;\n#define P(a, b) a##b\nP(whi, le) (i < N) { s += 1.0; ++i; }",
    "counter replaced": "\n#define guard_loop() true\n#define guard_loops 0\n#define kMostLoops 4000000000u\n"
                        "#define count_loop_() true\nfor (int i = 0; i < N; ++i) { s += 1.0; }",
    "true replaced": "int i = 0;\n#define true false\n#define false true\nwhile (i < N) { s += 1.0; ++i; }",
    "in a function": "counts(s);",
    "in a switch": "switch (N) { default: for (int i = 0; i < N; ++i) { s += 1.0; } }",
    "nested": "for (int i = 0; i < N / 5; ++i) { for (int j = 0; j < 5; ++j) { s += 1.0; } }",
}
FUNCTIONS = """float returns(int n) { float s = 0.0; for (int i = 0;; ++i) { if (i >= n) return s; s += 1.0; } }
void counts(inout float s) { for (int i = 0; i < N; ++i) { s += 1.0; } }
"""


class Hidden(WithDatabase):
    """What the text of a file hides from whoever reads it, the compiler sees."""

    def test_loops_are_counted(self):
        for name, loop in LOOPS.items():
            with self.subTest(name):
                for count in FEW, MANY:
                    text = (f"#define N {count}\n{FUNCTIONS}"
                            f"vec3 transform(vec3 f, Voxel v) {{ float s = 0.0; {loop}\n"
                            f"return f * (s / {count}.0); }}\n")
                    self.check(count, text + WEIGHT + DIFFERENCE, name)

    def test_loops_of_a_difference_are_counted(self):
        for name in "for", "do", "return", "in a function":
            for count in FEW, MANY:
                text = (f"#define N {count}\n{FUNCTIONS}"
                        f"float difference(vec3 a, vec3 b) {{ float s = 0.0; {LOOPS[name]}\n"
                        f"return dot(a - b, a - b) * (s / {count}.0); }}\n")
                self.check(count, TRANSFORM + WEIGHT + text, name)

    def test_loops_that_lavapipe_would_cut(self):
        """Voxels side by side take turns, each within its own count."""
        for turns in 1000, 16000:
            self.check(FEW if turns == 1000 else MANY, (
                "vec3 transform(vec3 f, Voxel v) {\n"
                "    float s = 0.0; int mine = int(f.x * 1e6) % 8;\n"
                "    for (int j = 0; j < 8; ++j) { if (j == mine) {\n"
                f"        for (int i = 0; i < {turns}; ++i) {{ s += 1.0; }} }} }}\n"
                f"    return f * (s / {turns}.0);\n}}\n") + WEIGHT + DIFFERENCE, "turns")
        for turns in 2, 30000:
            self.check(FEW if turns == 2 else MANY, TRANSFORM + WEIGHT +
                "float difference(vec3 a, vec3 b) {\n"
                f"    float s = 0.0; int n = int(a.x * 1e6) % 8 == 3 ? {turns} : 0;\n"
                "    for (int i = 0; i < n; ++i) { s += 1e-12; }\n"
                "    return dot(a - b, a - b) * (1.0 + s);\n}\n", "turns of a difference")

    def check(self, count, text, name):
        (self.work / "mine.glsl").write_bytes(text.encode())
        command = ["scan", "--database", "db", "--out", "out", "--force", "--metrics",
                   "cosine-rmse,mine.glsl"]
        if count == MANY:
            self.assert_refused(INPUT, ["mine.glsl", "loop"], *command)
            return
        self.assert_success(*command)
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6, name)

    def test_text_of_any_editor(self):
        text = "// title: x\n// degree: 2\n\n" + TRANSFORM + WEIGHT + "float difference(float d) { return d * d; }\n"
        for end in "\r", "\r\n":
            for mark in b"", b"\xef\xbb\xbf":
                (self.work / "MINE.GLSL").write_bytes(mark + text.replace("\n", end).encode())
                results = self.scan("--database", "db", "--metrics", "cosine-rmse,MINE.GLSL", "--force")
                for row in read_csv(results / "pairs.csv")[1]:
                    self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)
        (self.work / "MINE.GLSL").write_bytes((text + "x\r").replace("\n", "\r").encode())
        self.assert_refused(INPUT, ["MINE.GLSL:7: "], "scan", "--metrics", "rmse,MINE.GLSL")

    def test_names_of_files(self):
        for name in 'a"b.glsl', "a\\.glsl", "a b.glsl", "a\nb.glsl", "#line 7.glsl", "metric.glsl", "ä.glsl":
            with self.subTest(name):
                (self.work / name).write_text(TRANSFORM + WEIGHT + DIFFERENCE)
                self.assert_success("scan", "--database", "db", "--out", "out", "--force", "--metrics",
                                    f"cosine-rmse,{name}")
                (self.work / name).write_text(TRANSFORM + WEIGHT + DIFFERENCE + "colour")
                words = [":4: ", "syntax"] + ([name] if "\n" not in name else [])
                self.assert_refused(INPUT, words, "scan", "--metrics", f"rmse,{name}")


class Undefined(WithDatabase):
    """What GLSL leaves undefined gives no number in silence."""

    def test_numbers_that_are_none(self):
        for transform in (
                "return f / scale;", "return f / vec3(scale);", "return f * (1.0 / scale);",
                "return vec3(0.0 / scale);", "return mod(f, scale);", "return f - f / scale * 0.0;",
                "float s = scale; return f / s;", "return f / (v.cos_theta_i - v.cos_theta_i);",
                "return clamp(f / scale - f / scale, 0.0, 1.0);",
                "return vec3(step(0.5, sqrt(-1.0 - f.x)));", "return normalize(f * scale);",
                "return vec3(inversesqrt(scale));", "return log(f * scale);", "return pow(f * scale, vec3(-1.0));",
                "return sqrt(-f - 1.0);", "return vec3(sign(log(-f.x - 1.0)));", "return max(log(-f - 1.0), 0.0);",
                "return inverse(mat3(f, f, f)) * f;", "return f * smoothstep(scale, scale, scale);",
                "vec3 s = vec3(0.0); for (int i = 0; i < 3; ++i) { s += f / float(i); } return s;",
                "return vec3(atan(f.x / scale - f.y / scale));", "return acos(f + 2.0);",
                "return f * length(sqrt(-1.0 - f));", "return vec3(distance(f / scale, f / scale));",
                "return f * (2.0 + normalize(vec3(sqrt(-1.0 - f.x), 1.0, 1.0)).y);"):
            self.assert_bad(["transform()", "at voxel"],
                            "// parameter: scale = 0 in [0, 1] x\nvec3 transform(vec3 f, Voxel v) { ",
                            transform, " }\n", WEIGHT, DIFFERENCE)
        for weight in "1.0 / scale", "scale / scale", "min(1.0, sqrt(-1.0 - v.s_merl))", "max(log(-1.0 - v.s_merl), 0.0)":
            self.assert_bad(["weight()", "at voxel"], "// parameter: scale = 0 in [0, 1] x\n", TRANSFORM,
                            "float weight(Voxel v) { return ", weight, "; }\n", DIFFERENCE)
        for difference in ("distance(a, b) / scale", "1.0 - min(1.0, 0.0 * (distance(a, b) / scale))",
                           "max(sqrt(-1.0 - a.x * b.x), 0.0)", "mod(distance(a, b), scale)",
                           "distance(normalize(a * scale), normalize(b * scale))",
                           "abs(pow(-1.0 - distance(a, b), 0.5))", "step(log(-1.0 - a.x * b.x), 1.0)",
                           "clamp(log(-1.0 - a.x * b.x), 0.0, 1.0)",
                           "distance(a, b) * (1.0 + 0.0 * length(vec3(sqrt(-1.0 - a.x * b.x))))"):
            self.assert_bad(["difference(", "at voxel"], "// parameter: scale = 0 in [0, 1] x\n", TRANSFORM, WEIGHT,
                            "float difference(vec3 a, vec3 b) { return ", difference, "; }\n")

    def test_remainders_of_negative_integers(self):
        for text in "int(-7.0 - 0.0 * f.x) % 3", "7 % int(-3.0 - 0.0 * f.x)", "7 % int(0.0 * f.x)":
            self.assert_bad(["remainder", "at voxel"], "vec3 transform(vec3 f, Voxel v) { return f * (9.0 + float(",
                            text, ")); }\n", WEIGHT, DIFFERENCE)

    def test_zeros_that_the_device_knows(self):
        large = "const float q[80] = float[](" + ", ".join(f"{i % 7}.0" for i in range(80)) + ");\n"
        loop = "for (int i = 0; i < {0}; ++i) {{ f += q[i] {1}; }} return f;"
        for before, transform in (
                ("", "return f + cross(f, f) / length(cross(f, f));"),
                ("", "mat2 m = mat2(f.x, f.x, f.x, f.x); return f * (determinant(m) / determinant(m));"),
                ("", "return f + uintBitsToFloat(0u) / uintBitsToFloat(0u);"),
                ("", "return f + uintBitsToFloat(0u) * (1.0 / uintBitsToFloat(0u));"),
                ("const float q[3] = float[](0.0, 1.0, 2.0);\n", loop.format(3, "/ q[i]")),
                ("const mat2 q = mat2(0.0);\n", "for (int i = 0; i < 2; ++i) { f += q[i][i] / q[i][i]; } return f;"),
                (large, loop.format(80, "/ q[i]")), (large, loop.format(80, "* (1.0 / q[i])")),
                ("", "f /= 0.0 * f; return vec3(0.0 * distance(f, f));"),
                ("", "f /= 0.0 * f; return vec3(0.0 * length(cross(f, f)));")):
            self.assert_bad(["transform()", "at voxel"], before, "vec3 transform(vec3 f, Voxel v) { ", transform,
                            " }\n", WEIGHT, DIFFERENCE)

    def test_of_parameters_alone(self):
        header = "// parameter: scale = 0 in [0, 1] x\n"
        for words, transform in (
                (["at voxel"], "return f + max(log(scale - 1.0), 0.0);"),
                (["at voxel"], "return f * clamp(sqrt(scale - 1.0), 1.0, 2.0);"),
                (["at voxel"], "return f * min(scale / scale, 1.0);"),
                (["at voxel"], "return f * max(vec3(0.0) / vec3(scale).y, vec3(1.0));"),
                (["at voxel"], "return f * step(mod(1.0, scale), 1.0);"),
                (["shift"], "return f * (1.0 + float(1u >> (40u + uint(scale))));"),
                (["integer"], "return f * (1.0 + float(1 / int(scale)));"),
                (["conversion"], "return f * (1.0 + float(int(scale - 1e10)));")):
            self.assert_bad(["transform()", *words], header, "vec3 transform(vec3 f, Voxel v) { ", transform, " }\n",
                            WEIGHT, DIFFERENCE)
        self.assert_bad(["difference("], header, TRANSFORM, WEIGHT, "float difference(vec3 a, vec3 b) {\n",
                        "    return distance(a, b) + max(log(scale - 1.0), 0.0);\n}\n")
        self.assert_bad([":4: ", "infinite or not a number"], header, TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return distance(a, b) + max(log(-1.0), 0.0); }\n")
        self.assert_success(*self.scan_with(
            header, "vec3 transform(vec3 f, Voxel v) {\n",
            "    const vec3 k = vec3(scale, 1.0 - scale, 2.0); switch (int(scale)) { case 0: f *= k.y; }\n",
            "    return f * pow(k.z, scale);\n}\n", WEIGHT, DIFFERENCE))
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)

    def test_a_choice_that_avoids_it_is_kept(self):
        self.assert_success(*self.scan_with(
            "// parameter: scale = 0 in [0, 1] x\n",
            "vec3 transform(vec3 f, Voxel v) { return scale == 0.0 ? f : f / scale; }\n", WEIGHT,
            "float difference(vec3 a, vec3 b) {\n",
            "    float size = scale * distance(a, b);\n"
            "    return size > 0.0 ? dot(a - b, a - b) / size : dot(a - b, a - b);\n}\n"))
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)

    def test_integers(self):
        for words, body in (
                (["index"], "float t[3] = float[](1.0, 2.0, 3.0); return f * t[3 + int(v.phi_d > 9.0)];"),
                (["index"], "float t[3] = float[](1.0, 2.0, 3.0); return f * t[int(v.phi_d < 9.0) - 2];"),
                (["index"], "return f * f[3 + int(v.phi_d > 9.0)];"),
                (["index"], "f[3 + int(v.phi_d > 9.0)] = 1.0; return f;"),
                (["index"], "mat3 m = mat3(1.0); return m[3u + uint(v.phi_d > 9.0)];"),
                (["integer"], "return f * float(7 / int(v.phi_d > 9.0));"),
                (["integer"], "return f * float(7u % uint(v.phi_d > 9.0));"),
                (["integer"], "return f * float((ivec2(7) / ivec2(1, int(v.phi_d > 9.0))).y);"),
                (["shift"], "return f * float(1 << (32 + int(v.phi_d > 9.0)));"),
                (["shift"], "return f * float(1u >> (uint(v.theta_h) + 40u));"),
                (["conversion"], "return f * float(int(1e10 + v.phi_d));"),
                (["conversion"], "return f * float(uint(-2.0 - v.phi_d));"),
                (["conversion"], "return f * float(int(log(-1.0 - v.phi_d)));")):
            with self.subTest(body):
                self.assert_bad(["transform()", *words], "vec3 transform(vec3 f, Voxel v) { ", body, " }\n", WEIGHT,
                                DIFFERENCE)
        self.assert_bad(["difference(", "index beyond"], TRANSFORM, WEIGHT,
                        "float difference(vec3 a, vec3 b) { return distance(a, b) * a[a.x > 0.0 ? 3 : 0]; }\n")
        self.assert_success(*self.scan_with(
            "vec3 transform(vec3 f, Voxel v) {\n"
            "    float t[3] = float[](1.0, 2.0, 0.5); int i = int(v.phi_d > 9.0);\n"
            "    uint two = 8u / uint(4 - i) >> uint(i);\n"
            "    return f * (t[i + 2] * float(two));\n}\n", WEIGHT, DIFFERENCE))
        for row in read_csv(self.work / "out" / "pairs.csv")[1]:
            self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)


class WithoutWeight(WithDatabase):
    def test_what_has_no_value_at_zero(self):
        """The last block is filled up with zeros, of which such a difference can make nothing."""
        for one in "dot(a, a) / dot(a, a)", "float(7 / int(ceil(a.x + b.x)) * 0 + 1)":
            self.assert_success(*self.scan_with(
                TRANSFORM, WEIGHT,
                f"float difference(vec3 a, vec3 b) {{ return dot(a - b, a - b) * ({one}); }}\n"))
            for row in read_csv(self.work / "out" / "pairs.csv")[1]:
                self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)


class Deep(WithDatabase):
    """What makes a compiler recurse ends in the guarded process."""

    def test_nesting(self):
        n = 20000
        for text in ("#if 1\n" * n + "#endif\n" * n,
                     "float f(float x) { return " + "(" * n + "x" + ")" * n + "; }\n",
                     "float f(float x) { return x" + "+ x" * n + "; }\n",
                     "float f(float x) { return " + "- " * n + "x; }\n",
                     "float f(float x) { return " + "x > 1.0 ? x : " * n + "x; }\n",
                     "float f(float x) { " + "{" * n + "}" * n + " return x; }\n",
                     "float f(float x) { " + "if (x > 1.0) { x = 2.0; } else " * 5000 + "{} return x; }\n",
                     "float f(float x) { " + "if (x > 1.0) " * 5000 + "x = 2.0; return x; }\n",
                     "float f(float x) { " + "for (;;) " * 5000 + "x = 2.0; return x; }\n",
                     "float f(float x) { " + "x = " * n + "x; return x; }\n",
                     "#define A(x) x x\n#define B(x) A(A(A(A(x))))\n#define C(x) B(B(B(B(x))))\nC(C(float x;))\n",
                     "struct S0 { float x; };\n" + "".join(f"struct S{i + 1} {{ S{i} a; S{i} b; }};\n" for i in range(60)),
                     "float f(float x[2147483647]) { return x[0]; }\n"):
            with self.subTest(text[:60]):
                result = self.run_program(*self.scan_with(text, TRANSFORM, WEIGHT, DIFFERENCE))
                self.assertIn(result.returncode, (0, INPUT), result.stderr[:300])
                if result.returncode == 0:
                    for row in read_csv(self.work / "out" / "pairs.csv")[1]:
                        self.assertLess(abs(float(row[2]) / float(row[3]) - 1), 1e-6)
                else:
                    self.assertLess(len(self.only_line(result.stderr)), 1000)


if __name__ == "__main__":
    support.main()
