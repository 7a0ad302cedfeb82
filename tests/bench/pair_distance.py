"""How long one distance of two arrays takes, beside the line of NumPy that one would write.

usage: PYTHONPATH=build/release/python python3 tests/bench/pair_distance.py

On the grid of MERL, in turns; medians of 31, wall clock and processor time of all threads."""

import time

import numpy as np

import merl_scan as ms

database = ms.open(materials=["gold-paint", "chrome"])
a, b = (database[name].samples() for name in database)
weight = np.where(ms.grid().above_horizon, 1.0, 0.0)[..., np.newaxis]
contenders = {"NumPy, RMSE": lambda: np.sqrt((weight * (a - b) ** 2).sum() / weight.size)}
for name in ("rmse", "pawcielab", "cwcbrt"):
    metric = ms.Metric(name)
    metric.distance(a, b)  # prepares it
    contenders[name] = lambda metric=metric: metric.distance(a, b)
f, g = a.astype(np.float32), b.astype(np.float32)
contenders["rmse, float32"] = lambda metric=ms.Metric("rmse"): metric.distance(f, g)
taken = {name: [] for name in contenders}
for _ in range(32):
    for name, call in contenders.items():
        wall, processor = time.perf_counter(), time.process_time()
        call()
        taken[name].append((time.perf_counter() - wall, time.process_time() - processor))
for name, times in taken.items():
    wall, processor = 1e3 * np.median(times[1:], axis=0)
    print(f"{name:15} {wall:6.1f} ms, processor {processor:6.1f} ms")
