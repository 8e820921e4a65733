#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# manual_test.sh BUILD_DIR: the manual pages that the build makes say what the programs' help says. A line each: PASS or FAIL;
# exit code 1: something failed.
set -uo pipefail
export LC_ALL=C
build=$1
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_manual.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
help_of() { if [ "$1" = zerodrift ]; then "$build/bin/zerodrift" --help; else "$build/bin/zerodrift" "${1#zerodrift-}" --help; fi; }
pages() { (cd "$build/man/man1" && printf "%s\n" *.1.gz | sed "s/\.1\.gz\$//" | sort); }
# As `zerodrift --help` lists them, but the bench, which isn't installed.
every_command_has_one() {
  diff <(pages) <({ echo zerodrift; help_of zerodrift | sed '1,/^\(Subcommands\|Programs of their own\):/d' | sed -n 's/^  \([a-z][a-z-]*\).*/zerodrift-\1/p' | grep -v bench; } | sort)
}
# Every option of the help is in the page, as text and not as roff's own.
has_every_option() {
  local name option
  for name in $(pages); do
    for option in $(help_of "$name" | grep -oE -- '--[a-z][a-z0-9-]*' | sort -u); do
      zcat "$build/man/man1/$name.1.gz" | sed 's/\\-/-/g; s/\\f[BIR]//g' | grep -qF -- "$option" || { echo "$name lacks $option"; return 1; }
    done
  done
}
has_name_and_synopsis() {
  local name
  for name in $(pages); do
    zcat "$build/man/man1/$name.1.gz" > "$work/page"
    grep -qx '\.SH NAME' "$work/page" && grep -q "^$name \\\\- [A-Za-z]" "$work/page" && grep -qx '\.SH SYNOPSIS' "$work/page" || { echo "$name"; return 1; }
  done
}
is_made_again_to_the_bit() {
  local again=$work/again
  SOURCE_DATE_EPOCH=0 "$(dirname "$0")/../../cmake/man_pages.sh" "$build/bin" "$work/once" 0 &&
    SOURCE_DATE_EPOCH=0 "$(dirname "$0")/../../cmake/man_pages.sh" "$build/bin" "$again" 0 && diff -r "$work/once" "$again"
}
renders() { zcat "$build/man/man1/zerodrift-compensate.1.gz" > "$work/p.1" && man -l "$work/p.1" | grep -q -- '--record'; }
check "every command has a page, and nothing else" every_command_has_one
check "each has its name and how it is called" has_name_and_synopsis
check "each has every option of the help" has_every_option
check "they are made again to the bit" is_made_again_to_the_bit
if command -v man > /dev/null; then check "man shows one" renders; fi
exit $failed
