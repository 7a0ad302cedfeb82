"""The package for people and tools: types, docstrings, tables."""

import importlib.util
import inspect
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import merl_scan as ms
from array_test import brdf


class Package(unittest.TestCase):
    def test_types(self):
        if importlib.util.find_spec("mypy") is None:
            self.skipTest("no mypy")
        with tempfile.TemporaryDirectory() as place:
            result = subprocess.run(
                [sys.executable, "-m", "mypy", "--strict", "--cache-dir", place, "-p", "merl_scan"],
                env={**os.environ, "MYPYPATH": str(pathlib.Path(ms.__file__).parents[1])}, cwd=place,
                capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_everything_public_is_described(self):
        for name in ms.__all__:
            thing = getattr(ms, name)
            if callable(thing):
                self.assertTrue(inspect.getdoc(thing), name)

    def test_the_stubs_name_what_is_compiled(self):
        text = (pathlib.Path(ms.__file__).parent / "_core.pyi").read_text(encoding="utf-8")
        for name in dir(ms._core):
            if not name.startswith("_"):
                self.assertRegex(text, rf"(def|class) {name}\b|\b{name}:", name)

    def test_pandas(self):
        if importlib.util.find_spec("pandas") is None:
            self.skipTest("no pandas")
        d = ms.distances(ms.Database.from_arrays({n: brdf(i) for i, n in enumerate("abcd")}))
        table = d.to_pandas()
        self.assertEqual(list(table.columns), ["material_1", "material_2", "cwcbrt", "pawcielab"])
        self.assertEqual(len(table), 6)
        self.assertEqual(list(ms.scan(d).to_pandas("selection").columns)[:4], ["left_1", "left_2", "right_1", "right_2"])

    def test_metrics(self):
        self.assertIn("pawcielab", [metric.name for metric in ms.metrics()])
        self.assertEqual(ms.Metric("pawcielab:white=80").parameters, {"white": 80})


if __name__ == "__main__":
    unittest.main(verbosity=2)
