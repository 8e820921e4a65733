#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the main job for many simulated hours, as fast as it goes, and says whether anything grew, got lost or came too late.
#   tests/soak.sh --hours H [--keep DIR] [--domain N] [--faults S]
# --keep DIR: samples.csv and the services' logs stay there. --domain: default one of 215 to 222 that is free.
# --faults S: two compensations that answer the same, and every S seconds of sensor time (later where they aren't both in sync
# yet) a fault, in turn: the leader dies, a process stands still, a command that names nothing. Counted by kind.
# ZERODRIFT_BUILD_DIR names the build folder (default: build/release).
# Exit code 0: PASS; 1: FAIL, with the reasons; 2: wrong usage or it could not be run. Ctrl-C stops everything.
#
# Bars: those of tests/soak_verdict.awk from 10 % of the time on; each sample published answered exactly once and monitored;
# no process ends before its source; nothing left in /dev/shm; no warning of a service, except of what the data are like, and
# a missed deadline while this machine was busy. With faults: each sample published monitored exactly once, and warnings are told.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
bin=${ZERODRIFT_BUILD_DIR:-$root/build/release}/bin
rate_hz=200
sample_every_s=1
give_up_s=120   # without any progress
stop_within_s=5
busy_percent=90
# What the monitor finds in the rates: as it should.
of_the_data='(noise_grew|compensation_harms)[a-z_]*'

bad() { echo "soak: $1" >&2; exit 2; }
hours='' keep='' domain='' faults_s=''
while [ $# -gt 0 ]; do
  case $1 in
    -h|--help) sed -n '3,14s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
    --hours|--keep|--domain) [ $# -ge 2 ] || bad "$1 needs a value"; printf -v "${1#--}" '%s' "$2"; shift 2 ;;
    --faults) [ $# -ge 2 ] || bad "$1 needs a value"; faults_s=$2; shift 2 ;;
    *) bad "unknown option '$1'; expected --hours H [--keep DIR] [--domain N] [--faults S]" ;;
  esac
