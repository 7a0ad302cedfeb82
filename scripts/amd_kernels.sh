#!/usr/bin/env bash
# What Mesa's driver of AMD's GPUs makes of the kernels: registers, spills, size of the code, as CSV. It
# compiles for a GPU that is not there and runs nothing:
#     scripts/amd_kernels.sh [--families LIST] [--sides LIST] [--metrics LIST]
# Lists have commas. A family is what Mesa calls it, such as polaris10 (GCN 4), vega10 (GCN 5), navi10
# (RDNA 1), navi21 (RDNA 2) and gfx1100 (RDNA 3). docs/performance.md has figures and what follows.
set -euo pipefail
cd "$(dirname "$0")/.."

families=polaris10,vega10,navi10,navi21,gfx1100
options=()
while [ $# -gt 0 ]; do
    case "$1" in
    --families) families=${2:?"$0: --families needs a list"} ;;
    --sides | --metrics) options+=("$1" "${2:?"$0: $1 needs a list"}") ;;
    *)
        echo "$0: found \"$1\"; expected --families, --sides or --metrics, each with a list" >&2
        exit 2
        ;;
    esac
    shift 2
done

scripts/setup.sh tests >&2
program=build/release/merl-scan-kernels
# Debian's package has the first, other systems' often the second.
for driver in /usr/share/vulkan/icd.d/radeon_icd{".$(uname -m)",}.json; do
    [ -e "$driver" ] && break
done
[ -e "$driver" ] || {
    echo "$0: there is no $driver, so no driver of AMD's GPUs: install mesa-vulkan-drivers" >&2
    exit 1
}
lines=1  # the first family's CSV has the header
for family in ${families//,/ }; do
    VK_ICD_FILENAMES=$driver VK_DRIVER_FILES=$driver RADV_FORCE_FAMILY=$family \
        "$program" "${options[@]}" | tail -n "+$lines"
    lines=2
done
