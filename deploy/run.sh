#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The main job: installs, builds, starts publishers, compensation and monitor, shows a live table, ends with a summary.
#   deploy/run.sh [--record FILE [--columns MAP]] [--speed 60x|max] [--duration TIME] [--config FILE] [--domain N]
#                 [--console PORT|off]
# The console is at http://127.0.0.1:8765 meanwhile. The first time, the run begins as soon as what it needs is built; the other
# programs, the console too, are built beside it, and the script ends when they are there.
# Without --domain: that of ZERODRIFT_DOMAIN, else 0.
# Without a record: the paper's chamber experiment in simulation, 200 Hz, at 60 times real time.
# Exit code 0: every sample was answered exactly once; 1: not; 2: wrong usage or bad input; 130: Ctrl-C, which stops everything.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${ZERODRIFT_BUILD_DIR:-$root/build/release}

usage() { sed -n '3,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; }
record= columns= speed= duration= config= domain=${ZERODRIFT_DOMAIN:-0} console=8765
while [ $# -gt 0 ]; do
  case "$1" in
    -h|--help) usage; exit 0 ;;
    --record|--columns|--speed|--duration|--config|--domain|--console)
      [ $# -ge 2 ] || { echo "run: $1 needs a value" >&2; exit 2; }
      printf -v "${1#--}" '%s' "$2"; shift 2 ;;
    *) echo "run: unknown option '$1'" >&2; usage >&2; exit 2 ;;
  esac
done
[ -z "$record" ] || [ -r "$record" ] || { echo "run: --record: cannot read '$record'" >&2; exit 2; }

if ! [[ $domain =~ ^[0-9]{1,3}$ ]] || [ "$((10#$domain))" -gt 232 ]; then
  echo "run: --domain or ZERODRIFT_DOMAIN: found '$domain', expected 0 to 232" >&2
  exit 2
fi

mkdir -p "$build"
bin=$build/bin
first_time=
[ -x "$bin/zerodrift" ] || [ -n "$record" ] || first_time=yes   # a record is looked at by `zerodrift` before anything starts
"$root/deploy/setup.sh" ${first_time:+run}
logs=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift.XXXXXX")
network=(--domain "$domain")

pids=()
stop_all() {
  trap '' INT TERM
  [ ${#pids[@]} -eq 0 ] || kill -TERM "${pids[@]}" ${console_pid:-} 2>/dev/null || true
  [ -z "${build_pid:-}" ] || kill -TERM -- "-$build_pid" 2>/dev/null || true
  for _ in $(seq 20); do
    [ -n "$(jobs -pr)" ] || break
    sleep 0.1
  done
  # shellcheck disable=SC2046  # one word a process
  [ -z "$(jobs -pr)" ] || kill -KILL $(jobs -pr) 2>/dev/null || true
  wait 2>/dev/null || true
}
trap stop_all EXIT
trap 'exit 130' INT TERM

start() {   # name command...
  local name=$1; shift
  "$@" > "$logs/$name.log" 2>&1 &
  pids+=($!)
}

if [ -n "$record" ]; then
  source=(--source record --record "$record")
  [ -z "$columns" ] || source+=(--columns "$columns")
  # A bad record or map is reported before anything starts.
  "$bin/zerodrift" info --record "$record" ${columns:+--columns "$columns"}
  speed=${speed:-max}
else
  source=(--source simulation --model "$root/config/models/paper_fog.yaml" --profile "$root/config/profiles/paper_chamber.yaml" --seed 1)
  speed=${speed:-60}
fi
[ -z "$duration" ] || source+=(--duration "$duration")

# Not needed for the job: where it can't start (its port is taken), its line says why and the rest goes on.
start_console() {
  [ "$console" != off ] || return 0
  "$bin/console" "${network[@]}" --listen "127.0.0.1:$console" > "$logs/console.log" 2>&1 &
  console_pid=$!
}
[ -n "$first_time" ] || start_console
start allan_monitor "$bin/allan_monitor" "${network[@]}"
start compensation "$bin/compensation" "${network[@]}" --await-subscribers 1 ${config:+--config "$config"}
start thermal_publisher "$bin/thermal_publisher" "${network[@]}" "${source[@]}" --speed "$speed"
start gyro_publisher "$bin/gyro_publisher" "${network[@]}" "${source[@]}" --speed "$speed" --wait-for compensation,allan_monitor

sleep 0.5
for pid in "${pids[@]}"; do
  kill -0 "$pid" 2>/dev/null || { echo "run: a process ended at start:" >&2; cat "$logs"/*.log >&2; exit 2; }
done

if [ -n "${console_pid:-}" ]; then
  if kill -0 "$console_pid" 2>/dev/null; then echo "console: http://127.0.0.1:$console"; else cat "$logs/console.log" >&2; fi
fi

if [ -n "$first_time" ]; then
  [ "$console" = off ] || echo "console: http://127.0.0.1:$console once it is built, which takes some minutes more"
  # A group of its own, to be stopped with its compilers; of another session the kernel would not heed `nice`.
  set -m
  nice -n 19 "$root/deploy/setup.sh" > "$logs/build.log" 2>&1 &
  build_pid=$!
  set +m
fi

"$bin/ctl" status --follow --until-finished "${network[@]}" &
table=$!
built() {   # EXIT_CODE
  build_pid=
  [ "$1" -eq 0 ] || { tail -20 "$logs/build.log" >&2; exit 2; }
}
status=0
wait -n -p ended "$table" ${build_pid:-} || status=$?
if [ "$ended" != "$table" ]; then
  built "$status"
  start_console
  status=0
  wait "$table" || status=$?
elif [ -n "${build_pid:-}" ]; then
  echo "run: building the other programs; \`tail -f $logs/build.log\` shows how far that is"
  code=0; wait "$build_pid" || code=$?
  built "$code"
fi
[ -z "$first_time" ] || tail -1 "$logs/build.log"
echo "logs: $logs"
exit "$status"
