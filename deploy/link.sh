#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Leaves a link to a built `zerodrift` where a shell finds it, and says where that is.
#   deploy/link.sh PROGRAM
# ZERODRIFT_LINK_DIR names the folder of the link (default: /usr/local/bin). Only a link to a `zerodrift` of a build folder
# is replaced. Where no link can be made a line says so; that is no error, since the program is built all the same.
set -euo pipefail
program=$1
folder=${ZERODRIFT_LINK_DIR:-/usr/local/bin}
link=$folder/zerodrift

# Of a build folder, or of one that is gone.
is_built() { [[ $1 == */bin/zerodrift ]] && { [ -f "${1%/bin/zerodrift}/CMakeCache.txt" ] || [ ! -e "$1" ]; }; }
without_link() { echo "setup: zerodrift is $program; no link in $folder: $1"; exit 0; }

if [ -e "$link" ] || [ -L "$link" ]; then
  { [ -L "$link" ] && is_built "$(readlink "$link")"; } || without_link "another zerodrift is there"
fi
as=()
if [ ! -w "$folder" ]; then
  sudo -n true 2>/dev/null || without_link "it can't be written"
  as=(sudo -n)
fi
[ "$(readlink "$link" || true)" = "$program" ] || "${as[@]}" ln -sfn "$program" "$link"
echo "setup: zerodrift is $link"
