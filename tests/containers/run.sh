#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Builds the image as it is deployed, or from what is built already, runs the compose files and asserts what a subscriber gets, with processes killed, paused and
# stopped; judges image, scripts and files. Needs root on Debian 12; starts an engine of its own and ends it.
#   tests/containers/run.sh [--only image|lint|one_computer|two_computers|shared_memory|units|bare]... [--from-build DIR | --image IMAGE.tar]
#                           [--keep DIR]
# --from-build takes the programs and the page that lie in DIR, a release build on Debian 12 as the image's own is: all but the image's
# two building stages is tested. --image takes an image that `docker save` wrote. --keep leaves recordings and logs in DIR. Exit code 0: all passed, or no engine can start here, which
# one line says; 1: a check failed. The base image is kept in ${XDG_CACHE_HOME:-~/.cache}/zerodrift.
set -uo pipefail
export PATH=/usr/bin:/usr/sbin:$PATH   # Debian's own tools, whatever else is installed
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
cache=${XDG_CACHE_HOME:-${HOME:-/root}/.cache}/zerodrift
image=zerodrift:test
domain=${ZERODRIFT_TEST_DOMAIN:-10}
console_port=8798
revision=$(git -C "$root" rev-parse --short HEAD 2>/dev/null || echo unknown)
programs=(gyro_publisher thermal_publisher compensation allan_monitor navigation_filter ctl console discovery_server zerodrift)
only='' given_image='' from_build='' keep=''
while [ $# -gt 0 ]; do
  case $1 in
    --only) only+=" $2"; shift 2 ;;
    --from-build) from_build=$2; shift 2 ;;
    --image) given_image=$2; shift 2 ;;
    --keep) keep=$2; shift 2 ;;
    -h|--help) sed -n '3,11s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
    *) echo "run: found '$1', expected --only PART, --from-build DIR, --image FILE or --keep DIR" >&2; exit 2 ;;
  esac
done
wanted() { [ -z "$only" ] || [[ " $only " == *" $1 "* ]]; }

. "$here/engine.sh"
. "$here/checks.sh"
. "$here/image.sh"
. "$here/lint.sh"
. "$here/flow.sh"
. "$here/bare.sh"

# Its lines are checks of their own.
run_units() {
  local verdict name
  while read -r verdict name; do
    case $verdict in
      PASS:) passed=$((passed + 1)); echo "PASS units: $name" ;;
      FAIL:) failed_names+=("units: $name"); echo "FAIL units: $name" ;;
      *) echo "     $verdict $name" ;;
    esac
  done < <(IMAGE=$image DOCKER=/usr/bin/docker DOCKER_HOST=unix://$engine_socket DOCKER_CONFIG=$work/config "$here/units.sh" 2>&1 \
           || echo "FAIL: units.sh ended with exit code $?")
}

skip_all() { echo "tests/containers: SKIPPED, no engine can start here: $*"; exit 0; }
[ "$(id -u)" -eq 0 ] || skip_all "not root"
"$root/deploy/setup.sh" containers >/dev/null 2>&1 || skip_all "deploy/setup.sh containers could not install what is missing"
mkdir -p "$cache"
work=$(mktemp -d /var/tmp/zerodrift_containers.XXXXXX)
finish() {
  trap '' INT TERM
  [ -z "$keep" ] || { mkdir -p "$keep" && cp -r "$work"/recordings "$work"/*.log "$keep" 2>/dev/null; }
  engine_stop
  rm -rf "$work"
}
trap finish EXIT
trap 'exit 130' INT TERM
obstacle=$(engine_obstacle)
[ -z "$obstacle" ] || skip_all "$obstacle"
engine_start > "$work/obstacle" || skip_all "$(cat "$work/obstacle")"
engine_plugins || skip_all "compose and buildx of Debian $next_release: $(tail -1 "$work/plugins.log")"
engine_base_image || skip_all "the base image: $(tail -1 "$work/debootstrap.log" 2>&1)"
began=$(now)

if wanted lint; then
  check "shell scripts pass shellcheck" shell_scripts_are_clean
  check "YAML passes yamllint" yaml_is_clean
  check "the Dockerfile passes its linter and the project's rules" dockerfile_is_clean
  check "every compose file and combination is valid" compose_files_are_valid
  check "every service is hardened" compose_files_are_hardened
fi

build_s=0
if [ -n "$given_image" ]; then
  docker_cli load --input "$given_image" >/dev/null || exit 2
elif [ -n "$(wanted image && echo 1)$(wanted one_computer && echo 1)$(wanted two_computers && echo 1)$(wanted shared_memory && echo 1)$(wanted units && echo 1)" ]; then
  if [ -n "$from_build" ]; then
    check "the image is made of what is built" make_image_from_build
  else
    make_context
    check "the image builds from nothing" build_image
    echo "     a fresh build took $build_s s (goal $build_budget_s)"   # a figure: it depends on the machine
  fi
  docker_cli image inspect "$image" >/dev/null 2>&1 || { tally; exit 1; }
fi
if wanted image; then
  check "the image is at most $size_budget_mb MB" image_size
  check "it runs as user and group 10001" runs_as_ordinary_user
  check "it has no compiler, Java, Python or package manager of theirs" has_no_build_tools
  check "it is labelled" labelled
  check "its bill of materials is what dpkg-query says" bill_of_materials_is_true
  check "every library that a program needs is there" links_are_complete
  check "every library that a program names is listed in the Dockerfile" libraries_are_listed
  check "every program starts" help_of_every_program
  check "the console serves its page" serves_page
  # cpack takes what is built.
  [ -z "$from_build" ] || check "the Debian package installs on a bare Debian $release and runs" package_installs
fi
if wanted one_computer; then one_computer; fi
if wanted two_computers; then two_computers; fi
if wanted shared_memory; then shared_memory; fi
if wanted units; then
  if [ -x "$here/units.sh" ]; then
    run_units
  else
    skip "units: tests/containers/units.sh is not there"
  fi
fi
# A quarter of an hour, like the image from nothing: by hand.
if wanted bare && [ -z "$from_build$given_image" ]; then bare; fi
echo "took $(since "$began") s"
tally
