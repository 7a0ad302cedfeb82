"""Arrays as databases: layouts, types, what was not measured; distances by NumPy's own sums."""

import copy
import pickle
import unittest

import numpy as np

import merl_scan as ms

SHAPE = (12, 10, 16)


def brdf(seed, dtype=np.float64):
    return np.random.default_rng(seed).lognormal(-1, 1, (*SHAPE, 3)).astype(dtype)


def rmse(a, b):
    """The metric rmse in a line: what is not measured counts as 0, what is below the horizon not."""
    above = ms.grid(a.shape[:3]).above_horizon[..., np.newaxis]
    a, b = (np.where(np.nan_to_num(f, nan=-1) > 0, f, 0).astype(float) for f in (a, b))
    return np.sqrt((above * (a - b) ** 2).sum() / (a.size / 3))


class Arrays(unittest.TestCase):
    def test_distance_is_that_of_numpy(self):
        for dtype in (np.float64, np.float32):
            a, b = brdf(1, dtype), brdf(2, dtype)
            self.assertAlmostEqual(ms.distance("rmse", a, b) / rmse(a, b), 1, delta=1e-13)

    def test_layouts_have_the_same_bits(self):
        a, b = brdf(1), brdf(2)
        expected = ms.distance("pawcielab", a, b)
        read_only = a.copy()
        read_only.flags.writeable = False
        misaligned = np.frombuffer(b"x" + a.tobytes(), np.uint8)[1:].view(np.float64).reshape(a.shape)
        wide = np.zeros((*SHAPE, 5))
        wide[..., 1:4] = a
        for same in (np.asfortranarray(a), read_only, misaligned, wide[..., 1:4], a[::-1].copy()[::-1],
                     np.ascontiguousarray(a[..., ::-1])[..., ::-1], a.astype(">f8"), a.tolist(),
                     np.moveaxis(np.ascontiguousarray(np.moveaxis(a, -1, 0)), 0, -1)):
            self.assertEqual(ms.distance("pawcielab", same, b), expected)

    def test_what_is_not_measured(self):
        a, b = brdf(1), brdf(2)
        negative, nan, zero = a.copy(), a.copy(), a.copy()
        negative[3, 2, ::3, 1] = -5
        nan[3, 2, ::3, 1] = np.nan
        zero[3, 2, ::3, 1] = 0
        distances = [ms.distance("rmse", f, b) for f in (negative, nan, zero)]
        self.assertEqual(len(set(distances)), 1)
        database = ms.Database.from_arrays({"a": nan, "b": b})
        d = ms.distances(database, ["rmse"])
        self.assertGreater(d.provenance["database"]["materials"]["a"]["negative"], 0)
        np.testing.assert_array_equal(database["a"].samples(), nan)
        # A summary leaves them out of its means instead.
        self.assertNotEqual(ms.distance("nielsen-log", nan, b), 0)

    def test_distance_has_the_bits_of_refined_ones(self):
        arrays = {name: brdf(i) for i, name in enumerate("abcdef")}
        d = ms.distances(ms.Database.from_arrays(arrays), ["rmse", "pawcielab"], device="host")
        s = ms.scan(d)
        self.assertTrue(s.exact)
        checked = 0
        for metric in d.metrics:
            kept = ms.Metric(metric)
            for (i, j), value, bound in zip(d.pairs, s.values[metric], s.bounds[metric]):
                exact = kept.distance(arrays[d.names[i]], arrays[d.names[j]])
                self.assertLessEqual(abs(exact - value), bound)
                checked += bound == 0
        self.assertGreater(checked, 5)

    def test_tiny_and_equal_materials(self):
        a, b = brdf(1), brdf(2)
        self.assertEqual(ms.distance("rmse", a, a.copy()), 0)
        self.assertAlmostEqual(ms.distance("rmse", 1e-200 * a, 1e-200 * b) / (1e-200 * rmse(a, b)), 1, delta=1e-12)

    def test_names_and_matrix(self):
        names = ["z", "é", "a b", "\udcff"]
        d = ms.distances(ms.Database.from_arrays({n: brdf(i) for i, n in enumerate(names)}), "cwcbrt")
        self.assertEqual(d.names, sorted(names, key=lambda n: n.encode("utf-8", "surrogateescape")))
        m = d.matrix("cwcbrt")
        for p, (i, j) in enumerate(d.pairs):
            self.assertEqual((m[i, j], m[j, i]), (d["cwcbrt"][p],) * 2)
        self.assertEqual(np.diag(m).tolist(), [0] * 4)

    def test_joins_and_parts(self):
        mine = ms.Database.from_arrays({"a": brdf(1), "chrome": brdf(2)}, label="mine")
        both = ms.open("abc=built-in", materials=["chrome", "gold-paint"]) + mine
        self.assertEqual(both.materials, ["abc/chrome", "abc/gold-paint", "mine/a", "mine/chrome"])
        self.assertEqual(both.shape, SHAPE)  # the stand-in is evaluated on the grid of the arrays
        some = both[["mine/chrome", "abc/chrome"]]
        self.assertEqual(some.materials, ["abc/chrome", "mine/chrome"])
        np.testing.assert_array_equal(some["mine/chrome"].samples(), brdf(2))
        for again in (pickle.loads(pickle.dumps(some)), copy.copy(some), copy.deepcopy(some)):
            self.assertEqual(again.content_hash(), some.content_hash())
        with self.assertRaises(ms.UsageError):
            mine + mine
        self.assertIn("4 materials", repr(both))

    def test_pickles(self):
        d = ms.distances(ms.Database.from_arrays({n: brdf(i) for i, n in enumerate("abc")}), ["rmse", "cwcbrt"])
        again = pickle.loads(pickle.dumps(d))
        np.testing.assert_array_equal(again["rmse"], d["rmse"])
        self.assertEqual(pickle.loads(pickle.dumps(ms.scan(again))).counts, ms.scan(d).counts)
        self.assertEqual(pickle.loads(pickle.dumps(ms.Metric("pawcielab:white=80"))).name, "pawcielab:white=80")

    def test_directions_of_the_grid(self):
        for g in (ms.grid(SHAPE), ms.grid(SHAPE, "2pi")):
            np.testing.assert_allclose(g.light[..., 2], g.cos_theta_i, atol=1e-14)
            np.testing.assert_allclose(g.view[..., 2], g.cos_theta_o, atol=1e-14)
            np.testing.assert_allclose((g.light * g.view).sum(-1), np.cos(2 * g.theta_d), atol=1e-14)
        half = SHAPE[2] // 2
        np.testing.assert_allclose(g.light[:, :, :half, 2], g.view[:, :, half:, 2], atol=1e-14)


if __name__ == "__main__":
    unittest.main(verbosity=2)
