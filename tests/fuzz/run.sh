#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Fuzzes every parser of foreign bytes with libFuzzer under AddressSanitizer and UndefinedBehaviorSanitizer.
#   tests/fuzz/run.sh [--seconds N | --budget N] [target ...]     default: all targets
# --seconds: of each target, default 60, two at a time. --budget: wall time of all of them together, spread evenly.
# A run begins with the committed inputs, whatever the time.
# Installs what it needs (deploy/setup.sh fuzz) and builds where tests/sanitize.sh address does: the same build.
# Prints a line a target. Exit code 1: a crash, a leak, a hang (10 s an input) or more than 2 GiB; the input is named.
# What a run finds on its way stays in the build folder and is where the next one begins; ZERODRIFT_FUZZ_DIR names that
# folder (default: build/address).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${ZERODRIFT_FUZZ_DIR:-$root/build/address}
seconds=60
budget=
at_once=2
targets=()
usage() { echo "usage: tests/fuzz/run.sh [--seconds N | --budget N] [target ...]; found '$1'" >&2; exit 2; }
while [ $# -gt 0 ]; do
  case $1 in
    --seconds) [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || usage "--seconds ${2:-}"; seconds=$2; shift 2 ;;
    --budget) [[ ${2:-} =~ ^[1-9][0-9]*$ ]] || usage "--budget ${2:-}"; budget=$2; shift 2 ;;
    -*) usage "$1" ;;
    *) [ -f "$root/tests/fuzz/targets/$1.cpp" ] || usage "$1"; targets+=("$1"); shift ;;
  esac
done
if [ ${#targets[@]} -eq 0 ]; then
  for source in "$root"/tests/fuzz/targets/*.cpp; do targets+=("$(basename "$source" .cpp)"); done
fi
[ -z "$budget" ] || seconds=$(((budget * at_once + ${#targets[@]} - 1) / ${#targets[@]}))

"$root/deploy/setup.sh" fuzz
mkdir -p "$build"
export PATH=/usr/bin:$PATH
cmake --preset address -S "$root" -B "$build" > "$build/configure.log" 2>&1 || { cat "$build/configure.log" >&2; exit 2; }
cmake --build "$build" -j "$(nproc)" --target "${targets[@]/#/fuzz_}" > "$build/build.log" 2>&1 ||
  { tail -n 60 "$build/build.log" >&2; exit 2; }

mkdir -p "$build/logs" "$build/crashes"
export ASAN_OPTIONS=strict_string_checks=1:detect_stack_use_after_return=1
export UBSAN_OPTIONS=print_stacktrace=1

fuzz() {
  local target=$1 log=$build/logs/$1.log status=0
  local found=$build/corpus/$target
  mkdir -p "$found"
  rm -f "$build/crashes/$target-"*
  "$build/bin/fuzz_$target" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -max_len=4096 \
    -print_final_stats=1 -artifact_prefix="$build/crashes/$target-" \
    "$found" "$root/tests/fuzz/corpus/$target" > "$log" 2>&1 || status=$?
  local runs edges
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  edges=$(grep -o 'cov: [0-9]*' "$log" | tail -n 1 | cut -d ' ' -f 2 || true)
  local crashes=("$build/crashes/$target-"*)
  [ -e "${crashes[0]}" ] || crashes=()
  printf '%-20s %12s executions %6s edges %3d crashes\n' "$target" "${runs:-?}" "${edges:-?}" ${#crashes[@]}
  [ "$status" -eq 0 ] && return
  grep -m 3 -E 'ERROR: |runtime error: |what\(\): ' "$log" | sed 's/^/  /' || true
  echo "  log: $log${crashes[0]:+, input: ${crashes[0]}}"
  return 1
}

failed=0
running=0
for target in "${targets[@]}"; do
  if [ "$running" -ge "$at_once" ]; then wait -n || failed=1; running=$((running - 1)); fi
  fuzz "$target" &
  running=$((running + 1))
done
while [ "$running" -gt 0 ]; do wait -n || failed=1; running=$((running - 1)); done
exit $failed
