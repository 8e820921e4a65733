# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# The compose files, run: what a subscriber gets, undisturbed and with faults. Sourced by run.sh.
# Needs: root, work, image, domain, docker_cli, check.

readonly gyro_rate_hz=200
# Goals on a quiet machine: data flow again within 3 s, the first sample within 10 s, a stop within 2 s. Tests don't time: what is
# judged is twice that, what was seen is printed. So with samples: none missing and none doubled is judged by their numbers; a simulation
# that was held up goes on from there (common/service/replay_clock.h), so that how many there were says how busy the machine was. Half
# of them says that samples flowed.
readonly restart_limit_s=6 start_limit_s=20 stop_limit_s=4
half_of_s() { echo $(($1 * gyro_rate_hz / 2)); }  # SECONDS: half the samples that a gyro sends in them

samples() { python3 "$here/samples.py" "$@"; }

# compose PROJECT ARGUMENT...: from the folder of the shipped files, with what the test sets: simulations that run as sensors do.
compose() {
  local project=$1
  shift
  local source="--source simulation --model config/models/paper_fog.yaml --profile config/profiles/paper_chamber.yaml"
  (cd "$root/deploy/compose" && ZERODRIFT_GYRO_SOURCE="$source --free-running" ZERODRIFT_THERMAL_SOURCE="$source --wait-for ''" \
    ZERODRIFT_IMAGE=$image ZERODRIFT_DOMAIN=$domain ZERODRIFT_CONSOLE_LISTEN=127.0.0.1:$console_port \
    docker_cli compose --project-name "$project" "$@")
}

# record NAME ARGUMENT...: a subscriber of its own; what it heard is in $work/recordings/NAME.mcap.
record() {
  local name=$1
  shift
  mkdir -p "$work/recordings"
  chmod 0777 "$work/recordings"
  docker_cli run -d --name "record_$name" --read-only --cap-drop ALL --security-opt no-new-privileges --no-healthcheck \
    --volume "$work/recordings:/out" "$@" "$image" \
    zerodrift record --domain "$domain" "${record_options[@]}" --topics angular_rate,compensated_rate --compression none --chunk-size 4 \
    --out "/out/$name.mcap" >/dev/null
}
record_options=()

stop_record() { docker_cli stop --time 10 "record_$1" >/dev/null && docker_cli logs "record_$1" > "$work/recordings/$1.log" 2>&1; docker_cli rm -f "record_$1" >/dev/null; }

container_of() { compose "$1" ps --all --quiet "$2"; }
pid_of() { docker_cli inspect --format '{{.State.Pid}}' "$1"; }

# until_within SECONDS COMMAND...: repeats it until it succeeds.
until_within() {
  local limit=$1 began
  shift
  began=$(now)
  until "$@"; do
    awk -v a="$began" -v b="$(now)" -v limit="$limit" 'BEGIN { exit !(b - a < limit) }' || return 1
    sleep 0.05
  done
}

# Kills the process, not the container by Docker's command: that would count as told to stop, and nothing would be restarted.
kill_process() { kill -KILL "$(pid_of "$1")"; }

runs_and_is_well() {
  [ "$(docker_cli inspect --format '{{.State.Running}}' "$1")" = true ] && docker_cli exec "$1" zerodrift health >/dev/null 2>&1
}

# A process that was killed is there again, and well by its own account.
back_after_kill() {
  local container began
  container=$(container_of "$1" "$2")
  began=$(now)
  kill_process "$container"
  sleep 0.2
  until_within 15 runs_and_is_well "$container" || { docker_cli logs --tail 5 "$container"; return 1; }
  echo "well again after $(since "$began") s"
}

turns_unhealthy_and_back() {
  local container pid began status=0
  container=$(container_of "$1" "$2")
  pid=$(pid_of "$container")
  began=$(now)
  kill -STOP "$pid"
  until_within 20 is_health "$container" unhealthy || status=1
  echo "unhealthy after $(since "$began") s"
  kill -CONT "$pid"
  return "$status"
}
all_are_well() {
  local service
  for service in $(compose "$@" config --services); do runs_and_is_well "$(container_of "$1" "$service")" || return 1; done
}
is_health() { [ "$(docker_cli inspect --format '{{.State.Health.Status}}' "$1")" = "$2" ]; }

