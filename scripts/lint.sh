#!/usr/bin/env bash
# The tree is formatted as .clang-format says and passes .clang-tidy. Needs build/release,
# built; `scripts/lint.sh --fix` formats instead of complaining.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t sources < <(find app engine scan tests -name '*.cpp' -o -name '*.h' | sort)
if [ "${1:-}" = --fix ]; then
    exec clang-format -i "${sources[@]}"
fi
clang-format --dry-run --Werror "${sources[@]}"
python3 -B scripts/lint.py build/release
