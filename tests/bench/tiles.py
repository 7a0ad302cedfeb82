"""What tiles and ranks take: tiles.py MERL_SCAN [DATABASE].

Computes the distances of CWCbrt and PAWCIELAB in tiles with `merl-scan distances`, alone, in three parts one
after the other, and with 1, 2 and 4 ranks of MPI where mpirun is. Before a figure is printed its folder
is compared with that of the run alone: every byte of every array. On one machine ranks share its cores,
so it is that comparison, and the processor time, that say something. Standard library only.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

RANKS = 1, 2, 4
PARTS = 3


def timed(commands, cwd):
    """Wall-clock seconds, and the processor's with those of ranks, of commands one after the other."""
    start, before = time.perf_counter(), os.times()
    for command in commands:
        result = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            sys.exit(f"{' '.join(command)}: status {result.returncode}\n{result.stderr}")
    after = os.times()
    processor = sum(getattr(after, part) - getattr(before, part) for part in ("children_user", "children_system"))
    return time.perf_counter() - start, processor


def arrays(folder):
    """The bytes of every array of a folder, by name."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*.npy"))}


def main():
    program = str(pathlib.Path(sys.argv[1]).resolve())
    command = [program, "distances", "--metrics", "cwcbrt,pawcielab", "--device", "host", "--quiet"]
    command += ["--database", str(pathlib.Path(sys.argv[2]).resolve())] if len(sys.argv) > 2 else []
    ways = {"alone": [command]}
    ways[f"{PARTS} parts, one after the other"] = [[*command, "--part", f"{k}/{PARTS}"] for k in range(1, PARTS + 1)]
    mpirun = shutil.which("mpirun")
    if mpirun:
        as_root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
        for ranks in RANKS:
            ways[f"{ranks} ranks"] = [[mpirun, *as_root, "--oversubscribe", "-n", str(ranks), *command]]
    print("\nDistances in tiles")
    with tempfile.TemporaryDirectory() as directory:
        expected = None
        for number, (name, commands) in enumerate(ways.items()):
            folder = pathlib.Path(directory, str(number))
            wall, processor = timed([[*one, "--out", str(folder)] for one in commands], directory)
            found = arrays(folder)
            expected = expected or found
            if not found or found != expected:
                sys.exit(f"{name}: other tiles than those of one process")
            print(f"{name:<40}{wall:>8.2f} s {processor:>8.2f} s of the processor, {processor / len(found):.3f} a file"
                  f"  ({len(found)} files, the same bytes)")
    if not mpirun:
        print("no mpirun: no ranks (apt-get install openmpi-bin libopenmpi-dev)")


if __name__ == "__main__":
    main()
