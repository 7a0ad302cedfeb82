"""Comments and documents name files of the tree that are there; documents are finished."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
NAME = re.compile(r"(?<![\w./<*-])(?:[\w-]+/)*[\w-]+\.(?:h|cpp|glsl|comp|cmake|py|in|sh|md)\b(?!/)")

# What stands in a text until a figure takes its place: BOUND_LOW, MEASURED.
PLACEHOLDER = re.compile(r"\b(?:[A-Z]{2,}(?:_[A-Z]+)+|MEASURED\w*|TODO|FIXME|XXX)\b")
CODE = re.compile(r"```.*?```|`[^`]*`", re.DOTALL)

# Files of users; and what is in capitals (NAME.cpp) stands for any name.
EXAMPLES = {"my_metric.glsl", "my.glsl", "metric.glsl", "mine.cpp"}


def comments(path):
    """(number, text) of the lines that may name files: of sources the comments, else all."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if path.suffix in (".h", ".cpp", ".glsl", ".comp"):
            start = line.find("//")
            if start >= 0:
                yield number, line[start:]
        else:
            yield number, line


class References(unittest.TestCase):
    def test_files_that_comments_and_documents_name_exist(self):
        found = [path for folder in ("app", "docs", "engine", "examples", "scan", "scripts", "shaders", "tests")
                 for path in (SOURCE / folder).rglob("*") if path.is_file()]
        found += [SOURCE / "README.md", SOURCE / "CHANGELOG.md", SOURCE / "CMakeLists.txt"]
        paths = ["/" + path.relative_to(SOURCE).as_posix() for path in found]
        # What is made of NAME.in is called without the ending.
        paths += [path.removesuffix(".in") for path in paths]
        checked, missing = 0, []
        for path in found:
            if path.suffix not in (".h", ".cpp", ".glsl", ".comp", ".md") or path == SOURCE / "CHANGELOG.md":
                continue
            for number, text in comments(path):
                for name in NAME.findall(text):
                    last = pathlib.PurePosixPath(name)
                    if last.name in EXAMPLES or re.match("[A-Z]{2}", last.stem) and last.suffix != ".md":
                        continue
                    checked += 1
                    if not any(other.endswith("/" + name) for other in paths):
                        missing.append(f"{path.relative_to(SOURCE)}:{number}: {name}")
        self.assertEqual(missing, [])
        self.assertGreater(checked, 100)

    def test_documents_have_no_placeholders(self):
        documents = [*SOURCE.glob("*.md"), *(SOURCE / "docs").glob("*.md")]
        found = [f"{path.name}: {word}" for path in documents
                 for word in PLACEHOLDER.findall(CODE.sub("", path.read_text(encoding="utf-8")))]
        self.assertEqual(found, [])
        self.assertGreater(len(documents), 5)
        self.assertEqual(PLACEHOLDER.findall("from BOUND_LOW to 1e-13, MERL and MEASURED, see CHANGELOG"),
                         ["BOUND_LOW", "MEASURED"])


if __name__ == "__main__":
    unittest.main()
