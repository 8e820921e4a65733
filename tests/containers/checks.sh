# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Named checks and their tally. Sourced by run.sh. Needs: work.

passed=0 failed_names=()

# check NAME COMMAND...: one line PASS or FAIL, with the last line that the command printed as the figure.
check() {
  local name=$1 status=0 figure
  shift
  "$@" > "$work/check.log" 2>&1 || status=$?
  figure=$(grep -v '^[[:space:]]*$' "$work/check.log" | tail -1 | cut -c1-240)
  if [ "$status" -eq 0 ]; then
    passed=$((passed + 1))
    echo "PASS $name${figure:+: $figure}"
  else
    failed_names+=("$name")
    echo "FAIL $name${figure:+: $figure}"
    [ "$(wc -l < "$work/check.log")" -le 1 ] || tail -20 "$work/check.log" | sed 's/^/       /'
  fi
}

skip() { echo "SKIP $*"; }

# at_most VALUE LIMIT UNIT
at_most() {
  echo "$1 $3 (at most $2)"
  [[ $1 =~ ^[0-9.]+$ ]] && awk -v value="$1" -v limit="$2" 'BEGIN { exit !(value + 0 <= limit + 0) }'
}

now() { date +%s.%N; }
since() { awk -v a="$1" -v b="$(now)" 'BEGIN { printf "%.2f", b - a }'; }

tally() {
  echo "$passed passed, ${#failed_names[@]} failed"
  [ ${#failed_names[@]} -eq 0 ] || { printf 'failed: %s\n' "${failed_names[@]}"; return 1; }
}
