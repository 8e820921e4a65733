#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs what deploy/packages.txt lists and this machine lacks (Debian 12), configures, builds, and links `zerodrift` into
# /usr/local/bin (link.sh).
#   deploy/setup.sh [run|services|all|fuzz|containers]     default: services, without tests
# run: what a run in simulation needs, which takes the compiler half as long as all services.
# fuzz, containers: the packages of tests/fuzz/run.sh and of tests/containers/run.sh, no build.
# ZERODRIFT_BUILD_DIR names the build folder (default: build/release).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
what=${1:-services}
case $what in
  run|services) sections='build' ;;
  all) sections='build tests' ;;
  fuzz) sections='build tests fuzz' ;;
  containers) sections='containers' ;;
  *) echo "setup: found '$what', expected run, services, all, fuzz or containers" >&2; exit 2 ;;
esac
build=${ZERODRIFT_BUILD_DIR:-$root/build/release}

missing=()
section=build
while read -r package; do
  case "$package" in '# --- '*) section=${package#\# --- }; section=${section%%:*} ;; esac
  case " $sections " in *" $section "*) ;; *) continue ;; esac
  case "$package" in
    ''|'#'*) ;;
    npm) command -v npm >/dev/null || missing+=(npm) ;;  # others' nodejs packages bring it, and conflict with Debian's
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

case $what in fuzz|containers) exit 0 ;; esac
mkdir -p "$build"
jobs=$(nproc)
# PATH begins with Debian's own tools, so that the compiler is the one that was installed above.
export PATH=/usr/bin:$PATH
targets=(compensation gyro_publisher thermal_publisher allan_monitor ctl)
[ "$what" = run ] || targets+=(navigation_filter console console_page discovery_server zerodrift man_pages)
tests=OFF  # their packages are not there
if [ "$what" = all ]; then targets=(all) tests=ON; fi
cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=Release -DZERODRIFT_BUILD_TESTS=$tests -DZERODRIFT_UNITY=ON \
  > "$build/configure.log" 2>&1 || { cat "$build/configure.log" >&2; exit 2; }
cmake --build "$build" -j "$jobs" --target "${targets[@]}"
[ "$what" = run ] || "$root/deploy/link.sh" "$build/bin/zerodrift"
