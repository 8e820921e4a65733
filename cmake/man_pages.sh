#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# man_pages.sh BIN FOLDER VERSION: a manual page of `zerodrift`, of each of its commands and of each program of its own, made by
# help2man of what they say of themselves (--help). FOLDER holds those of this run alone.
set -euo pipefail
export LC_ALL=C
bin=$1 folder=$2 version=$3
rm -rf "$folder"
mkdir -p "$folder"

# "name about" of each command under this heading of --help, which wraps what is long.
listed() {  # HEADING
  "$bin/zerodrift" --help | awk -v heading="$1:" '
    function flush() { if (line != "") print line; line = "" }
    $0 == heading { inside = 1; next }
    /^[^ ]/ { flush(); inside = 0 }
    inside && /^  [a-z]/ { flush(); name = $1; $1 = ""; line = name $0; next }
    inside && NF > 0 { sub(/^ +/, ""); line = line " " $0 }
    END { flush() }'
}
# help2man names a page after the file that it asks.
asked=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_man.XXXXXX")
trap 'rm -rf "$asked"' EXIT
page() {  # NAME ABOUT [COMMAND]
  local name=$1 about=$2 command=${3:-}
  printf '#!/bin/sh\nexec "%s" %s "$@"\n' "$bin/zerodrift" "$command" > "$asked/$name"
  chmod +x "$asked/$name"
  help2man --section 1 --no-info --source "zerodrift $version" --manual zerodrift --version-string "$name $version" \
    --name "$about" --output "$folder/$name.1" "$asked/$name"
}

page zerodrift "zero-drift compensation of gyros, from simulation to control"
while read -r name about; do
  page "zerodrift-$name" "$about" "$name"
done < <(listed Subcommands)
while read -r name about; do
  [ "$name" = bench ] || page "zerodrift-$name" "$about" "$name"  # it isn't installed
done < <(listed "Programs of their own")
gzip -9 -n "$folder"/*.1
