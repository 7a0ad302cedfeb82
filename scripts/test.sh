#!/usr/bin/env bash
# From a fresh clone on Debian 12: installs what is missing, builds, checks the style, and passes
# every test on lavapipe. Arguments go to CMake.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh tests "$@"
scripts/lint.sh
ctest --preset release -j "$(nproc)"
