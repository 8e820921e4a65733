#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# development_test.sh BUILD_DIR COMPILER: a program of somebody else's uses the installed libraries, by CMake and by pkg-config. A
# line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
build=$1 compiler=$2
root=$(cd "$(dirname "$0")/../.." && pwd)
example=$root/examples/noise_of_a_gyro
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_development.XXXXXX")
trap 'rm -rf "$work"' EXIT
prefix=$work/opt
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
# Nothing of the checkout is seen: it is built from a copy, and the installation is moved after it was made.
installs() {
  cmake --install "$build" --component development --prefix "$work/made" && mv "$work/made" "$prefix" && cp -r "$example" "$work/example" &&
    ! grep -rlF "$root" "$prefix/lib/cmake" "$prefix/lib/pkgconfig" "$prefix/include"
}
builds_by_cmake() {
  cmake -S "$work/example" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Release &&
    cmake --build "$work/cmake"
}
builds_by_pkg_config() {
  # shellcheck disable=SC2046  # a word each
  "$compiler" -O2 "$example/noise_of_a_gyro.cpp" -o "$work/by_pkg_config" \
    $(PKG_CONFIG_PATH=$prefix/lib/pkgconfig pkg-config --cflags --libs zerodrift)
}
# A gyro of 0.01 deg/sqrt(h) at 100 Hz: a sample has 0.01 * 60 * sqrt(100) = 6 deg/h. An hour knows N to 0.1 %.
rates() { awk 'BEGIN { srand(1); for (i = 0; i < 360000; ++i) printf "%.6f\n", 6 * sqrt(-2 * log(1 - rand())) * cos(6.283185307179586 * rand()) }'; }
finds_the_noise() { rates > "$work/rates.txt" && "$1" 0.01 < "$work/rates.txt" > "$work/said" && cat "$work/said" && awk '{ exit !($3 > 0.0098 && $3 < 0.0102) }' "$work/said"; }
is_the_same() { "$work/by_pkg_config" 0.01 < "$work/rates.txt" | diff - "$work/said"; }
# Every header stands alone on what is installed.
compiles_every_header() {
  (cd "$prefix/include/zerodrift" && find . -name '*.h' | sed 's,^\./\(.*\),#include "\1",') | sort > "$work/all.cpp"
  # shellcheck disable=SC2046  # a word each
  "$compiler" -fsyntax-only $(PKG_CONFIG_PATH=$prefix/lib/pkgconfig pkg-config --cflags zerodrift) "$work/all.cpp"
}
check "the libraries install, and name no folder of the build" installs
check "find_package finds them, and the example builds" builds_by_cmake
check "it finds the noise of a gyro" finds_the_noise "$work/cmake/noise_of_a_gyro"
check "pkg-config knows them" builds_by_pkg_config
check "and gives the same digits" is_the_same
check "every header is there with all it includes" compiles_every_header
exit $failed
