#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests of tests/soak.sh itself: that it passes, that it fails where it must, and that nothing is left of it.
set -euo pipefail
tests=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift-soak-test.XXXXXX")
trap 'rm -rf "$work"' EXIT
failures=0
expect() {   # what condition...
  local what=$1; shift
  "$@" && return
  echo "FAILED: $what"
  failures=$((failures + 1))
}

# ---------------------------------------- wrong usage: one line that names what is wrong, exit code 2
refuses() {   # named arguments...
  local named=$1 code=0; shift
  "$tests/soak.sh" "$@" > "$work/out" 2> "$work/err" || code=$?
  expect "exit code 2 for '$*', found $code" [ "$code" -eq 2 ]
  expect "one line for '$*'" [ "$(wc -l < "$work/err")" -eq 1 ]
  expect "'$named' in the line for '$*'" grep -qF -- "$named" "$work/err"
  expect "nothing else is said for '$*'" [ ! -s "$work/out" ]
}
refuses --hours
refuses --hours --hours
for hours in 0 -1 nan 1e3 '' '2 h' 10001; do refuses --hours --hours "$hours"; done
refuses --keep --hours 1 --keep /proc/none
refuses --domain --hours 1 --domain 233
refuses --domain --hours 1 --domain a0
refuses --speed --hours 1 --speed max
ZERODRIFT_BUILD_DIR=$work refuses compensation --hours 1

# ---------------------------------------- bars, on figures made up for one process
figures() {   # an expression of awk for each of rss_kb, files, shm_names, data_kb, by the sample's number k from 0 to 99
  awk "BEGIN { print \"wall_s,sensor_s,process,rss_kb,files,threads,cpu_s,shm_names,shm_bytes,machine_busy_percent,data_kb\"
    for (k = 0; k < 100; ++k) printf \"%d,%d,p,%d,%d,8,0,%d,0,50,%d\\n\", k, 216 * k, ($1), ($2), ($3), (${4:-50000}) }"
}
judges() {   # exit code, reason, expressions
  local expected=$1 reason=$2 code=0; shift 2
  figures "$@" | awk -v warm_up_s=2160 -f "$tests/soak_verdict.awk" > "$work/out" || code=$?
  expect "exit code $expected for figures '$*', found $code" [ "$code" -eq "$expected" ]
  expect "'$reason' for figures '$*'" grep -qF -- "$reason" "$work/out"
}
judges 0 29.30 30000 14 0
judges 0 29.30 'k < 10 ? 10000 : 30000' 14 0           # what comes up during the warm-up is no growth
judges 0 29.30 'k == 99 ? 60000 : 30000' 14 0          # nor is one peak
judges 1 'p: resident memory grew' '30000 + 60 * k' 14 0
judges 0 390.86 '400000 + 60 * (k - 10)' 14 0          # 5 MB of 390: less than 2 %
judges 1 'p: the number of open files rose from 14 to 15' 30000 '14 + (k == 50)' 0
judges 1 'p: the number of shared-memory names rose from 0 to 1' 30000 14 'k > 90'
judges 0 66.7 '30000 + 4 * k' 14 0 50000               # touches what it asked for at the beginning
judges 0 29.30 30000 14 0 'k < 49 ? 50000 : 59000'     # a kernel is selected within half of the run
judges 1 'p: from 10692 s on it asked for 1.' 30000 14 0 '50000 + 45 * k'
judges 0 29.30 30000 14 0 'k == 99 ? 54000 : 50000'     # a state is on its way at the end

# ---------------------------------------- whole runs
children() { pgrep -P "$1" -x "$2" || true; }
moves() { awk -F, '$2 > 0 { found = 1 } END { exit !found }' "$1/samples.csv" 2>/dev/null; }
nothing_left() {   # pids
  local pid
  for pid in "$@"; do ! kill -0 "$pid" 2>/dev/null || return 1; done
}
begin() {   # folder: starts a long run and waits until it is well on its way
  "$tests/soak.sh" --hours 100 --keep "$1" > "$1.out" 2>&1 &
  soak=$!
  for ((i = 0; i < 600; ++i)); do moves "$1" && break; kill -0 "$soak" 2>/dev/null || break; sleep 0.1; done
  expect "a run that moves" moves "$1"
  mapfile -t started < <(pgrep -P "$soak")
}

begin "$work/killed"
kill -KILL "$(children "$soak" compensation)"
code=0; wait "$soak" || code=$?
expect "exit code 1 where a service was killed, found $code" [ "$code" -eq 1 ]
expect "the killed service is named" grep -q 'compensation ended at sensor time' "$work/killed.out"
expect "nothing is left after a service was killed" nothing_left "${started[@]}"

begin "$work/stopped"
kill -TERM "$soak"
code=0; wait "$soak" || code=$?
expect "exit code 130 where it was stopped, found $code" [ "$code" -eq 130 ]
expect "nothing is left after it was stopped" nothing_left "${started[@]}"

code=0
"$tests/soak.sh" --hours 1 || code=$?
expect "a short soak passes" [ "$code" -eq 0 ]

[ "$failures" -eq 0 ] && echo "all held"
exit $((failures > 0))
