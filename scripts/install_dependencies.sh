#!/usr/bin/env bash
# Installs the Debian packages the project builds and is tested with; does nothing when all are there.
#   scripts/install_dependencies.sh [--build-only | --fuzz]     without what only tests need, or with clang as well
# Works as root or with sudo. PLANAR_MAPPING_NO_APT=1 forbids installing: then it only checks.
set -euo pipefail

packages=(
  build-essential cmake ninja-build
  libeigen3-dev libzstd-dev libpcl-dev libyaml-cpp-dev libcli11-dev nlohmann-json3-dev libpng-dev liblzf-dev
  libvtk9-dev libglew-dev libegl-dev libx11-dev
  libopencv-dev libturbojpeg0-dev libzmq3-dev cppzmq-dev libceres-dev libsqlite3-dev
  liboctomap-dev libjs-three
  libegl1 libgl1-mesa-dri
  libgtest-dev libbenchmark-dev
  python3 python3-dev python3-numpy pybind11-dev
  file help2man  # packages, manual pages
)
# Without one of these its tests are left out.
test_packages=(
  clang-format clang-tidy xvfb xauth doxygen librapidcheck-dev
  python3-zstandard python3-pytest python3-matplotlib python3-pandas
  libassimp-dev liburdfdom-dev liburdfdom-tools libsdformat-dev octomap-tools libfcl-dev python3-open3d python3-ezdxf librsvg2-bin chromium  # readers of exports
  python3-distributed parallel                                                          # planar_mapping.cluster, examples/cluster
  libroscpp-dev libvisualization-msgs-dev libnav-msgs-dev                               # examples/ros1
)
case ${1:-} in
  "") packages+=("${test_packages[@]}") ;;
  --build-only) ;;
  --fuzz) packages+=("${test_packages[@]}" clang libclang-rt-14-dev) ;;
  *) sed -n '2,4s/^# \{0,1\}//p' "$0"; exit 2 ;;
esac

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f='${Status}' "$package" 2>/dev/null || true)
  [[ $status == "install ok installed" ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

explain() {
  echo "These Debian packages are missing: ${missing[*]}" >&2
  echo "$1 Install them with: apt-get install --no-install-recommends ${missing[*]}" >&2
  exit 1
}
command -v apt-get >/dev/null || explain "There is no apt-get on this machine."
[[ -z ${PLANAR_MAPPING_NO_APT:-} ]] || explain "PLANAR_MAPPING_NO_APT forbids installing."

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || explain "You are not root and there is no sudo."
  sudo -n true 2>/dev/null || [[ -t 0 ]] || explain "sudo wants a password and there is no terminal to ask at."
  as_root=(sudo)
fi

echo "Installing ${#missing[@]} Debian packages: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -qq ||
  explain "apt-get update failed (no network, or apt is not allowed here)."
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null ||
  explain "apt-get install failed."