# Stops each service of a project and looks at time and exit code.
stops_in_time() {
  local project=$1 service container began took code slowest=0 status=0 count=0
  for service in $(compose "$@" config --services); do
    container=$(container_of "$project" "$service")
    [ -n "$container" ] || { echo "$service has no container"; status=1; continue; }
    count=$((count + 1))
    began=$(now)
    docker_cli stop --time 10 "$container" >/dev/null
    took=$(since "$began")
    code=$(docker_cli inspect --format '{{.State.ExitCode}}' "$container")
    at_most "$took" "$stop_limit_s" s >/dev/null && [ "$code" = 0 ] || { echo "$service: $took s, exit code $code"; status=1; }
    slowest=$(awk -v a="$slowest" -v b="$took" 'BEGIN { print (a > b ? a : b) }')
  done
  echo "$count services, slowest $slowest s"
  [ "$count" -gt 0 ] && return "$status"
}

# undisturbed SET_UP RECORDING [WHO]: 10 s in which nothing happens; who: whoever listens.
undisturbed() {
  local begin end
  begin=$(now)
  sleep 10
  end=$(now)
  check "$1: 10 s at $gyro_rate_hz Hz, ${3:-every raw sample answered} exactly once" \
    samples exact "$work/recordings/$2.mcap" --from "$begin" --to "$end" --at-least "$(half_of_s 10)"
}

# nothing_lost TITLE RECORDING SINCE SECONDS [ARGUMENT...]: of what was sent from then on, for at least so many seconds.
nothing_lost() {
  check "$1" samples exact "$work/recordings/$2.mcap" --from "$3" --to "$(now)" --at-least "$(half_of_s "$4")" "${@:5}"
}

down() { compose "$@" down --volumes --remove-orphans --timeout 5 >/dev/null 2>&1; }

# --- one computer, UDP on loopback
one_computer() {
  local begin end service mark container restarts
  local p=(zd_one -f one_computer.yaml)
  record one --network host
  sleep 1
  begin=$(now)
  check "one computer: compose up --wait" compose "${p[@]}" up --detach --wait
  echo "     compose up --wait took $(since "$begin") s"
  sleep 1
  check "one computer: first compensated sample within $start_limit_s s" first_sample one "$begin"
  undisturbed "one computer" one
  check "one computer: page and health of the console" console_answers

  for service in thermal_publisher allan_monitor console compensation_standby compensation gyro_publisher; do
    mark=$(now)
    check "one computer: $service killed (SIGKILL), there again" back_after_kill "${p[0]}" "$service"
    sleep 4
    end=$(now)
    check "one computer: $service killed, data flow again within $restart_limit_s s" \
      samples gap "$work/recordings/one.mcap" --from "$mark" --to "$end" --at-most "$restart_limit_s"
    case $service in
      gyro_publisher) check "one computer: $service killed, only its own samples missing" \
          samples exact "$work/recordings/one.mcap" --from "$mark" --to "$end" --lost-with-gyro ;;
      *) check "one computer: $service killed, no sample missing or doubled downstream" \
          samples exact "$work/recordings/one.mcap" --from "$mark" --to "$end" --at-least "$(half_of_s 4)" ;;
    esac
  done

  container=$(container_of "${p[0]}" compensation)
  mark=$(now)
  docker_cli pause "$container" >/dev/null
  sleep 2
  docker_cli unpause "$container" >/dev/null
  sleep 3
  nothing_lost "one computer: primary paused 2 s and let go, nothing missing or doubled" one "$mark" 5

  mark=$(now)
  for service in gyro_publisher compensation compensation_standby; do
    docker_cli exec "$(container_of "${p[0]}" "$service")" sh -c 'dd if=/dev/zero of=/dev/shm/fill bs=1M 2>/dev/null; test -s /dev/shm/fill'
  done
  sleep 3
  nothing_lost "one computer: /dev/shm full, nothing missing or doubled" one "$mark" 3

  check "one computer: a stopped process (SIGSTOP) turns unhealthy" turns_unhealthy_and_back "${p[0]}" allan_monitor

  container=$(container_of "${p[0]}" compensation)
  restarts=$(docker_cli inspect --format '{{.RestartCount}}' "$container")
  docker_cli pause "$(container_of "${p[0]}" gyro_publisher)" >/dev/null
  check "one computer: gyro paused past the limit, compensation ends and is restarted (--exit-when-stale)" \
    until_within 20 restarted_since "$container" "$restarts"
  mark=$(now)
  docker_cli unpause "$(container_of "${p[0]}" gyro_publisher)" >/dev/null
  sleep 5
  check "one computer: gyro let go, data flow again within $restart_limit_s s" \
    samples gap "$work/recordings/one.mcap" --from "$mark" --to "$(now)" --at-most "$restart_limit_s"

  stop_record one
  check "one computer: each service stops within $stop_limit_s s with exit code 0" stops_in_time "${p[@]}"
  down "${p[@]}"
}

