#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# run.sh BUILD_DIR: our recordings read by the libraries that others use (@mcap/core, omgidl), and
# compared with what `zerodrift export` says of them; a ROS 2 bag that they wrote, read by us. Packages are installed below BUILD_DIR. Exit
# code 77: not run, with the reason.
set -eu
source_dir=$(cd "$(dirname "$0")" && pwd)
bin=$1/bin
work=$1/mcap_peer
domain=232  # beyond those of tests/system/domains.h

skip() { echo "SKIPPED: $1"; exit 77; }
command -v node >/dev/null || skip "node is not installed"
command -v npm >/dev/null || skip "npm is not installed"
[ "$(node -p 'process.versions.node.split(".")[0]')" -ge 18 ] || skip "node is older than 18"

mkdir -p "$work"
cp "$source_dir"/{package.json,.npmrc,read.mjs,csv.mjs,compare.mjs,write_bag.mjs,compare_bag.mjs} "$work"
if ! cmp -s "$source_dir/package-lock.json" "$work/package-lock.json" || [ ! -d "$work/node_modules" ]; then
  cp "$source_dir/package-lock.json" "$work/package-lock.json"
  (cd "$work" && npm ci --prefer-offline --no-fund --no-audit >npm.log 2>&1) ||
    { rm -f "$work/package-lock.json"; skip "npm ci failed, see $work/npm.log"; }
fi
cd "$work"
rm -rf run && mkdir run && cd run
started=()
stop() { for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done; wait; }
trap stop EXIT

compare() {  # FILE TOPIC
  node ../read.mjs "$1" "$2" >messages.txt
  "$bin/zerodrift" export "$1" --topic "$2" --out exported.csv
  node ../compare.mjs messages.txt exported.csv "$2"
}

cat >profile.yaml <<P
name: ramp
duration_s: 60
initial_temperature_degc: 0
power_on_s: 0
chamber:
  - {time_s: 3600, temperature_degc: 60}
P
simulation="--model $source_dir/../../config/models/paper_fog.yaml --profile profile.yaml --seed 3"
"$bin/zerodrift" simulate $simulation --rate 100 --out record.csv >/dev/null
for compression in none lz4 zstd; do
  "$bin/zerodrift" export record.csv --compression $compression --out $compression.mcap
  compare $compression.mcap angular_rate
done

# A bag as rosbag2 writes it, folder and single file.
node ../write_bag.mjs bag >written.txt
"$bin/zerodrift" export bag --topic /imu/data_raw --temperature-topic coil=/imu/temperature --out bag.csv
node ../compare_bag.mjs written.txt bag.csv
"$bin/zerodrift" info bag/run_1.mcap
"$bin/zerodrift" info --record bag --topic /imu/data_raw
"$bin/zerodrift" allan --record bag --topic /imu/data_raw --html allan.html >/dev/null
"$bin/zerodrift" compensate --record bag --topic /imu/data_raw --temperature-topic coil=/imu/temperature --out compensated.csv
[ "$(grep -vc '^[#t]' compensated.csv)" -eq "$(grep -c '^imu' written.txt)" ] || { echo "not each message was answered" >&2; exit 1; }

# All topics of a running system.
"$bin/zerodrift" record --domain $domain --out live.mcap --samples 6000 --attach profile.yaml &
recorder=$!
"$bin/compensation" --domain $domain --await-subscribers 1 >log.txt 2>&1 & started+=($!)
"$bin/thermal_publisher" --source simulation $simulation --domain $domain >>log.txt 2>&1 & started+=($!)
"$bin/gyro_publisher" --source simulation $simulation --rate 100 --speed max \
  --wait-for compensation,recorder --domain $domain >>log.txt 2>&1 & started+=($!)
wait $recorder
for topic in angular_rate compensated_rate; do compare live.mcap $topic; done
node ../read.mjs live.mcap | node -e '
  const found = JSON.parse(require("fs").readFileSync(0, "utf8"));
  for (const topic of ["angular_rate", "compensated_rate", "temperature", "service_status", "event"]) {
    if (!(found.topics[topic]?.count > 0)) throw new Error("no message of " + topic);
  }
  if (!(found.attachments["profile.yaml"] > 0)) throw new Error("profile.yaml is not attached");
  if (found.metadata.recording.messages_lost !== "0") throw new Error("messages were lost");
'
"$bin/zerodrift" info live.mcap
