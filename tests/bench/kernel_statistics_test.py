"""The kernels compile for a GPU that is not there, and the statistics say when registers do not suffice.

usage: kernel_statistics_test.py MERL_SCAN_KERNELS MANIFEST

MANIFEST is that of Mesa's driver of AMD's GPUs, which has devices that only compile."""

import csv
import os
import subprocess
import sys


def main():
    program, manifest = sys.argv[1:]
    if not os.path.exists(manifest):
        sys.exit(f"no driver of AMD's GPUs: found \"{manifest}\", expected radeon_icd*.json in "
                 "/usr/share/vulkan/icd.d; install mesa-vulkan-drivers (scripts/setup.sh) and configure again")
    ran = subprocess.run(
        [program, "--metrics", "cwcbrt", "--sides", "4,12"], capture_output=True, text=True,
        env={**os.environ, "VK_ICD_FILENAMES": manifest, "VK_DRIVER_FILES": manifest,
             "RADV_FORCE_FAMILY": "navi21"})
    assert ran.returncode == 0, ran.stderr
    rows = list(csv.DictReader(ran.stdout.splitlines()))
    assert all(int(row["Code size"]) > 0 for row in rows), ran.stdout
    of_pairs = [row for row in rows if row["kernel"] == "difference"]
    found = sorted((row["side"], row["subgroup"], row["Spilled VGPRs"] != "0") for row in of_pairs)
    expected = [("12", "32", True), ("12", "64", True), ("4", "32", False), ("4", "64", False)]
    assert found == expected, f"side, subgroup, spills: {found}, expected {expected}"
    assert {row["kernel"] for row in rows} >= {"weigh", "prepare", "ranges", "slopes"}, ran.stdout


if __name__ == "__main__":
    main()
