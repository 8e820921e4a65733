#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The units of deploy/systemd under a real systemd, in a container made of the image to be tested.
#   IMAGE=zerodrift:0.1.0 [DOCKER="docker"] [BUILD_NETWORK=default] tests/containers/units.sh
# A line each, PASS or FAIL; exit code 1: something failed; 2: the container could not be made.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
read -ra docker <<< "${DOCKER:-docker}"
image=${IMAGE:?names the image to be tested}
work=$(mktemp -d "${TMPDIR:-/tmp}/units.XXXXXX")
container='' failed=0
finish() {
  [ -z "$container" ] || "${docker[@]}" rm -f "$container" > /dev/null 2>&1
  rm -rf "$work"
}
trap finish EXIT
pass() { echo "PASS: $1"; }
fail() { echo "FAIL: $1"; failed=1; }
inside() { "${docker[@]}" exec "$container" "$@"; }
# check TITLE COMMAND...: shows what it wrote, and the journal's end, where it failed.
check() {
  local title=$1; shift
  if "$@" > "$work/output" 2>&1; then pass "$title"; return; fi
  fail "$title"
  tail -20 "$work/output" | sed 's/^/  /'
  inside journalctl --no-pager -n 15 -o short-precise 2>/dev/null | sed 's/^/  | /'
}
# within SECONDS COMMAND...: true as soon as the command is.
within() {
  local end=$((SECONDS + $1)); shift
  while ! "$@" > "$work/last" 2>&1; do
    [ "$SECONDS" -le "$end" ] || { cat "$work/last"; return 1; }
    sleep 0.1
  done
  cat "$work/last"
}
property() { inside systemctl show --value -p "$2" "$1"; }
is() { [ "$(property "$1" "$2")" = "$3" ] || { echo "$1: $2 is '$(property "$1" "$2")', not '$3'"; return 1; }; }
now_ms() { date +%s%3N; }

