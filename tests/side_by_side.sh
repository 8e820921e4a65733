#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# side_by_side.sh PROGRAM COUNT: the tests of a program of GoogleTest, a process each, COUNT at a time and nothing else beside them:
# for tests that wait for most of their time and would notice what computes. A line each: PASS, SKIP or FAIL; then what those said
# that did not pass. Exit code 1: something failed; 77: nothing failed, and something was skipped.
set -uo pipefail
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_side_by_side.XXXXXX")
export work program=$1
trap 'rm -rf "$work"' EXIT
run_one() {   # test
  local said=$work/said.${1//\//_} began=$SECONDS verdict=PASS
  "$program" --gtest_filter="$1" > "$said" 2>&1 || verdict=FAIL
  if [ $verdict = PASS ] && grep -q '^\[  SKIPPED \]' "$said"; then verdict=SKIP; fi
  [ $verdict != PASS ] || rm "$said"
  echo "$verdict: $((SECONDS - began)) s: $1" | tee -a "$work/verdicts"
}
export -f run_one
"$program" --gtest_list_tests | awk '/^[^ ]+\.$/ { suite = $1 } /^  / { print suite $1 }' > "$work/tests"
touch "$work/verdicts"
xargs -P "$2" -I{} bash -c 'run_one {}' < "$work/tests"
cat "$work"/said.* 2>/dev/null
count=$(wc -l < "$work/tests")
if [ "$count" -eq 0 ] || [ "$(wc -l < "$work/verdicts")" -ne "$count" ]; then echo "FAIL: not each of $count tests has a verdict"; exit 1; fi
! grep -q ^FAIL "$work/verdicts" || exit 1
! grep -q ^SKIP "$work/verdicts" || exit 77
