"""Files that may not be compiled as one are kept apart, and none is lost."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPTS = pathlib.Path(__file__).resolve().parents[1] / "scripts"
sys.path.insert(0, str(SCRIPTS))
import units  # noqa: E402


def anonymous(text):
    return f"namespace merl {{\nnamespace {{\n\n{text}\n\n}}  // namespace\n}}  // namespace merl\n"


class Units(unittest.TestCase):
    def numbers(self, *texts, most=8):
        """The unit of every text, as CMake gets them."""
        with tempfile.TemporaryDirectory() as folder:
            files = [pathlib.Path(folder) / f"{i}.cpp" for i in range(len(texts))]
            for file, text in zip(files, texts):
                file.write_text(text, encoding="utf-8")
            out = subprocess.run([sys.executable, "-B", SCRIPTS / "units.py", str(most), *files],
                                 capture_output=True, text=True, check=True).stdout
        return [int(number) for number in out.split(";")]

    def test_same_own_names_are_apart(self):
        for one in ("int f(int x) {\n    return x;\n}", "struct f {\n    int x;\n};",
                    "constexpr double f = 1;", "constexpr int f[] = {1};", "enum class f : int { a };",
                    "using f = std::vector<int>;", "[[noreturn]] void f(int x) {\n}",
                    "template <class T>\nT f(T x) {\n    return x;\n}"):
            self.assertEqual(self.numbers(anonymous(one), anonymous("bool f(const char* x) {\n}")), [0, 1], one)
        self.assertEqual(self.numbers("static int f() {\n}\n", anonymous("constexpr int f = 2;")), [0, 1])

    def test_what_is_inside_of_names_may_meet(self):
        self.assertEqual(self.numbers(anonymous("struct a {\n    int x;\n};"),
                                      anonymous("struct b {\n    int x;\n};")), [0, 0])

    def test_macros_and_namespaces_are_alone(self):
        for one in ("#define F 1\n", "#  undef F\n", "using namespace std;\n"):
            self.assertEqual(self.numbers(anonymous("int a = 1;"), one, anonymous("int b = 1;")), [0, 1, 0], one)

    def test_a_taken_name_is_alone_with_its_word(self):
        taken = "using other::Thing;\n"
        self.assertEqual(self.numbers(taken, "int x;\n", "other::Thing y;\n"), [0, 0, 1])

    def test_a_type_of_its_own_is_apart_from_another_of_that_name(self):
        own = anonymous("struct Pair {\n    int x;\n};")
        self.assertEqual(self.numbers(own, "std::vector<Pair> pairs();\n", "int x;\n"), [0, 1, 0])

    def test_a_name_from_elsewhere_that_headers_have_is_alone(self):
        self.assertEqual(self.numbers("using ::testing::Pair;\n", "int x;\n", "int y;\n"), [0, 1, 1])
        self.assertEqual(self.numbers("using ::testing::HasSubstr;\n", "int x;\n"), [0, 0])

    def test_units_are_full(self):
        self.assertEqual(self.numbers(*["int x;\n"] * 5, most=2), [0, 0, 1, 1, 2])

    def test_no_file_is_lost(self):
        files = sorted(SCRIPTS.parent.glob("engine/**/*.cpp"))
        found = [file for unit in units.units(files, 8) for file in unit]
        self.assertEqual(sorted(found), files)
        self.assertLess(len(units.units(files, 8)), len(files) / 2)


if __name__ == "__main__":
    unittest.main()
