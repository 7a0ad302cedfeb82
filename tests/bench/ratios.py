"""What the figures of the benchmark come to: ratios.py BENCH_JSON MERL_SCAN [DATABASE].

Reads the medians that merl-scan-bench wrote, runs `merl-scan scan --disagreements 0` five times, and prints each
ratio beside what is wanted of it. Standard library only.
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

RUNS = 5


def medians(path):
    """Benchmarks by name: their medians, or the only repetition."""
    result = {}
    for row in json.loads(pathlib.Path(path).read_text())["benchmarks"]:
        if row.get("error_occurred"):
            sys.exit(f"{row['name']}: {row['error_message']}")
        if row["run_type"] == "iteration" or row["aggregate_name"] == "median":
            for part in ("iterations:1", "repeats:5", "real_time", "manual_time"):
                row["run_name"] = row["run_name"].replace("/" + part, "")
            result[row["run_name"]] = row
    return result


def seconds(row):
    return row["real_time"] * {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[row["time_unit"]]


def line(what, value, wanted=""):
    print(f"{what:<64}{value:>16}  {wanted}")


def whole_run(program, database):
    """Wall-clock seconds, the parts of them, and the most memory of the process in MiB."""
    with tempfile.TemporaryDirectory() as directory:
        command = [program, "scan", "--disagreements", "0", "--quiet", "--out", f"{directory}/out"]
        command += ["--database", database] if database else []
        start = time.perf_counter()
        process = subprocess.Popen(command)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - start
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            sys.exit(f"{' '.join(command)}: status {process.returncode}")
        summary = json.loads(pathlib.Path(directory, "out/summary.json").read_text())
    stages, inner = summary["seconds"], summary["distance_seconds"]
    parts = {
        "reading": inner["reading"],
        "transform on the device": inner["device_transform"],
        "difference": inner["difference"],
        "refine": stages["refine"],
        "opening the device": stages["device"],
        "kernels, buffers": inner["kernels"],
        "adding partial sums": inner["adding"],
        "count, select, write": sum(stages[name] for name in ("count", "select", "list", "write")),
        "start, summary, end": wall - stages["total"],
    }
    return wall, parts, usage.ru_maxrss / 1024


def print_peers(bench):
    """Other programs start from transformed samples in memory, as our difference does."""
    metrics = ("cwcbrt", "pawcielab")
    stages = {metric: bench[f"distances/{metric}"] for metric in metrics}
    wanted = {"openmp-float64-O3": ">= 30", "numpy-float32": ">= 30", "openmp-float32-Ofast": ">= 1"}
    print("Distances, whole database (other programs scaled from their share of it)")
    for name in (*metrics, "both"):
        stage = bench[f"distances/{name}"]
        line(f"{name}: difference", f"{stage['difference_s']:.2f} s")
    line("both, in shaders only: difference", f"{bench['distances/shaders']['difference_s']:.2f} s")
    print("seconds and times our difference")
    programs = dict.fromkeys(name.split("/")[1] for name in bench if name.startswith("peer/"))
    for names in (("cwcbrt",), ("pawcielab",), metrics):
        difference = sum(stages[name]["difference_s"] for name in names)
        for program in programs:
            peer = sum(bench[f"peer/{program}/{name}"]["whole_s"] for name in names)
            hope = f"wanted {wanted[program]}" if len(names) == 2 and program in wanted else ""
            line(
                f"  {' and '.join(names)}: {program}, {peer:.2f} s",
                f"{peer / difference:.1f}",
                hope,
            )


def print_scan(bench):
    print("\nCounting, selecting, writing")
    for name, wanted in (
        ("count/streaming", "< 10 ms"),
        ("count/inversions", "< 2 ms"),
        ("select", ""),
        ("count/of-1000", ""),
        ("select/of-1000", ""),
    ):
        line(name, f"{1e3 * seconds(bench[name]):.2f} ms", wanted)
    many = seconds(bench["count/of-1000"]) + seconds(bench["select/of-1000"])
    line("1,000 materials, count and selection", f"{many:.2f} s", "< 2 s")
    line("disagreements.csv", f"{bench['csv']['bytes_per_second'] / 1e6:.0f} MB/s", ">= 400 MB/s")

    print("\nGrowth: difference of both metrics, a pair and voxel")
    growth = {name: row for name, row in bench.items() if name.startswith("scale/")}
    for name, row in growth.items():
        line(f"{name[6:]} materials", f"{row['difference_ps']:.0f} ps", f"slabs of {row['slabs_MiB']:.0f} MiB")
    times = [row["difference_ps"] for row in growth.values()]
    line("slowest over fastest", f"{max(times) / min(times):.2f} times", "1")


def print_whole(program, database):
    runs = [whole_run(program, database) for _ in range(RUNS)]
    wall = statistics.median(run[0] for run in runs)
    parts = {name: statistics.median(run[1][name] for run in runs) for name in runs[0][1]}
    print("\nWhole run, files to selection, --disagreements 0")
    line("wall clock", f"{wall:.2f} s")
    for name, value in parts.items():
        line(f"  {name}", f"{value:.3f} s", f"{100 * value / wall:.1f} % of the run")
    line("whole run over the sum of its stages", f"{wall / sum(parts.values()):.2f}", "<= 1.3")
    names = list(parts)
    others = {name: parts[name] for name in names[names.index("opening the device") :]}
    largest = max(others, key=others.get)
    line("largest part but reading and arithmetic", f"{100 * others[largest] / wall:.1f} %", f"<= 10 %: {largest}")
    start = sum(parts[name] for name in ("opening the device", "kernels, buffers"))
    line("start-up: device and kernels", f"{start:.2f} s", "< 0.5 s")
    line("most memory of the process", f"{max(run[2] for run in runs):.0f} MiB", "--memory is 1,024 MiB")


if __name__ == "__main__":
    figures = medians(sys.argv[1])
    print_peers(figures)
    print_scan(figures)
    print_whole(sys.argv[2], sys.argv[3] if len(sys.argv) > 3 else None)
