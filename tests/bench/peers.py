"""The pair sums of the benchmark by NumPy and SciPy: peers.py WAY GRID REAL MATERIALS SUMS.

GRID is a file of REAL (float32 or float64), [block][material][3 * 1024]. Writes the sum of every pair in float64 to
the file SUMS and prints the seconds it took, reading and rearranging not counted.
"""

import sys
import time

import numpy as np
from scipy.spatial.distance import pdist


def pair_at_a_time(difference):
    def sums(x):
        n = len(x)
        return [difference(x[i] - x[j]) for i in range(n) for j in range(i + 1, n)]

    return sums


WAYS = {
    "numpy-cwcbrt": pair_at_a_time(lambda d: np.cbrt(d * d).sum()),
    "numpy-pawcielab": pair_at_a_time(lambda d: (d * d).sum()),
    "scipy-cwcbrt": lambda x: pdist(x, "minkowski", p=2 / 3) ** (2 / 3),
    "scipy-pawcielab": lambda x: pdist(x, "sqeuclidean"),
}

way, grid, real, materials, out = sys.argv[1:]
blocks = np.fromfile(grid, dtype=real).reshape(-1, int(materials), 3 * 1024)
x = np.ascontiguousarray(blocks.transpose(1, 0, 2)).reshape(int(materials), -1)
start = time.perf_counter()
sums = WAYS[way](x)
print(time.perf_counter() - start)
np.asarray(sums, dtype=np.float64).tofile(out)
