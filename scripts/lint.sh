#!/usr/bin/env bash
# Form of the sources: clang-format over all, clang-tidy over what changed.
#   scripts/lint.sh [BASE]     BASE: what changes are counted from, default the commit before the last
#   scripts/lint.sh --fix      formats in place
# clang-tidy takes seconds a file: of more than 6 changed sources it reads the 6 with most changed lines.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1:-} in
  -h | --help) sed -n '2,5s/^# \{0,1\}//p' "$0"; exit 0 ;;
  --fix) git ls-files '*.h' '*.hpp' '*.cpp' | xargs clang-format -i; exit 0 ;;
esac
for program in clang-format clang-tidy; do
  command -v "$program" >/dev/null || { echo "lint: $program is missing, form is not checked (apt-get install $program)" >&2; exit 0; }
done
if ! git rev-parse --git-dir >/dev/null 2>&1; then
  echo "lint: no repository, form is not checked" >&2
  exit 0
fi
git ls-files '*.h' '*.hpp' '*.cpp' | xargs clang-format --dry-run --Werror ||
  { echo "lint: run scripts/lint.sh --fix" >&2; exit 1; }

base=${1:-HEAD~1}
git rev-parse -q --verify "$base" >/dev/null || exit 0  # a clone of one commit
mapfile -t changed < <(git diff --numstat --diff-filter=AM "$base" -- 'src/*.cpp' 'filters/*.cpp' 'segmentation/*.cpp' 'surface/*.cpp' \
  'evaluation/*.cpp' 'tools/*.cpp' | sort -rn | cut -f3 | head -6)
[[ ${#changed[@]} -gt 0 ]] || exit 0
# Compile commands of single sources without precompiled headers, which clang cannot read.
cmake -S . -B build-lint -G Ninja -DCMAKE_EXPORT_COMPILE_COMMANDS=ON -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
  -DPLANAR_MAPPING_UNITY_BUILD=OFF -DPLANAR_MAPPING_BUILD_TESTS=OFF -DPLANAR_MAPPING_BUILD_EXAMPLES=OFF >/dev/null
printf '%s\n' "${changed[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy -p build-lint --quiet --warnings-as-errors='*' 2>/dev/null
