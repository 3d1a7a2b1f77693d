#!/usr/bin/env bash
# Builds the Debian packages and a Python wheel into out/packages.
#   scripts/package.sh [BUILD]     BUILD: a build tree that is there already, in place of build/
set -euo pipefail
case ${1:-} in
  -h | --help) sed -n '2,3s/^# \{0,1\}//p' "$0"; exit 0 ;;
  "") ;;
  *) build=$(realpath "$1") ;;
esac
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [[ -z ${build:-} ]]; then
  scripts/build.sh release
  build=$PWD/build
fi
rm -rf out/packages
cpack --config "$build/CPackConfig.cmake" -B out/packages >/dev/null
rm -rf out/packages/_CPack_Packages
ls out/packages/*.deb
if [[ -e $build/python/planar_mapping/__init__.py ]]; then
  scripts/wheel.py "$build" out/packages
fi
echo "Install them with: apt-get install ./out/packages/*.deb"
