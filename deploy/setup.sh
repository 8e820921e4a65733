#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what deploy/packages.txt lists and this machine lacks (Debian 12), then configures and builds.
#   deploy/setup.sh [services|all|fuzz]     default: services, without tests; fuzz: packages of tests/fuzz/run.sh, no build
# ZERODRIFT_BUILD_DIR names the build folder (default: build/release).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
what=${1:-services}
case $what in
  services) sections=1 ;;
  all) sections=2 ;;
  fuzz) sections=3 ;;
  *) echo "setup: found '$what', expected services, all or fuzz" >&2; exit 2 ;;
esac
build=${ZERODRIFT_BUILD_DIR:-$root/build/release}

missing=()
while read -r package; do
  case "$package" in
    '# --- '*) sections=$((sections - 1)); [ "$sections" -gt 0 ] || break ;;
    ''|'#'*) ;;
    *) dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package") ;;
  esac
done < "$root/deploy/packages.txt"
if [ ${#missing[@]} -gt 0 ]; then
  sudo=
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "setup: run as root, or install sudo, to install: ${missing[*]}" >&2; exit 2; }
    sudo=sudo
  fi
  echo "setup: installing ${missing[*]}"
  $sudo mkdir -p /usr/share/man/man1   # Java's package fails on slim systems without it
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get update -qq
  $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

[ "$what" != fuzz ] || exit 0
mkdir -p "$build"
jobs=$(nproc)
# PATH begins with Debian's own tools, so that the compiler is the one that was installed above.
export PATH=/usr/bin:$PATH
targets=(compensation gyro_publisher thermal_publisher allan_monitor zerodrift)
tests=OFF  # their packages are not there
if [ "$what" = all ]; then targets=(all) tests=ON; fi
cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DZERODRIFT_BUILD_TESTS=$tests \
  > "$build/configure.log" 2>&1 || { cat "$build/configure.log" >&2; exit 2; }
cmake --build "$build" -j "$jobs" --target "${targets[@]}"
