#!/usr/bin/env bash
# The tree is formatted as .clang-format says and passes .clang-tidy. Needs a configured
# build/release; `scripts/lint.sh --fix` formats instead of complaining.
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t sources < <(git ls-files '*.cpp' '*.h')
if [ "${1:-}" = --fix ]; then
    exec clang-format -i "${sources[@]}"
fi
clang-format --dry-run --Werror "${sources[@]}"
git ls-files 'app/*.cpp' 'engine/*.cpp' 'scan/*.cpp' |
    xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet 2>/dev/null