# ---------------------------------------- the container
mkdir -p "$work/context/units" "$work/context/etc"
cp -r "$root"/deploy/systemd/{*.service,*.target,*.service.d} "$work/context/units/"
cp "$root"/deploy/systemd/*.env "$work/context/etc/"
cp "$root/deploy/systemd/zerodrift.sysusers" "$work/context/zerodrift.conf"
# No serial line here: the simulation stands for gyro and thermometer, at its own pace. Written over what a vehicle has.
simulation='--source simulation --model config/models/paper_fog.yaml --profile config/profiles/paper_chamber.yaml --speed 1'
cat >> "$work/context/etc/zerodrift.env" <<ENV
GYRO_PUBLISHER=$simulation --rate 200
THERMAL_PUBLISHER=$simulation
COMPENSATION=--config config/paper.yaml
ENV
cat > "$work/context/Dockerfile" <<DOCKERFILE
FROM $image
USER root
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends systemd && rm -rf /var/lib/apt/lists/*
RUN systemctl mask systemd-logind.service systemd-udevd.service getty.target systemd-networkd.service systemd-resolved.service
COPY zerodrift.conf /usr/lib/sysusers.d/zerodrift.conf
COPY units /etc/systemd/system
COPY etc /etc/zerodrift
RUN userdel zerodrift 2>/dev/null; systemd-sysusers && mkdir -p /var/log/journal \\
 && systemctl enable zerodrift.target zerodrift-gyro-publisher@1 zerodrift-thermal-publisher zerodrift-compensation@0 \\
      zerodrift-compensation@1 zerodrift-allan-monitor zerodrift-console
STOPSIGNAL SIGRTMIN+3
CMD ["/lib/systemd/systemd"]
DOCKERFILE
units=(zerodrift-gyro-publisher@1 zerodrift-thermal-publisher zerodrift-compensation@0 zerodrift-compensation@1
  zerodrift-allan-monitor zerodrift-console)
if ! "${docker[@]}" build --network "${BUILD_NETWORK:-default}" -t zerodrift-units:test "$work/context" > "$work/build.log" 2>&1; then
  tail -20 "$work/build.log"; echo "FAIL: the image with systemd"; exit 2
fi
container=$("${docker[@]}" run -d --network none --cgroupns private --cap-add SYS_ADMIN --security-opt apparmor=unconfined --security-opt seccomp=unconfined \
  --tmpfs /run --tmpfs /run/lock --tmpfs /tmp zerodrift-units:test) || { echo "FAIL: the container with systemd"; exit 2; }

# ---------------------------------------- start
# all PROPERTY VALUE: of each unit.
all() {
  local said
  said=$(inside systemctl show --value -p "$1" "${units[@]/%/.service}" | sed '/^$/d')
  [ "$(grep -cFx -- "$2" <<< "$said")" -eq ${#units[@]} ] || { paste <(printf '%s\n' "${units[@]}") <(echo "$said"); return 1; }
}
check "systemd runs" within 20 inside sh -c 'systemctl is-system-running | grep -E "running|degraded"'
check "all units said that they are ready" within 20 all ActiveState active
[ $failed -eq 0 ] || exit 1
check "none needed a second start" all NRestarts 0
status_text() { property "$1.service" StatusText | grep -q 'running\|waiting'; }
check "a unit tells what its service says of itself" within 5 status_text zerodrift-compensation@0
is_healthy() { inside env "ZERODRIFT_HEALTH_FILE=/run/$1/health" zerodrift health; }
all_healthy() { local unit; for unit in "${units[@]}"; do is_healthy "$unit" || return 1; done; }
check "zerodrift health of each unit" within 10 all_healthy
user_of() { inside stat -c %U "/proc/$(property "$1.service" MainPID)"; }
confined() {
  local unit pid
  for unit in "${units[@]}"; do
    pid=$(property "$unit.service" MainPID)
    [ "$(user_of "$unit")" = zerodrift ] || { echo "$unit runs as $(user_of "$unit")"; return 1; }
    inside grep -q '^CapBnd:.0*$' "/proc/$pid/status" || { echo "$unit has capabilities"; return 1; }
    inside grep -q '^NoNewPrivs:.1$' "/proc/$pid/status" || { echo "$unit may get new privileges"; return 1; }
    inside grep -q '^Seccomp:.2$' "/proc/$pid/status" || { echo "$unit has no filter of system calls"; return 1; }
  done
}
check "every process is user zerodrift, without capabilities, with its filter" confined

# ---------------------------------------- samples
# For so many seconds: the sequence numbers that came, all different, and how many are missing between the first and the last.
count() {
  inside rm -f "/tmp/$2.mcap"  # of a try before: no recording is written over
  inside zerodrift record --duration "$1" --topics compensated_rate --out "/tmp/$2.mcap" > "$work/record" 2>&1 || { cat "$work/record"; return 1; }
  inside zerodrift export "/tmp/$2.mcap" --topic compensated_rate --out "/tmp/$2.csv" > "$work/record" 2>&1 || { cat "$work/record"; return 1; }
  inside awk -F, '!c {for (i = 1; i <= NF; ++i) if ($i == "sequence") c = i; next}
    {n++; if (seen[$c]++) twice++; if (n == 1 || $c < low) low = $c; if ($c > high) high = $c}
    END {print n + 0, (n ? high - low + 1 - (n - twice) : 0), twice + 0}' "/tmp/$2.csv" > "$work/counted"
  cat "$work/counted"
}
# flows NAME: 4 s of 200 Hz, none missing, none twice; recorded from the moment on at which the recorder knows who is there.
flows() {
  count 4 "$1" || return 1
  read -r samples missing twice < "$work/counted"
  [ "$samples" -ge 700 ] && [ "$missing" -eq 0 ] && [ "$twice" -eq 0 ]
}
told_count() { echo "  $(cat "$work/counted" 2>/dev/null || cat "$work/record") samples, missing, twice"; }
check "samples flow: 200 a second, none missing, none twice" flows first
told_count
adopts() {
  inside sh -c "printf 'format_version: 1\ngyro: example\ngyro_id: example\nnominal_rate_hz: 200\neffects:\n  - {kind: bias, axis: x, parameters: {bias_deg_h: 0.1}}\n' \
    > /var/lib/zerodrift-compensation@0/repaired.yaml && zerodrift ctl adopt --model repaired.yaml"
}
check "a model that lies in the service's folder is adopted" adopts

# ---------------------------------------- SIGKILL, SIGSTOP
# again SECONDS UNIT: started once more and ready.
again() { [ "$(property "$1.service" NRestarts)" -gt "$2" ] && is "$1.service" ActiveState active; }
strike() {  # UNIT SIGNAL SECONDS
  local unit=$1 restarts began
  restarts=$(property "$unit.service" NRestarts)
  began=$(now_ms)
  inside sh -c "kill -$2 $(property "$unit.service" MainPID)" || return 1
  within "$3" again "$unit" "$restarts" || return 1
  echo "back after $(($(now_ms) - began)) ms"
}
for unit in "${units[@]}"; do
  check "$unit: SIGKILL, and it is back within 3 s" strike "$unit" KILL 3
done
check "samples flow after each was killed" within 10 flows second
told_count
for unit in zerodrift-gyro-publisher@1 zerodrift-compensation@0 zerodrift-console; do
  # 3 s of the watchdog, 1 s until it is started again, and the way there.
  check "$unit: SIGSTOP, and the watchdog starts it again within 8 s" strike "$unit" STOP 8
  check "$unit: it was the watchdog" inside sh -c "journalctl --no-pager -u $unit | grep -q 'Watchdog timeout'"
done
check "samples flow after the watchdog" within 10 flows third
told_count

# ---------------------------------------- a wrong argument, and the end
wrong() {
  inside sh -c 'echo "ALLAN_MONITOR=--window nonsense" > /etc/zerodrift/zerodrift-allan-monitor.env && systemctl restart zerodrift-allan-monitor; true'
  within 5 is zerodrift-allan-monitor.service ExecMainStatus 2 && inside sh -c 'journalctl --no-pager -u zerodrift-allan-monitor | grep -e --window'
}
check "a wrong argument: exit code 2 and its line in the journal" wrong
inside sh -c 'rm /etc/zerodrift/zerodrift-allan-monitor.env; systemctl reset-failed zerodrift-allan-monitor; systemctl restart zerodrift-allan-monitor'
stopped() {
  local began took
  began=$(now_ms)
  inside systemctl stop zerodrift.target "${units[@]}" || return 1
  took=$(($(now_ms) - began))
  echo "stopped after $took ms"
  [ "$took" -le 2500 ] || return 1  # 2 s, and the way through docker
  all Result success && all ExecMainStatus 0 && all ActiveState inactive
}
check "all stop within 2 s with exit code 0" stopped
exit $failed
