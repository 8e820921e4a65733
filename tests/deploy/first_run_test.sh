#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# first_run_test.sh BUILD_DIR: deploy/run.sh where nothing is built yet. A checkout of links, whose set-up puts programs of
# BUILD_DIR where it would have built them. A line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
readonly domain=229  # beyond those of tests/system/domains.h
built=$(cd "$1/bin" && pwd) || exit 2
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_first_run.XXXXXX")
trap '[ ! -s "$work/compiler" ] || kill "$(cat "$work/compiler")" 2>/dev/null; rm -rf "$work"' EXIT
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
# The second step of the set-up does REST.
checkout() {  # REST
  rm -rf "$work/checkout"
  mkdir -p "$work/checkout/deploy"
  ln -s "$root/config" "$work/checkout/config"
  cp "$root/deploy/run.sh" "$work/checkout/deploy/run.sh"
  cat > "$work/checkout/deploy/setup.sh" <<SETUP
#!/bin/sh
mkdir -p "$work/checkout/build/release/bin"
cd "$work/checkout/build/release/bin"
if [ "\${1:-}" = run ]; then
  ln -s $built/compensation $built/gyro_publisher $built/thermal_publisher $built/allan_monitor $built/ctl .
else
  $1
fi
SETUP
  chmod 755 "$work/checkout/deploy/setup.sh"
}
unset ZERODRIFT_BUILD_DIR
export TMPDIR=$work
run() { "$work/checkout/deploy/run.sh" --domain $domain --console off --speed max "$@" > "$work/said" 2>&1; }

checkout "while [ ! -e '$work/go' ]; do sleep .1; done; ln -s $built/zerodrift .; echo 'setup: the rest is there'"
run --duration 1min & runs=$!
# The run is over before the rest is built.
waits() { until grep -q 'run: building the other programs' "$work/said"; do kill -0 $runs || return 1; sleep .1; done; }
check "the run doesn't wait for the other programs" waits
touch "$work/go"
ends() { wait $runs && grep -q 'published 12000' "$work/said" && tail -2 "$work/said" | grep -q 'setup: the rest is there' && [ -x "$work/checkout/build/release/bin/zerodrift" ]; }
check "it ends well when they are there" ends

checkout "echo 'no compiler'; exit 1"
refused() { run --duration 1min; [ $? -eq 2 ] && grep -qx 'no compiler' "$work/said"; }
check "what keeps them from being built is told, exit code 2" refused

checkout "sleep 600 & echo \$! > '$work/compiler'; wait"
"$work/checkout/deploy/run.sh" --domain $domain --console off > "$work/said" 2>&1 & runs=$!
stops() {
  until [ -s "$work/compiler" ]; do kill -0 $runs || return 1; sleep .1; done
  kill -TERM $runs
  wait $runs; local code=$?
  [ $code -eq 130 ] || { echo "exit code $code"; return 1; }
  ! kill -0 "$(cat "$work/compiler")"
}
check "a run that is stopped stops their compiler too" stops
exit $failed
