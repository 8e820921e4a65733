#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The same set-up as deploy/run.sh, then all tests. Arguments go to ctest, e.g. tests/run.sh -L unit
# Two cores, of three places each: what computes takes a core, what waits for processes less (cmake/Zerodrift.cmake).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${ZERODRIFT_BUILD_DIR:-$root/build/release}
mkdir -p "$build"
"$root/deploy/setup.sh" all
exec ctest --test-dir "$build" --output-on-failure --timeout 600 -j 6 "$@"
