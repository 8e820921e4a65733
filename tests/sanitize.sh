#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Tests under a sanitizer, in a build folder of their own.
#   tests/sanitize.sh address [ctest arguments]   unit, golden and system tests, AddressSanitizer and UndefinedBehaviorSanitizer
#   tests/sanitize.sh address --part ci           unit tests of what parses, decides and serves, without middleware: for .ci/run
#   tests/sanitize.sh thread [ctest arguments]    tests of the services and of what has threads, ThreadSanitizer
# Installs what it needs. A finding ends the program that has it, so its test fails. The address build is the fuzzers'
# (tests/fuzz/run.sh): presets of CMakePresets.json. ZERODRIFT_SANITIZE_DIR names the folder that holds the build folders
# (default: build).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
bad() { echo "usage: tests/sanitize.sh address|thread [--part ci] [ctest arguments]; found '$1'" >&2; exit 2; }
kind=${1:-}
[ $# -eq 0 ] || shift
part=all
if [ "${1:-}" = --part ]; then
  [ "$kind/${2:-}" = address/ci ] || bad "$kind --part ${2:-}"
  part=ci
  shift 2
  [ $# -eq 0 ] || bad "$1"
fi

# Test programs of the folders whose tests make no participants, by the names in their CMakeLists.txt. Left to the whole run for
# the time that they take to compile: what only looks back at records (comparison, diagnosis, report, baselines).
part_of_ci() {
  local folder
  for folder in "$root"/tests/unit/*; do
    case ${folder##*/} in dds|service|replay|console|control|zerodrift|comparison|diagnosis|report) continue ;; esac
    sed -n 's/^zerodrift_test(\([a-z0-9_]*\) LABEL .*/\1/p' "$folder/CMakeLists.txt"
  done
}

# Of these programs CI leaves out, for their time, what only computes longer: statistics, oracles and long records, whose code
# the laws run as well; and states that are written over, which the fuzzers do under the same sanitizers.
left_to_the_whole_run='*Scenario*:*Promise*:*Evidence*:*Oracle*:*Soak*:*Settling*:*RestoredAtAnyCut*:NoiseWatchLaws.*:PowerOn.*:StateAbuse.*'

services=(compensation gyro_publisher thermal_publisher allan_monitor navigation_filter ctl console discovery_server zerodrift)
case $kind in
  address)
    targets=(all)
    if [ "$part" = ci ]; then mapfile -t targets < <(part_of_ci); fi ;;
  thread)
    targets=(system_test adversary_system_test redundancy_system_test console_system_test ros2_system_test "${services[@]}"
             dds_test dds_events_test dds_transports_test service_test host_test supervised_host_test replay_test web_test
             console_test compensation_allocation_test standby_simulation) ;;
  *) bad "$kind" ;;
esac
"$root/deploy/setup.sh" fuzz
build=${ZERODRIFT_SANITIZE_DIR:-$root/build}/$kind
mkdir -p "$build"
export PATH=/usr/bin:$PATH
cmake --preset "$kind" -S "$root" -B "$build" > "$build/configure.log" 2>&1 || { cat "$build/configure.log" >&2; exit 2; }
cmake --build "$build" -j "$(nproc)" --target "${targets[@]}" > "$build/build.log" 2>&1 ||
  { grep -v '^\[' "$build/build.log" | tail -n 60 >&2; exit 2; }

# Reports of what services write go to files, so that no test that reads their output trips over them.
rm -f "$build"/report.*
# The middleware deletes payloads of another type than it made them as (libfastrtps 2.9.1), which has no suppression of its own.
export ASAN_OPTIONS=detect_stack_use_after_return=1:strict_string_checks=1:new_delete_type_mismatch=0:log_path=$build/report
export UBSAN_OPTIONS=print_stacktrace=1:log_path=$build/report
export LSAN_OPTIONS=suppressions=$root/tests/lsan.supp:print_suppressions=0
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1:log_path=$build/report:suppressions=$root/tests/tsan.supp
status=0

# Two processes a program, each with every second test, instead of one a test, which saves half of the time.
run_program() {   # program half
  local name=$1 half=$2 began=$SECONDS verdict=passed log=$build/$1.$2.log
  GTEST_TOTAL_SHARDS=2 GTEST_SHARD_INDEX=$half "$build/bin/$name" --gtest_brief=1 > "$log" 2>&1 || verdict=FAILED
  printf '%-32s %s in %3d s: %s\n' "$name" "$verdict" $((SECONDS - began)) "$(grep -o '[0-9]* tests\? .* ran' "$log")"
  [ "$verdict" = passed ] || { tail -n 40 "$log"; return 1; }
}

if [ "$part" = ci ]; then
  export GTEST_FILTER="-$left_to_the_whole_run"
  running=0
  for name in "${targets[@]}"; do
    for half in 0 1; do
      if [ "$running" -ge 2 ]; then wait -n || status=1; running=$((running - 1)); fi
      run_program "$name" "$half" &
      running=$((running + 1))
    done
  done
  while [ "$running" -gt 0 ]; do wait -n || status=1; running=$((running - 1)); done
else
  # Left out: programs that were not built for this sanitizer, which stand in for their tests as <name>_NOT_BUILT; what bounds
  # resident memory, which a sanitizer multiplies and holds on to; hours of statistics and diagnoses of whole records,
  # minutes each, whose code shorter tests run as well;
  # what is installed, packed and typed from pages, of which such a build makes a part; and the page, which is no C++.
  left_out='_NOT_BUILT|^Memory\.|^soak$|^Console\.(Page|InABrowser|HostileClientsEndNothing)|^NavigationFilter\.NavigatesBoth'
  left_out+='|^ComparePromise\.|^TooManyGyros\.CostABounded|^deploy|^docs_'
  left_out+='|^(Calibration|Design|Diagnosis|FormulaSearch|FormulaTerm|Motion|NextExperiment|Search|StochasticEffects)Scenario\.'
  # Commands that compute in one thread.
  [ "$kind" != thread ] || left_out+='|^(AllanCommand[A-Za-z]*|Calibrate|Compare|Diagnose)\.'
  ctest --test-dir "$build" -L 'unit|golden|system' -E "$left_out" --output-on-failure --timeout 600 -j 2 "$@" || status=$?
fi
for report in "$build"/report.*; do
  [ -e "$report" ] || continue
  echo "sanitize: $report"
  head -n 40 "$report"
  status=1
done
exit $status
