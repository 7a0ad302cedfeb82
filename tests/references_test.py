"""Comments and documents name files of the tree that are there."""

import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
NAME = re.compile(r"(?<![\w./<*-])(?:[\w-]+/)*[\w-]+\.(?:h|cpp|glsl|comp|cmake|py|in|sh|md)\b(?!/)")

# Files of users; and what is in capitals (NAME.cpp) stands for any name.
EXAMPLES = {"my_metric.glsl", "my.glsl", "metric.glsl"}


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
        found = [path for folder in ("app", "docs", "engine", "scan", "scripts", "shaders", "tests")
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


if __name__ == "__main__":
    unittest.main()
