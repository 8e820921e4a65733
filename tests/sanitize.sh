#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# All tests under a sanitizer, in a build folder of their own.
#   tests/sanitize.sh address [ctest arguments]   unit and system tests, AddressSanitizer and UndefinedBehaviorSanitizer
#   tests/sanitize.sh thread [ctest arguments]    tests of the services and of what has threads, ThreadSanitizer
# A finding ends the program that has it, so its test fails. ZERODRIFT_SANITIZE_DIR names the folder that holds the build
# folders (default: build).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
kind=${1:-address}
shift || true
services=(compensation gyro_publisher thermal_publisher allan_monitor zerodrift)
case $kind in
  address)
    flags="-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS"
    targets=(all)
    label='unit|system' ;;
  thread)
    # GCC 12 warns of a null pointer in its own std::string where it instruments for threads.
    flags="-fsanitize=thread -fno-omit-frame-pointer -Wno-error=null-dereference"
    targets=(system_test "${services[@]}" dds_test dds_events_test service_test host_test compensation_allocation_test)
    label='unit|system' ;;
  *) echo "usage: tests/sanitize.sh [address|thread] [ctest arguments]; found '$kind'" >&2; exit 2 ;;
esac
build=${ZERODRIFT_SANITIZE_DIR:-$root/build}/$kind
mkdir -p "$build"
export PATH=/usr/bin:$PATH
cmake -G Ninja -S "$root" -B "$build" -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O2 -g1 $flags" \
  -DCMAKE_C_FLAGS="-O2 -g1 $flags" -DZERODRIFT_BUILD_BENCHMARKS=OFF \
  > "$build/configure.log" 2>&1 || { cat "$build/configure.log" >&2; exit 2; }
cmake --build "$build" -j "$(nproc)" --target "${targets[@]}" > "$build/build.log" 2>&1 ||
  { tail -n 60 "$build/build.log" >&2; exit 2; }

# Reports of what services write go to files, so that no test that reads their output trips over them.
rm -f "$build"/report.*
export ASAN_OPTIONS=detect_stack_use_after_return=1:log_path=$build/report
export UBSAN_OPTIONS=print_stacktrace=1:log_path=$build/report
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1:log_path=$build/report:suppressions=$root/tests/tsan.supp
status=0
# Left out: programs that were not built for this sanitizer, which stand in for their tests as <name>_NOT_BUILT; and what
# bounds resident memory, which a sanitizer multiplies and holds on to; and the page, which is no C++.
left_out='_NOT_BUILT|^Memory\.|^soak$|^Console\.(Page|InABrowser)'
ctest --test-dir "$build" -L "$label" -E "$left_out" --output-on-failure --timeout 600 -j 2 "$@" || status=$?
for report in "$build"/report.*; do
  [ -e "$report" ] || continue
  echo "sanitize: $report"
  head -n 40 "$report"
  status=1
done
exit $status
