#!/usr/bin/env bash
# The tree is formatted as .clang-format says and passes .clang-tidy. Needs a configured
# build/release; `scripts/lint.sh --fix` formats instead of complaining.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t sources < <(find app engine scan tests -name '*.cpp' -o -name '*.h' | sort)
if [ "${1:-}" = --fix ]; then
    exec clang-format -i "${sources[@]}"
fi
clang-format --dry-run --Werror "${sources[@]}"
find app engine scan -name '*.cpp' | sort |
    xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet 2>/dev/null
