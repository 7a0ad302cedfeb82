#!/usr/bin/env bash
# Times the stages of a scan and other programs at the same work, then whole runs, and prints the
# ratios that count: medians of five. On the built-in database, or a directory of MERL files:
#     scripts/bench.sh [DIRECTORY]
# On a quiet machine; five minutes on two cores. docs/performance.md says what is measured.
set -euo pipefail
database=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."

scripts/setup.sh tests
build/release/merl-scan-bench ${database:+--database "$database"} \
    --benchmark_repetitions=5 --benchmark_report_aggregates_only=true \
    --benchmark_out=build/release/bench.json --benchmark_out_format=json
python3 tests/bench/ratios.py build/release/bench.json build/release/merl-scan ${database:+"$database"}
python3 tests/bench/tiles.py build/release/merl-scan ${database:+"$database"}
