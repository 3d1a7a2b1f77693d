#!/usr/bin/env bash
# The reference of the public headers by Doxygen, and a check of README.md and docs/:
#   scripts/docs.sh [DIR]        writes DIR/html (default: out/docs below the project); a warning is an error
set -euo pipefail
if [[ ${1:-} == -h || ${1:-} == --help ]]; then
  sed -n '2,3s/^# \{0,1\}//p' "$0"
  exit 0
fi
out=$(realpath -m "${1:-$(dirname "${BASH_SOURCE[0]}")/../out/docs}")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
/usr/bin/env python3 scripts/check_docs.py
command -v doxygen >/dev/null || { echo "doxygen is missing; install it with: apt-get install doxygen" >&2; exit 1; }
mkdir -p "$out"
export PLANAR_MAPPING_DOCS_DIR=$out
doxygen docs/Doxyfile
echo "$out/html/index.html"
