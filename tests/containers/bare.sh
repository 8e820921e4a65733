# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# A stranger's first minutes: the checkout in a bare Debian of the release, where nothing is installed. Sourced by run.sh. Needs:
# work, base_image, docker_cli, check, make_context.

readonly first_sample_budget_s=300   # on two cores

bare() {
  check "the checkout's files are in a bare Debian $release" bare_is_made
  check "the main job ends well there" bare_runs_the_main_job
  # A figure: it depends on the machine and on the way to the packages.
  echo "     the first compensated sample came after $(first_sample_s) s (goal $first_sample_budget_s s on two cores)"
  check "every command of README.md and docs/ works there" bare_documents run
  check "every tutorial works there as typed" bare_documents tutorials
  docker_cli rm -f bare > /dev/null
}

in_bare() { docker_cli exec bare "$@"; }

# No compiler and no library of ours: what is found later was installed by the two commands.
bare_is_made() {
  [ -d "$work/context/deploy" ] || make_context
  docker_cli run --detach --rm --name bare --workdir /zerodrift "$base_image" sleep infinity > /dev/null || return 1
  docker_cli cp "$work/context/." bare:/zerodrift || return 1
  # shellcheck disable=SC2016  # expanded in the container
  in_bare sh -c 'for tool in g++ cmake ninja protoc fastddsgen java node python3 gnuplot zerodrift; do
      ! command -v "$tool" || exit 1
    done'
}

# Each line behind the seconds since the command was typed. npm trusts what the system trusts (docker/Dockerfile).
bare_runs_the_main_job() {
  # shellcheck disable=SC2016  # expanded in the container
  in_bare bash -c 'SECONDS=0
    { [ -z "$(ls /usr/local/share/ca-certificates)" ] || { apt-get update -qq && apt-get install -y -qq --no-install-recommends ca-certificates; }; } > /dev/null 2>&1
    export NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt
    set -o pipefail
    deploy/run.sh --duration 10min 2>&1 | while IFS= read -r line; do echo "$SECONDS $line"; done' > "$work/main_job.log" || { tail -20 "$work/main_job.log"; return 1; }
  grep -E 'published [1-9]' "$work/main_job.log" | tail -1
}

first_sample_s() { awk '/ out [1-9]/ { print $1; exit }' "$work/main_job.log"; }

# By what runs them in every build; Python is not among what the main job needs.
bare_documents() {  # run | tutorials
  in_bare bash -c "command -v python3 > /dev/null || apt-get install -y -qq --no-install-recommends python3 > /dev/null 2>&1
    tests/docs/commands.py $1 build/release" > "$work/documents.log" || { grep -v '^PASS' "$work/documents.log"; return 1; }
  echo "$(grep -c '^PASS' "$work/documents.log") commands"
}
