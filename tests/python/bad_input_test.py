"""Whatever is wrong: a clear exception, and what was made before still works."""

import pathlib
import tempfile
import unittest

import numpy as np

import merl_scan as ms
from array_test import SHAPE, brdf


class BadInput(unittest.TestCase):
    def refused(self, kind, words, function, *arguments, **options):
        with self.assertRaises(kind) as caught:
            function(*arguments, **options)
        for word in words:
            self.assertIn(word, str(caught.exception))

    def test_arrays(self):
        good, make = brdf(1), ms.Database.from_arrays
        self.refused(ms.InputError, ["b: ", "(12, 10, 16, 3)", "(12, 10, 16, 4)"], make, {"a": good, "b": np.ones((*SHAPE, 4))})
        for shape in ((), (3,), SHAPE, (0, 1, 1, 3), (*SHAPE, 3, 1)):
            self.refused(ms.Error, [], make, {"a": np.ones(shape)})
        for array in (np.ones((*SHAPE, 3), int), np.ones((*SHAPE, 3), np.float16), np.ones((*SHAPE, 3), complex),
                      np.full((*SHAPE, 3), "x"), None, object()):
            self.refused(TypeError, ["float64 or float32"], make, {"a": array})
        for name in ("", "a/b", ".a", "a\0b"):
            self.refused(ms.InputError, [], make, {name: good})
        self.refused(TypeError, ["dict"], make, [good])
        self.refused(TypeError, ["name 1"], make, {1: good})
        self.refused(ms.UsageError, [], make, {})
        self.refused(ms.UsageError, ["pi or 2pi"], make, {"a": good}, phi_d_range="tau")

    def test_samples(self):
        for value in (np.inf, 1e13):
            bad = brdf(1)
            bad[2, 3, 4, 1] = value
            self.refused(ms.InputError, ["[2, 3, 4, 1]"], ms.distance, "rmse", bad, brdf(2))
            database = ms.Database.from_arrays({"a": bad, "b": brdf(2)})
            self.refused(ms.InputError, ["a[2, 3, 4, 1]"], ms.distances, database)
            bad[2, 3, 4, 1] = 1  # the objects of before work once what was wrong is gone
            self.assertEqual(len(ms.distances(database)), 1)

    def test_arrays_that_change(self):
        arrays = {n: brdf(i) for i, n in enumerate("abc")}
        shared = ms.distances(ms.Database.from_arrays(arrays))
        copied = ms.distances(ms.Database.from_arrays(arrays, copy=True))
        arrays["b"][0, 0, 0, 0] += 1
        self.refused(ms.InputError, ["copy=True"], ms.scan, shared)
        self.assertEqual(ms.scan(copied).counts["configurations"], 3)

    def test_pairs_of_other_grids(self):
        self.refused(ms.InputError, ["12 x 10 x 16", "6 x 5 x 4"], ms.distance, "rmse", brdf(1), np.ones((6, 5, 4, 3)))

    def test_names(self):
        database = ms.Database.from_arrays({"a": brdf(1), "b": brdf(2)})
        self.refused(ms.UsageError, ["no-such"], ms.distances, database, "no-such")
        self.refused(ms.UsageError, ["twice"], ms.distances, database, ["rmse", "rmse"])
        self.refused(ms.UsageError, [], ms.distances, database, [])
        self.refused(ms.UsageError, ["white"], ms.Metric, "pawcielab:white=-1")
        self.refused(ms.InputError, ["no_such_metric"], ms.Metric, "./no_such_metric.glsl")
        self.refused(KeyError, ["c"], lambda: database["c"])
        self.refused(KeyError, ["c"], lambda: database[["a", "c"]])
        d = ms.distances(database, "rmse")
        self.refused(ms.UsageError, ["two metrics"], ms.scan, d)
        self.refused(ms.UsageError, ["cwcbrt"], ms.scan, d, "rmse", "cwcbrt")
        self.refused(ms.InputError, ["at least two"], ms.distances, database[["a"]])

    def test_options(self):
        database = ms.Database.from_arrays({"a": brdf(1), "b": brdf(2)})
        self.refused(ms.UsageError, ["threads"], ms.distances, database, threads=-1)
        self.refused(ValueError, ["memory"], ms.distances, database, memory="much")
        self.refused(ms.UsageError, [], ms.distances, database, memory=0)
        self.refused(ms.UsageError, [], ms.distances, database, memory=1)
        self.refused(ms.DeviceError, ["no-such"], ms.distances, database, device="no-such")
        self.refused(ms.UsageError, ["size"], ms.render, database["a"], size=0)
        self.refused(ms.UsageError, ["encoding"], ms.render, database["a"], size=8, encoding="x")
        self.refused(ms.UsageError, [], ms.render, database["a"], size=8, light=(0, 0, 0))
        for shape in ((1, 2), (0, 1, 1), (10**6, 1, 1), (65536, 65536, 65536)):
            self.refused(ms.Error, [], ms.grid, shape)
        self.assertEqual(len(ms.distances(database)), 1)

    def test_numbers_and_texts(self):
        """What is no number, no text or far too large is refused by the name of the argument."""
        arrays = {n: brdf(i) for i, n in enumerate("abc")}
        database = ms.Database.from_arrays(arrays)
        d = ms.distances(database, ["rmse", "cwcbrt"], device="host")
        for bad in (1.5, "2", None, True, [1]):
            self.refused(TypeError, ["threads", repr(bad)], ms.distances, database, threads=bad)
            self.refused(TypeError, ["select", repr(bad)], ms.scan, d, select=bad)
            self.refused(TypeError, ["size", repr(bad)], ms.render, database["a"], size=bad)
            self.refused(TypeError, ["shape", repr(bad)], ms.grid, (4, bad, 4))
        for far in (10**30, 10**400, -10**30):
            for memory in (far, f"{far}"):
                self.refused(ValueError, ["memory"], ms.distances, database, memory=memory)
            self.refused(ms.UsageError, ["threads"], ms.distances, database, threads=far)
            self.refused(ms.UsageError, ["disagreements"], ms.scan, d, disagreements=far)
            self.refused(ms.UsageError, ["size"], ms.render, database["a"], size=far)
            self.refused(ms.UsageError, ["shape"], ms.open, shape=(far, 4, 4))
        for shape in (5, "444", None):
            self.refused(TypeError, ["shape"], ms.grid, shape)
        for bad in (3, None):
            self.refused(TypeError, ["metric"], ms.Metric, bad)
            self.refused(TypeError, ["device"], ms.distances, database, device=bad)
            self.refused(TypeError, ["label"], ms.Database.from_arrays, arrays, label=bad)
            self.refused(TypeError, ["phi_d_range"], ms.Database.from_arrays, arrays, phi_d_range=bad)
            self.refused(TypeError, [repr(bad)], lambda: database[bad])
        self.refused(TypeError, ["Distances"], ms.scan, None)
        self.refused(TypeError, ["Distances"], ms.score, database, None)
        self.refused(TypeError, ["Judgements"], ms.score, d, None)
        self.refused(ms.UsageError, ["empty"], ms.open, "")
        for exposure in (31, -1e308, np.nan):
            self.refused(ms.UsageError, ["exposure"], ms.render, database["a"], size=8, exposure=exposure)
        self.assertEqual(len(ms.distances(database, threads=np.int64(1), memory=np.int64(1 << 20))), 3)

    def test_a_text_does_not_end_at_nul(self):
        d = ms.distances(ms.Database.from_arrays({"a": brdf(1), "b": brdf(2)}), "rmse", device="host")
        with tempfile.TemporaryDirectory() as place:
            for function in (d.to_csv, ms.open, ms.read_distances, ms.read_judgements, ms.Metric):
                self.refused(ms.UsageError, ["\\x00"], function, f"{place}/file\0.csv")
            self.assertEqual(list(pathlib.Path(place).iterdir()), [])
        self.refused(ms.UsageError, ["device"], ms.distances, d.database, device="host\0")

    def test_files(self):
        with tempfile.TemporaryDirectory() as place:
            work = pathlib.Path(place)
            self.refused(ms.InputError, ["none"], ms.open, work / "none")
            self.refused(ms.InputError, [], ms.read_distances, work / "none.csv")
            (work / "bad.csv").write_text("reference,a\n")
            self.refused(ms.InputError, ["bad.csv"], ms.read_judgements, work / "bad.csv")
            (work / "x.binary").write_bytes(b"no MERL file")
            self.refused(ms.InputError, ["x.binary"], ms.open, work)
            d = ms.distances(ms.Database.from_arrays({"a": brdf(1), "b": brdf(2)}), "rmse")
            self.refused(ms.OutputError, ["none/d.csv"], d.to_csv, work / "none/d.csv")

    def test_made_up_judgements(self):
        d = ms.distances(ms.Database.from_arrays({n: brdf(i) for i, n in enumerate("abc")}), ["rmse", "cwcbrt"])
        for row in ([0, 1, 0, 3, 1, 0, 0], [0, 0, 1, 2, 1, 0, 0], [0, 1, 1, 0, 1, 0, 0], [0, 1, 0, 2, 2**40, 0, 0]):
            self.refused(ValueError, ["rows of judgements"], ms.score, d, ms.Judgements("f", "f", list("abc"), np.array([row], np.uint64)))
        self.refused(ValueError, ["rows of judgements"], ms.score, d, ms.Judgements("f", "f", list("abc"), np.zeros(7, np.uint64)))
        row = np.array([[0, 1, 0, 2, 1, 0, 0]])
        self.refused(ValueError, ["twice"], ms.score, d, ms.Judgements("f", "f", list("aab"), row))
        for rows in (row + 0.5, "x", [["x"] * 7], None):
            self.refused(TypeError, ["rows of judgements"], ms.score, d, ms.Judgements("f", "f", list("abc"), rows))
        self.refused(ValueError, ["rows of judgements"], ms.score, d, ms.Judgements("f", "f", list("abc"), -row))
        good = ms.Judgements("f", "f", list("abc"), np.array([[0, 1, 0, 2, 3, 0, 1]], np.uint64))
        self.assertEqual(ms.score(d, good).votes, 4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
