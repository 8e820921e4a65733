#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# commit_test.sh CMAKE: cmake/commit.cmake on checkouts of its own. A line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
cmake=$1
script=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/cmake/commit.cmake
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_commit.XXXXXX")
trap 'rm -rf "$work"' EXIT
unset GIT_DIR GIT_WORK_TREE
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null GIT_AUTHOR_NAME=a GIT_AUTHOR_EMAIL=a@a GIT_COMMITTER_NAME=a GIT_COMMITTER_EMAIL=a@a
failed=0
commit_of() { "$cmake" -DSOURCE="$1" -DHEADER="$work/commit.h" "${@:2}" -P "$script" && sed -n 's/^#define ZERODRIFT_COMMIT "\(.*\)"$/\1/p' "$work/commit.h"; }
check() {  # TITLE EXPECTED FOLDER ARGUMENTS...
  local found
  found=$(commit_of "${@:3}")
  if [ "$found" = "$2" ]; then echo "PASS: $1"; else echo "FAIL: $1: found '$found', expected '$2'"; failed=1; fi
}
mkdir -p "$work/checkout/inner"
cd "$work/checkout" || exit 2
git init -q . && echo one > file && git add file && git commit -qm one && git tag v9
head=$(git rev-parse --short=7 HEAD)
check "a commit, by its number though it has a name" "$head" "$work/checkout"
touch -d '2001-01-01' "$work/commit.h"
check "the same again" "$head" "$work/checkout"
if [ "$(stat -c %Y "$work/commit.h")" -lt 1000000000 ]; then echo "PASS: it is not written again"; else echo "FAIL: it was written again"; failed=1; fi
check "sources that lie in a checkout of something else" unknown "$work/checkout/inner"
echo new > untracked
check "a file that isn't tracked is no difference" "$head" "$work/checkout"
echo two > file
check "with changes" "$head+" "$work/checkout"
check "a commit that is given" 1234567 "$work/checkout/inner" -DGIVEN=1234567
exit $failed