first_sample() { at_most "$(samples first "$work/recordings/$1.mcap" --since "$2")" "$start_limit_s" s; }
restarted_since() { [ "$(docker_cli inspect --format '{{.RestartCount}}' "$1")" -gt "$2" ]; }
console_answers() {
  curl --silent --fail --max-time 2 "http://127.0.0.1:$console_port/health" | tail -c 200 \
    && curl --silent --fail --max-time 2 "http://127.0.0.1:$console_port/metrics" | grep -c '^[a-z]' | awk '{print $1 " metrics"; exit !($1 > 20)}'
}

# --- two computers, two discovery servers
readonly computers_network=zerodrift_computers computers_subnet=$computers_net.0/24
readonly address_a=$computers_net.11 address_b=$computers_net.12
# with_computer COMMAND A_OR_B ARGUMENT...: the command on the project of one of the two.
with_computer() {
  ZERODRIFT_TEST_COMPUTER=computer_$2 ZERODRIFT_ADDRESS_A=$address_a ZERODRIFT_ADDRESS_B=$address_b \
    "$1" "zd_$2" -f two_computers.yaml -f "$here/two_computers.yaml" --profile "$2" "${@:3}"
}
two_computers() {
  local begin end
  docker_cli network create --subnet "$computers_subnet" "$computers_network" >/dev/null
  docker_cli run -d --name computer_a --network "$computers_network" --ip "$address_a" --no-healthcheck "$image" sleep infinity >/dev/null
  docker_cli run -d --name computer_b --network "$computers_network" --ip "$address_b" --no-healthcheck "$image" sleep infinity >/dev/null
  local servers=(--discovery-server "$address_a" --discovery-server "$address_b")
  record_options=(--interface "$address_b" "${servers[@]}")
  record two --network container:computer_b
  begin=$(now)
  # Both at once, as two computers are switched on.
  with_computer compose b up --detach --wait > "$work/up_b.log" 2>&1 &
  local other=$!
  check "two computers: compose up --wait on A" with_computer compose a up --detach --wait
  check "two computers: compose up --wait on B" up_of_b "$other"
  echo "     compose up --wait on both took $(since "$begin") s"
  sleep 1
  check "two computers: first compensated sample on B within $start_limit_s s" first_sample two "$begin"
  undisturbed "two computers" two "a subscriber on B gets everything"

  begin=$(now)
  kill_process "$(container_of zd_a compensation)"
  sleep 5
  nothing_lost "two computers: primary on A killed, nothing missing or doubled on B" two "$begin" 5

  # The order in which one server alone leaves the subscriber deaf, within 7 s.
  docker_cli kill --signal KILL "$(container_of zd_a gyro_publisher)" >/dev/null
  sleep 1
  docker_cli kill --signal KILL "$(container_of zd_a discovery_server_a)" >/dev/null
  sleep 1
  begin=$(now)
  docker_cli start "$(container_of zd_a gyro_publisher)" >/dev/null
  sleep 2
  docker_cli start "$(container_of zd_a discovery_server_a)" >/dev/null
  sleep 6
  end=$(now)
  check "two computers: publisher, then server A crashed, publisher back: data flow within $restart_limit_s s" \
    samples gap "$work/recordings/two.mcap" --from "$begin" --to "$end" --at-most "$restart_limit_s"
  check "two computers: and every raw sample is answered exactly once" \
    samples exact "$work/recordings/two.mcap" --from "$begin" --to "$end" --lost-with-gyro --at-least "$(half_of_s 4)"
  stop_record two
  record_options=()
  check "two computers: each service of A stops within $stop_limit_s s with exit code 0" stops_of_computer a
  check "two computers: each service of B stops within $stop_limit_s s with exit code 0" stops_of_computer b
  with_computer compose a down --volumes --timeout 5 >/dev/null 2>&1
  with_computer compose b down --volumes --timeout 5 >/dev/null 2>&1
  docker_cli rm -f computer_a computer_b >/dev/null
  docker_cli network rm "$computers_network" >/dev/null
}
up_of_b() { wait "$1" || { tail -5 "$work/up_b.log"; return 1; }; }
stops_of_computer() { with_computer stops_in_time "$1"; }

