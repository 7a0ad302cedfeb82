#!/usr/bin/env bash
# From a fresh clone on Debian 12 to the first disagreement table: installs what the program needs,
# builds it, and scans the built-in database. Arguments go to `merl-scan scan`.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh program
build/release/merl-scan scan --force "$@"
