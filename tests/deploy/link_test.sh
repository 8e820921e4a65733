#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# deploy/link.sh in folders of its own. A line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_link.XXXXXX")
trap 'chmod 755 "$work"/*; rm -rf "$work"' EXIT
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
build() { mkdir -p "$work/$1/bin"; touch "$work/$1/CMakeCache.txt"; printf '#!/bin/sh\necho %s\n' "$1" > "$work/$1/bin/zerodrift"; chmod 755 "$work/$1/bin/zerodrift"; }
link() { ZERODRIFT_LINK_DIR=$work/folder "$root/deploy/link.sh" "$work/$1/bin/zerodrift" > "$work/said" 2>&1; }
is_linked() { link "$1" && [ "$("$work/folder/zerodrift")" = "$1" ] && [ "$(cat "$work/said")" = "setup: zerodrift is $work/folder/zerodrift" ]; }
is_left() {  # what `zerodrift` in the folder says, and the reason
  local before; before=$(ls -l "$work/folder")
  link one && [ "$before" = "$(ls -l "$work/folder")" ] &&
    [ "$(cat "$work/said")" = "setup: zerodrift is $work/one/bin/zerodrift; no link in $work/folder: $1" ]
}
mkdir "$work/folder"
build one; build two
check "a link is made" is_linked one
check "it stays" is_linked one
check "a link to another build is replaced" is_linked two
rm -r "$work/two"
check "a link to a build that is gone is replaced" is_linked one
rm "$work/folder/zerodrift"; echo mine > "$work/folder/zerodrift"
check "a file is left alone" is_left "another zerodrift is there"
mkdir -p "$work/opt/bin"; touch "$work/opt/bin/zerodrift"; ln -sfn "$work/opt/bin/zerodrift" "$work/folder/zerodrift"
check "a link to what is installed is left alone" is_left "another zerodrift is there"
rm "$work/folder/zerodrift"; rmdir "$work/folder"
without_sudo() { sudo() { return 1; }; export -f sudo; "$@"; }  # nor does root write where nothing is
nowhere() { link one && [ "$(cat "$work/said")" = "setup: zerodrift is $work/one/bin/zerodrift; no link in $work/folder: it can't be written" ]; }
check "where the folder can't be written a line says so" without_sudo nowhere
exit $failed