# --- shared memory
shared_memory() {
  local p=(zd_shm -f one_computer.yaml -f "$here/shared_memory.yaml")
  export ZERODRIFT_OPTIONS="--transport shm" ZERODRIFT_TEST_MEMORY=memory
  docker_cli run -d --name memory --network none --ipc shareable --shm-size 256m --no-healthcheck "$image" sleep infinity >/dev/null
  record_options=(--transport shm)
  record shm --network host --ipc container:memory
  sleep 1
  # Without --wait, which gives up on one that is late once: opening a port may hold a process up for a second.
  check "shared memory: compose up" compose "${p[@]}" up --detach
  check "shared memory: every service is well within 30 s" until_within 30 all_are_well "${p[@]}"
  sleep 2
  undisturbed "shared memory" shm
  check "shared memory: it is used" uses_shared_memory
  stop_record shm
  record_options=()
  check "shared memory: each service stops within $stop_limit_s s with exit code 0" stops_in_time "${p[@]}"
  down "${p[@]}"
  check "shared memory: one that is full is told in one line, exit code 2, no SIGBUS" told_at_start full
  docker_cli rm -f memory >/dev/null
  unset ZERODRIFT_OPTIONS ZERODRIFT_TEST_MEMORY
  check "shared memory: too small a one is told in one line, exit code 2" told_at_start small
  check "shared memory: not shared (private IPC) is told in one line, exit code 2, never silence" told_when_private
}
uses_shared_memory() { docker_cli exec memory sh -c 'ls /dev/shm | grep -c fastrtps' | awk '{print $1 " segments"; exit !($1 > 0)}'; }

told_at_start() {
  local options=() code=0 output
  case $1 in
    full) options=(--ipc container:memory); docker_cli exec --user 0 memory sh -c 'dd if=/dev/zero of=/dev/shm/fill bs=1M 2>/dev/null; true' ;;
    small) options=(--shm-size 64k) ;;
  esac
  output=$(timeout 20 env DOCKER_HOST="unix://$engine_socket" /usr/bin/docker run --rm --name told --network host "${options[@]}" \
    --tmpfs /run/zerodrift:uid=10001 "$image" compensation --domain "$domain" --transport shm 2>&1) || code=$?
  docker_cli rm -f told >/dev/null 2>&1
  [ "$1" != full ] || docker_cli exec --user 0 memory rm -f /dev/shm/fill
  tail -1 <<< "$output"
  [ "$code" -eq 2 ] || { echo "exit code $code"; return 1; }
}

told_when_private() {
  local run=(docker_cli run -d --network host --ipc private --tmpfs /run/zerodrift:uid=10001 "$image") code told
  "${run[@]:0:2}" -d --name private_1 "${run[@]:3}" compensation --domain "$domain" --transport shm >/dev/null
  sleep 1
  "${run[@]:0:2}" -d --name private_2 "${run[@]:3}" allan_monitor --domain "$domain" --transport shm >/dev/null
  until_within 15 eval '[ "$(docker_cli inspect --format "{{.State.Running}}" private_1)" = false ] || [ "$(docker_cli inspect --format "{{.State.Running}}" private_2)" = false ]'
  sleep 1
  told=0
  local container
  for container in private_1 private_2; do
    [ "$(docker_cli inspect --format '{{.State.Running}}' "$container")" = false ] || continue
    code=$(docker_cli inspect --format '{{.State.ExitCode}}' "$container")
    [ "$code" -eq 2 ] && told=$((told + 1))
    echo "$container: exit code $code: $(docker_cli logs "$container" 2>&1 | tail -1)"
  done
  docker_cli rm -f private_1 private_2 >/dev/null
  [ "$told" -ge 1 ]
}
