#!/usr/bin/env bash
# From a fresh clone on Debian 12 to the first disagreement table: installs what is missing, builds,
# and scans the built-in database. Arguments go to `merl-scan scan`.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/setup.sh
build/release/merl-scan scan --force "$@"
