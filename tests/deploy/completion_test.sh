#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# completion_test.sh BUILD_DIR SHELL: what bash, zsh or fish offers behind words that were typed. A line each: PASS or FAIL; exit
# code 1: something failed; 77: the shell isn't installed.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
bin=$(cd "$1/bin" && pwd)
shell=$2
completion=$root/deploy/completion/zerodrift.$shell
failed=0
report() {  # FAILED TITLE
  if [ "$1" = 0 ]; then echo "PASS: $2"; else echo "FAIL: $2"; failed=1; fi
}
# With or without the shell: all three read the help by the same two patterns, and name no option of their own.
patterns_of() { grep -oE "'(/\^|--\[)[^']*'" "$1"; }
diff <(patterns_of "$completion") <(patterns_of "$root/deploy/completion/zerodrift.bash") && [ "$(patterns_of "$completion" | wc -l)" = 2 ]
report $? "$shell reads the help as bash does"
[ "$(grep -v '^#' "$completion" | grep -oE -- '--[a-z][a-z-]+' | sort -u)" = --help ] && "$bin/zerodrift" --help > /dev/null
report $? "$shell has no option in its text but --help"
[ $failed = 0 ] || exit 1
command -v "$shell" > /dev/null || { echo "SKIP: $shell isn't installed; what it offers wasn't tried"; exit 77; }

# What is offered behind the words, the last of which is being typed, a line each.
of_bash() {
  # shellcheck disable=SC1090
  . "$completion"
  COMP_WORDS=(zerodrift "$@") COMP_CWORD=$# COMPREPLY=()
  _zerodrift zerodrift
  printf "%s\n" "${COMPREPLY[@]}"
}
# As its own completion system calls it, with stand-ins for what exists within it alone.
of_zsh() {
  # shellcheck disable=SC2016
  zsh -f -c '_files() { }
    compadd() { local one; for one in "${@:2}"; do [[ $one == $words[CURRENT]* ]] && print -r -- $one; done; [[ $# -gt 1 ]] }
    fpath=("$1"); autoload -Uz _zerodrift; words=(zerodrift "${@:2}") CURRENT=$#; _zerodrift' zsh "$work" "$@"
}
of_fish() {
  local line
  line="zerodrift$(printf " %s" "$@")"
  (cd "$work" && fish --no-config -c "source '$completion'; complete -C '$line'") | cut -f1
}
behind() { case $shell in bash) of_bash "$@" ;; zsh) of_zsh "$@" ;; fish) of_fish "$@" ;; esac; }
offers() {  # EXPECTED WORD...
  local offered
  offered=$(behind "${@:2}" | sort | paste -sd ' ')
  if [ "$offered" = "$1" ]; then echo "PASS: ${*:2}"; else echo "FAIL: '${*:2}' offers '$offered', not '$1'"; failed=1; fi
}
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_completion.XXXXXX")
trap 'rm -rf "$work"' EXIT
PATH=$bin:$PATH
ln -s "$completion" "$work/_zerodrift"  # by which name zsh loads it
offers "simulate" sim
offers "compare compensate compensation" com
offers "gyro-publisher" gy
offers "--version" --ver
offers "freeze" ctl fr
offers "--statistic" allan --record record.csv --st
offers "--ros2-frame --ros2-frame-id --ros2-imu" compensation --ros
offers "--pre-trigger" record --out allan --pre
offers "" allan --record rec
exit $failed
