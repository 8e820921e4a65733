#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# completion_test.sh BUILD_DIR: what bash offers behind words that were typed. A line each: PASS or FAIL; exit code 1: something
# failed.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
zerodrift=$1/bin/zerodrift
. "$root/deploy/completion/zerodrift.bash"
failed=0
offers() {  # EXPECTED WORD...: the last word is being typed
  local expected=$1
  COMP_WORDS=(zerodrift "${@:2}")
  COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
  COMPREPLY=()
  _zerodrift "$zerodrift"
  if [ "${COMPREPLY[*]}" = "$expected" ]; then echo "PASS: ${*:2}"; else echo "FAIL: '${*:2}' offers '${COMPREPLY[*]}', not '$expected'"; failed=1; fi
}
offers "simulate" sim
offers "compensate compare compensation" com
offers "gyro-publisher" gy
offers "--version" --ver
offers "freeze" ctl fr
offers "--statistic" allan --record record.csv --st
offers "--ros2-frame --ros2-frame-id --ros2-imu" compensation --ros
offers "--pre-trigger" record --out allan --pre
offers "" allan --record rec
exit $failed
