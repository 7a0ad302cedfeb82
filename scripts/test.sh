#!/usr/bin/env bash
# From a fresh clone on Debian 12: installs what is missing, builds with warnings as errors, checks
# the style, and passes every test on lavapipe. This is what CI runs.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh -DMERL_SCAN_WERROR=ON
scripts/lint.sh
ctest --preset release -j "$(nproc)"
