#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# run.sh BUILD_DIR: checks the files of deploy/ as far as that goes without running what they describe (the units run in
# tests/containers/units.sh). A line each: PASS, FAIL, or SKIP with the reason. Exit code 1: something failed; 77: nothing
# failed and something was skipped.
set -uo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
bin=$1/bin
work=$1/deploy_test
domain=231  # beyond those of tests/system/domains.h
port=18765
mkdir -p "$work" && cd "$work" || exit 2

failed=0 skipped=0
pass() { echo "PASS: $1"; }
fail() { echo "FAIL: $1"; failed=1; }
skip() { echo "SKIP: $1: $2"; skipped=1; }
# check TITLE COMMAND...: shows what it wrote where it failed.
check() {
  local title=$1; shift
  if "$@" > output.txt 2>&1; then pass "$title"; else fail "$title"; sed 's/^/  /' output.txt | head -40; fi
}
refuses() { ! "$@"; }

# ---------------------------------------- units
units() {
  rm -rf units
  mkdir -p units/{usr/bin,usr/lib/systemd,etc/systemd/system}
  cp -r /lib/systemd/system units/usr/lib/systemd/
  cp -r "$root"/deploy/systemd/{*.service,*.target,*.service.d} units/etc/systemd/system/
  sed -n 's,^ExecStart=/usr/bin/\([a-z-]*\) .*,\1,p' "$root"/deploy/systemd/*.service |
    while read -r program; do install -m 755 /bin/true "units/usr/bin/$program"; done
}
# One instance of each; the word after @ stands for it.
unit_names() { (cd units/etc/systemd/system && printf '%s\n' zerodrift.target zerodrift-*.service | sed 's/@\./@0./'); }
verify() { local said; said=$(unit_names | xargs systemd-analyze verify --root=units --man=no 2>&1); echo "$said"; [ -z "$said" ]; }
exposure() {  # of 10 at most this
  local unit status=0
  for unit in $(unit_names | grep service); do
    systemd-analyze security --offline=true --root=units --threshold=$(($1 * 10)) --no-pager "$unit" | tail -1
    [ "${PIPESTATUS[0]}" -eq 0 ] || status=1
  done
  return $status
}
variables_are_set() {
  local name status=0
  for name in $(grep -ho '\$[A-Z_]*' "$root"/deploy/systemd/*.service | tr -d '$' | sort -u); do
    grep -q "^\(Environment=\"\)\{0,1\}$name=" "$root"/deploy/systemd/*.env "$root"/deploy/systemd/realtime.conf || { echo "nothing sets $name"; status=1; }
  done
  return $status
}
if command -v systemd-analyze >/dev/null; then
  units
  check "units: systemd-analyze verify" verify
  check "units: exposure at most 2 of 10" exposure 2
  echo 'Wrong=1' >> units/etc/systemd/system/zerodrift-.service.d/10-common.conf
  check "units: a wrong key is found" refuses verify
  sed -i '/^CapabilityBoundingSet/d; /^System/d; /^Protect/d' units/etc/systemd/system/zerodrift-.service.d/10-common.conf
  check "units: an exposed one is found" refuses exposure 2
else
  skip "units" "systemd-analyze is not installed (package systemd)"
fi
check "units: each variable is set somewhere" variables_are_set

# ---------------------------------------- every YAML file
if command -v yamllint >/dev/null; then
  check "YAML: yamllint" yamllint -s -d '{extends: default, rules: {line-length: {max: 200}, document-start: disable, braces: {max-spaces-inside: 0}, comments: {min-spaces-from-content: 2}, quoted-strings: disable}}' "$root/deploy"
else
  skip "YAML: yamllint" "not installed"
fi

# ---------------------------------------- Node.js and its packages, below the build folder
has_node() {
  if ! { command -v node && command -v npm; } >/dev/null; then echo "node or npm is not installed"; return 1; fi
  cp "$here"/{package.json,.npmrc,kubernetes.mjs,monitoring.mjs} .
  if ! cmp -s "$here/package-lock.json" package-lock.json || [ ! -d node_modules ]; then
    cp "$here/package-lock.json" .
    npm ci --prefer-offline --no-fund --no-audit > npm.log 2>&1 || { rm -f package-lock.json; echo "npm ci failed, see $work/npm.log"; return 1; }
  fi
}
node_obstacle=$(has_node) || true

# ---------------------------------------- manifests: by schema only
rm -f options.txt
if ! command -v kubectl >/dev/null; then
  skip "manifests" "kubectl is not installed, whose kustomize puts them together"
elif ! kubectl kustomize "$root/deploy/kubernetes/vehicle" > vehicle.yaml 2> kustomize.log; then
  # Debian 12's kubectl 1.20 has a kustomize that knows no 'patches' with a path.
  if kubectl version --client 2>/dev/null | grep -q 'v1\.\(1.\|20\)\b'; then skip "manifests" "kubectl is too old"; else fail "manifests: kustomize"; cat kustomize.log; fi
elif [ -n "$node_obstacle" ]; then
  skip "manifests" "$node_obstacle"
else
  check "manifests: kustomize of the simulation" sh -c "kubectl kustomize '$root/deploy/kubernetes/simulation' > simulation.yaml"
  check "manifests: schema, unknown keys, rules" node kubernetes.mjs vehicle.yaml simulation.yaml
  cp options.txt manifest_options.txt
  sed 's/readOnlyRootFilesystem/readOnlyRootFilesytem/' vehicle.yaml > unknown_key.yaml
  sed 's/periodSeconds: 5/periodSeconds: five/' vehicle.yaml > wrong_type.yaml
  check "manifests: an unknown key is found" refuses node kubernetes.mjs unknown_key.yaml
  check "manifests: a wrong type is found" refuses node kubernetes.mjs wrong_type.yaml
fi
check "manifests: the vehicle's configuration is config/vehicle.yaml" cmp "$root/config/vehicle.yaml" "$root/deploy/kubernetes/vehicle/compensation.yaml"

# ---------------------------------------- profiles of Fast DDS
# The files stand alone; the reader's profile is the same in all. That they are taken: tests/system/profile_test.cpp.
same_reader() {
  local file
  for file in two_computers shared_memory; do
    diff <(sed -n '/<data_reader/,/<.data_reader>/p' "$root/deploy/profiles/one_computer.xml") \
      <(sed -n '/<data_reader/,/<.data_reader>/p' "$root/deploy/profiles/$file.xml") || return 1
  done
}
check "profiles: one reader's profile in all" same_reader
# 2000 is written in common/dds/topics.h.
depth_of_code() {
  local depth; depth=$(sed -n 's/^inline constexpr std::int32_t kSampleDepth = \([0-9]*\);/\1/p' "$root/common/dds/topics.h")
  grep -q "<depth>$depth</depth>" "$root/deploy/profiles/one_computer.xml"
}
check "profiles: the history's depth is the code's" depth_of_code

# ---------------------------------------- arguments
# "program --option" of units, environment and manifests: each must be one that the program knows.
options() {
  local program words name
  sed -n 's,^ExecStart=/usr/bin/zerodrift-\([a-z-]*\) \(.*\),\1 \2,p' "$root"/deploy/systemd/*.service | while read -r program words; do
    program=${program//-/_}
    for name in $(grep -o '\$[A-Z_]*' <<< "$words" | tr -d '$'); do
      words="$words $(sed -n "s/^#\{0,1\}\(Environment=\"\)\{0,1\}$name=\(.*\)/\2/p" "$root"/deploy/systemd/{*.env,realtime.conf} | tr '"\n' '  ')"
    done
    grep -o -- '--[a-z0-9-]*' <<< "$words" | sed "s/^/$program /"
  done
  [ ! -f manifest_options.txt ] || cat manifest_options.txt
}
known_options() {
  local program option status=0 count=0
  while read -r program option; do
    [ -x "$bin/$program" ] || { echo "there is no program $program"; status=1; continue; }
    "$bin/$program" --help | grep -q -- "$option\b" || { echo "$program knows no $option"; status=1; }
    count=$((count + 1))
  done < <(options | sort -u)
  [ "$count" -gt 20 ] || { echo "only $count options were found"; status=1; }
  return $status
}
if [ -x "$bin/compensation" ]; then check "arguments: the programs know them" known_options; else skip "arguments" "nothing is built in $bin"; fi

# ---------------------------------------- monitoring
# promtool is a part of Debian's prometheus, whose package would start a server: unpacked, not installed.
rules_tested=
promtool=$(command -v promtool) || promtool=$work/prometheus/usr/bin/promtool
if [ ! -x "$promtool" ]; then
  { apt-get -o APT::Sandbox::User=root download prometheus && dpkg-deb -x prometheus_*.deb prometheus; } > promtool.log 2>&1
fi
[ -n "$node_obstacle" ] || check "monitoring: each alert is tested and has its section, panels are whole" node monitoring.mjs "$root"
if "$promtool" --version >/dev/null 2>&1; then
  check "monitoring: promtool check config" "$promtool" check config "$root/deploy/monitoring/prometheus.yaml"
  check "monitoring: promtool check rules" "$promtool" check rules "$root/deploy/monitoring/alerts.yaml"
  # Computes for long: its end is awaited last.
  "$promtool" test rules "$root/deploy/monitoring/alerts_test.yaml" > rules_tested.txt 2>&1 & rules_tested=$!
  [ -n "$node_obstacle" ] || check "monitoring: the dashboard's expressions" "$promtool" check rules dashboard_rules.yaml
else
  skip "monitoring: promtool" "not installed, and not to be had by apt-get download"
fi

started=(${rules_tested:+"$rules_tested"})
stop() { [ ${#started[@]} -eq 0 ] || kill "${started[@]}" 2>/dev/null; wait; }
trap stop EXIT
run() { local program=$1; shift; "$bin/$program" --domain $domain "$@" > "$program.log" 2>&1 & started+=($!); }
if [ -n "$node_obstacle" ]; then
  skip "monitoring: names" "$node_obstacle"
elif [ ! -x "$bin/console" ]; then
  skip "monitoring: names" "nothing is built in $bin"
else
  simulation=(--source simulation --model "$root/config/models/paper_fog.yaml" --profile "$root/config/profiles/paper_chamber.yaml" --speed 60)
  run console --listen 127.0.0.1:$port
  run allan_monitor
  run compensation --await-subscribers 1 --redundant
  run thermal_publisher "${simulation[@]}"
  run navigation_filter --heading 0
  run gyro_publisher "${simulation[@]}" --rate 100 --wait-for compensation,allan_monitor
  # One that ends in order.
  rm -f recorded.mcap  # of a run before: no recording is written over
  "$bin/zerodrift" record --domain $domain --out recorded.mcap --samples 100 > recorder.log 2>&1 & started+=($!)
  check "monitoring: a console serves what alerts and dashboard ask for" node monitoring.mjs "$root" http://127.0.0.1:$port/metrics
  sed 's/zerodrift_samples_in_total/zerodrift_samples_taken/' metrics.txt > renamed.txt
  check "monitoring: a renamed metric is found" refuses node monitoring.mjs "$root" renamed.txt
  check "monitoring: the console knows every member of the services' statuses" grep -x 'zerodrift_console_members_unknown 0' metrics.txt
  check "monitoring: the recorder that ended is not down" refuses grep -q 'zerodrift_service_up{.*"recorder"' metrics.txt
  if "$promtool" --version >/dev/null 2>&1; then
    check "monitoring: promtool check metrics" "$promtool" check metrics < metrics.txt
    sed 's/zerodrift_samples_in_total/zerodrift_samples_in/' metrics.txt > no_total.txt
    check "monitoring: a counter without _total is found" refuses "$promtool" check metrics < no_total.txt
  fi
fi

rules_hold() { wait "$rules_tested"; local status=$?; cat rules_tested.txt; return $status; }
[ -z "$rules_tested" ] || check "monitoring: promtool test rules" rules_hold

[ $failed -eq 0 ] || exit 1
[ $skipped -eq 0 ] || exit 77