done
[ -n "$hours" ] || bad "--hours is missing; expected e.g. --hours 72"
duration_s=$(LC_ALL=C awk -v h="$hours" 'BEGIN { if (h ~ /^[0-9]+(\.[0-9]+)?$/ && h >= 0.25 && h <= 10000) printf "%d", h * 3600 }')
[ -n "$duration_s" ] || bad "--hours: found '$hours', expected 0.25 to 10000"
[[ -z $domain || ( $domain =~ ^[0-9]{1,3}$ && $((10#$domain)) -le 232 ) ]] || bad "--domain: found '$domain', expected 0 to 232"
[[ -z $faults_s || ( $faults_s =~ ^[0-9]{1,5}$ && $((10#$faults_s)) -ge 10 ) ]] || bad "--faults: found '$faults_s', expected seconds from 10 on"
for program in compensation gyro_publisher thermal_publisher allan_monitor zerodrift; do
  [ -x "$bin/$program" ] || bad "$bin/$program is missing; deploy/setup.sh builds it"
done
if [ -n "$keep" ]; then
  mkdir -p "$keep" 2>/dev/null && [ -w "$keep" ] || bad "--keep: cannot write to '$keep'"
  work=$keep
else
  work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift-soak.XXXXXX")
fi

declare -A pid_of=() seen_shm=()
reasons=()
stop_all() {
  trap '' INT TERM
  local pid
  # In a background shell no signal reaches what was started otherwise.
  for pid in "${pid_of[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in "${pid_of[@]}"; do
    for ((i = 0; i < 10 * stop_within_s; ++i)); do kill -0 "$pid" 2>/dev/null || break; sleep 0.1; done
    kill -KILL "$pid" 2>/dev/null || true
  done
  wait 2>/dev/null || true
  [ -n "$keep" ] || rm -rf "$work"
}
trap stop_all EXIT
trap 'exit 130' INT TERM

# The lock that the system tests use too (tests/unit/dds/test_domain.h).
take_domain() {
  exec {lock}> "${TMPDIR:-/tmp}/zerodrift-test-domain-$1.lock" || return 1
  flock -n "$lock" || { exec {lock}>&-; return 1; }
}
if [ -n "$domain" ]; then
  take_domain "$domain" || bad "--domain: a test runs in domain $domain"
else
  for domain in {215..222} ''; do [ -n "$domain" ] || bad "domains 215 to 222 are all in use"; take_domain "$domain" && break; done
fi

# A day in a chamber every two hours: 20 °C up and down at 0.5 °C/min, and a turn that is no drift.
write_profile() {
  printf 'name: soak\nduration_s: %d\ninitial_temperature_degc: 15\npower_on_s: 0\nchamber:\n' "$duration_s"
  for ((t = 0; t < duration_s; t += 7200)); do
    printf '  - {time_s: %d, temperature_degc: %d}\n' $((t + 600)) 15 $((t + 3000)) 35 $((t + 4200)) 35 $((t + 6600)) 15
  done
  echo 'turns:'
  for ((t = 0; t < duration_s; t += 7200)); do
    printf '  - {start_s: %d, duration_s: 60, axis: z, rate_deg_s: 10, ramp_s: 2}\n' $((t + 2400))
  done
}

start() {   # name command...
  local name=$1; shift
  "$@" --domain "$domain" > "$work/$name.log" 2>&1 {lock}>&- &
  pid_of[$name]=$!
}

# Sensor time of the newest table.
sensor_time() {
  tail -c 20000 "$work/status.log" | sed -n 's/^gyro [0-9]*   sensor time \([0-9.]*\) s .*/\1/p' | tail -n 1
}

# Share of this machine that is busy since the last call, in percent.
busy_before=0 idle_before=0
machine_busy() {
  local user nice system idle iowait irq softirq steal
  read -r _ user nice system idle iowait irq softirq steal _ < /proc/stat
  local busy=$((user + nice + system + irq + softirq + steal)) rest=$((idle + iowait))
  local all=$((busy - busy_before + rest - idle_before))
  percent=$((all > 0 ? 100 * (busy - busy_before) / all : 0))
  busy_before=$busy idle_before=$rest
}

ticks=$(getconf CLK_TCK)
sample() {   # name; a line of the CSV; nothing where the process is over
  local name=$1 pid=${pid_of[$1]} key value rss=0 data=0 threads=0 stat fields names=() bytes=0 file
  local files=(/proc/"$pid"/fd/*)
  while read -r key value _; do
    case $key in VmRSS:) rss=$value ;; VmData:) data=$value ;; Threads:) threads=$value ;; esac
  done 2>/dev/null < "/proc/$pid/status" || return 0
  [ "$rss" -gt 0 ] || return 0
  stat=$(< "/proc/$pid/stat") 2>/dev/null || return 0
  # shellcheck disable=SC2206  # one word a field
  fields=(${stat##*) })
  mapfile -t names < <(grep -oE '/dev/shm/.*' "/proc/$pid/maps" 2>/dev/null | sort -u)
  for file in "${names[@]}"; do
    seen_shm[$file]=1
    bytes=$((bytes + $(stat -c %s "$file" 2>/dev/null || echo 0)))
  done
  printf '%s,%s,%s,%d,%d,%d,%s,%d,%d,%d,%d\n' "$SECONDS" "${now_s:-0}" "$name" "$rss" "${#files[@]}" "$threads" \
    "$(((fields[11] + fields[12]) * 100 / ticks))e-2" "${#names[@]}" "$bytes" "$percent" "$data"
}

ended() { ! kill -0 "${pid_of[$1]}" 2>/dev/null; }
exit_code() { local code=0; wait "${pid_of[$1]}" || code=$?; unset "pid_of[$1]"; echo "$code" > "$work/code"; }

# ---------------------------------------- faults

# The one that is killed leads whenever it is in sync. What it takes is no leak: it is not sampled.
victim=compensation_killed
declare -A fault_count=()
next_fault_s=600 fault=0
start_victim() {
  start "$victim" "$bin/compensation" --redundant --instance 0 --await-subscribers 1
}
in_sync() {   # both, by the newest table
  local newest
  newest=$(tail -c 6000 "$work/status.log" | grep -E '^compensation(/1)? of gyro [0-9]+: ' | tail -n 2)
  [ "$(grep -cE ' in sync' <<< "$newest")" -eq 2 ] && [ "$(cut -d' ' -f1 <<< "$newest" | sort -u | wc -l)" -eq 2 ]
}
stand_still() {   # name seconds
  kill -STOP "${pid_of[$1]}"
  sleep "$2" {lock}>&-
  kill -CONT "${pid_of[$1]}"
}
inject() {
  [ -n "$faults_s" ] && [ -n "$now_s" ] && [ "${now_s%.*}" -ge "$next_fault_s" ] || return 0
  [ "${now_s%.*}" -lt $((duration_s - 120)) ] && ! ended gyro_publisher && in_sync || return 0
  local kinds=(dies stands_short monitor_stands command stands_long publisher_stands) kind
  kind=${kinds[$((fault % ${#kinds[@]}))]}
  fault=$((fault + 1)) next_fault_s=$((${now_s%.*} + faults_s))
  fault_count[$kind]=$((${fault_count[$kind]:-0} + 1))
  case $kind in
    dies)
      kill -KILL "${pid_of[$victim]}"
      wait "${pid_of[$victim]}" 2>/dev/null || true
      start_victim
      # The newest table must not be one of before.
      sleep 1.5 {lock}>&- ;;
    stands_short) stand_still "$victim" 0.2 ;;
    stands_long) stand_still compensation 1.2 ;;
    monitor_stands) stand_still allan_monitor 0.5 ;;
    publisher_stands) stand_still gyro_publisher 0.5 ;;
    command)
      local code=0
      "$bin/zerodrift" ctl adopt --model nothing.yaml --domain "$domain" >> "$work/commands.log" 2>&1 {lock}>&- || code=$?
      [ "$code" -eq 1 ] || reasons+=("a command that names nothing ended with exit code $code, expected 1: refused") ;;
  esac
}

# ---------------------------------------- what must hold

# Services end when told, publishers with their source and then by 0.
check_alive() {
  local name
  for name in "${services[@]}"; do
    if ended "$name"; then reasons+=("$name ended at sensor time ${now_s:-0} s"); return 1; fi
  done
  for name in thermal_publisher gyro_publisher; do
    [ -n "${pid_of[$name]:-}" ] && ended "$name" || continue
    exit_code "$name"
    if [ "$(< "$work/code")" -ne 0 ]; then reasons+=("$name ended with exit code $(< "$work/code")"); return 1; fi
  done
}

watch() {   # until the table is over, or nothing goes on
  local moved=$SECONDS before='' name
  while ! ended status; do
    now_s=$(sensor_time)
    [ "$now_s" = "$before" ] || { moved=$SECONDS; before=$now_s; }
    machine_busy
    for name in allan_monitor compensation thermal_publisher gyro_publisher; do
      [ -z "${pid_of[$name]:-}" ] || sample "$name" >> "$work/samples.csv"
    done
    check_alive || return 0
    inject
    # A compensation that began anew doesn't count all answers, so the table doesn't see the end.
    if [ -n "$faults_s" ] && [ -z "${pid_of[gyro_publisher]:-}" ] && [ $((SECONDS - moved)) -gt 5 ]; then
      kill -TERM "${pid_of[status]}"
      return 0
    fi
    if [ $((SECONDS - moved)) -gt "$give_up_s" ]; then
      reasons+=("nothing went on for $give_up_s s at sensor time ${now_s:-0} s")
      return 0
    fi
    sleep "$sample_every_s" {lock}>&-
  done
}

stop_and_check() {   # the services, which are told to end and have done nothing wrong
  local name i
  for name in "${services[@]}"; do kill -TERM "${pid_of[$name]}" 2>/dev/null || true; done
  for name in "${!pid_of[@]}"; do
    for ((i = 0; i < 10 * stop_within_s; ++i)); do ended "$name" && break; sleep 0.1; done
    ended "$name" || { reasons+=("$name did not end within $stop_within_s s"); continue; }
    exit_code "$name"
    [ "$name" = status ] || [ "$(< "$work/code")" -eq 0 ] || reasons+=("$name ended with exit code $(< "$work/code")")
  done
  for name in "${!seen_shm[@]}"; do [ ! -e "$name" ] || reasons+=("left in /dev/shm: $name"); done
}

# The newest figures that the services gave of themselves.
check_answers() {
  local line published=0 in=0 out=0 monitored=0 missing=0 duplicates=0 rejected=0 expected=$((duration_s * rate_hz))
  line=$(grep -A 1 '^samples: ' "$work/status.log" | tail -n 2 | tr -s '\n ' ' ')
  read -r _ _ published _ in _ out _ monitored _ missing _ duplicates _ rejected <<< "$line" || true
  echo "${line:-samples: none}"
  [ "${published:-0}" -eq "$expected" ] || reasons+=("${published:-0} samples were published, expected $expected")
  if [ -n "$faults_s" ]; then   # of whom it died, counts begin anew
    [ "${monitored:-0}" -eq "$expected" ] || reasons+=("of $expected samples ${monitored:-0} were monitored")
    return
  fi
  if [ "${out:-0}" -ne "$expected" ] || [ "$in" -ne "$expected" ] || [ "$monitored" -ne "$expected" ]; then
    reasons+=("of $expected samples $in came in, $out were answered and $monitored monitored")
  fi
  [ $((missing + duplicates + rejected)) -eq 0 ] ||
    reasons+=("missing $missing, duplicates $duplicates, rejected $rejected samples")
}

# Busy percent of the machine in the samples around a time of day, the largest.
busy_at() {
  local at=$(($(date -d "$1" +%s) - began_s))
  awk -F, -v at="$at" 'NR > 1 && $1 >= at - 2 && $1 <= at + 2 && $10 > most { most = $10 } END { print most + 0 }' \
    "$work/samples.csv"
}

# A log holds each event once a code and subject; how often it came, the table says as long as it shows it.
check_events() {
  local line time code text count busy
  while read -r line; do
    time=${line%% *} text=${line#*: } code=${text%%:*} text=${text#*: }
    count=$(grep -hF -- "$text (" "$work/status.log" | grep -oE '\([0-9]+x\)$' | tr -dc '0-9\n' | sort -n | tail -n 1 || true)
    printf 'event %s %s, %s\n' "${count:+${count}x}" "$code" "$text"
    [[ ! $code =~ ^$of_the_data$ && -z $faults_s ]] || continue
    if [ "$code" = deadline_missed ]; then
      busy=$(busy_at "$time")
      [ "$busy" -lt "$busy_percent" ] || { echo "  the machine was busy to $busy %"; continue; }
    fi
    reasons+=("$code: $text")
  done < <(grep -hE '^[0-9T:.-]+ [a-z_]+ (warning|error|critical): ' \
    "$work"/{allan_monitor,compensation,thermal_publisher,gyro_publisher}.log | sort)
}

# Read whole before it begins, so that another version may be checked out while this one runs.
{
write_profile > "$work/profile.yaml"
echo 'wall_s,sensor_s,process,rss_kb,files,threads,cpu_s,shm_names,shm_bytes,machine_busy_percent,data_kb' > "$work/samples.csv"
source=(--source simulation --model "$root/config/models/paper_fog.yaml" --profile "$work/profile.yaml" --seed 1 --speed max)
until_finished=(--until-finished)
[ -z "$faults_s" ] || until_finished=()
start status "$bin/zerodrift" ctl status --follow "${until_finished[@]}"
start allan_monitor "$bin/allan_monitor"
services=(compensation allan_monitor) instance=()
if [ -n "$faults_s" ]; then
  services+=("$victim") instance=(--redundant --instance 1)
  start_victim
fi
start compensation "$bin/compensation" --await-subscribers 1 "${instance[@]}"
start thermal_publisher "$bin/thermal_publisher" "${source[@]}"
start gyro_publisher "$bin/gyro_publisher" "${source[@]}" --rate "$rate_hz" --wait-for compensation,allan_monitor
SECONDS=0 now_s='' percent=0
began_s=$(date +%s)
machine_busy

watch
stop_and_check
echo "$hours h of sensor time in $SECONDS s, domain $domain"
verdict=0
warm_up_s=$((duration_s / 10))
[ -z "$faults_s" ] || warm_up_s=$((duration_s / 4))   # the first death is behind them: the middleware starts a thread then
LC_ALL=C awk -v warm_up_s="$warm_up_s" -f "$root/tests/soak_verdict.awk" "$work/samples.csv" || verdict=$?
check_answers
check_events
if [ -n "$faults_s" ]; then
  printf 'faults: %d, one in %d s of sensor time:' "$fault" $((fault > 0 ? duration_s / fault : 0))
  for name in "${!fault_count[@]}"; do printf ' %s %d' "$name" "${fault_count[$name]}"; done
  echo
fi
[ -z "$keep" ] || echo "kept in $work"
if [ ${#reasons[@]} -gt 0 ]; then printf '  %s\n' "${reasons[@]}"; verdict=1; fi
case $verdict in
  0) echo PASS ;;
  1) echo FAIL ;;
  *) echo "soak: too few samples to judge by; expected a longer run" >&2 ;;
esac
exit "$verdict"
}
