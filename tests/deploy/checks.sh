# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Named checks. Sourced by the tests beside it. Needs: work; $work/said, where a test puts there what was said, is shown too.

failed=0

# check TITLE COMMAND...: a line PASS or FAIL, and what the command wrote where it failed.
check() {
  local title=$1; shift
  if "$@" > "$work/output" 2>&1; then echo "PASS: $title"; return; fi
  echo "FAIL: $title"
  cat "$work/output" "$work/said" 2>/dev/null | sed 's/^/  /' | head -40
  failed=1
}
