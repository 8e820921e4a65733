#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# package_test.sh BUILD_DIR CPACK: the Debian package that cpack makes. A line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$1 cpack=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_package.XXXXXX")
trap 'rm -rf "$work"' EXIT
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
make() { (cd "$build" && "$cpack" -B "$work/made") && mv "$work"/made/zerodrift_*_"$(dpkg --print-architecture)".deb "$work/zerodrift.deb"; }
field() { dpkg-deb -f "$work/zerodrift.deb" "$1"; }
# Its files are those that are installed, all of root.
holds_what_is_installed() {
  DESTDIR=$work/installed cmake --install "$build" --prefix /usr > /dev/null || return 1
  dpkg-deb -c "$work/zerodrift.deb" > "$work/listed"
  [ "$(awk '{print $2}' "$work/listed" | sort -u)" = root/root ] && [ "$(grep -c '^-' "$work/listed")" -gt 40 ] &&
    diff <(sed -n 's,^-.* \./,,p' "$work/listed" | sort) <(cd "$work/installed" && find . -type f | sed 's,^\./,,' | sort)
}
# dpkg-shlibdeps asked the programs.
depends_on_the_middleware() { field Depends | grep -E 'libfastrtps[0-9.]+ \(>= ' && field Depends | grep -E 'libprotobuf[0-9]+ '; }
runs() { "$work/unpacked/usr/bin/zerodrift" --version && "$work/unpacked/usr/bin/zerodrift" console --help; }
installs() { apt-get -s install "$work/zerodrift.deb" | grep '^Inst zerodrift '; }
# A removed package's services would run on, and be wanted at the next boot.
stops_what_it_removes() {
  dpkg-deb -e "$work/zerodrift.deb" "$work/control" || return 1
  local script
  for script in postinst prerm postrm; do
    [ -x "$work/control/$script" ] && sh -n "$work/control/$script" || { echo "$script"; return 1; }
  done
  grep -q 'systemctl stop' "$work/control/prerm" && "$work/control/prerm" upgrade 1 && "$work/control/postrm" purge
}
# Of Debian's machine-readable format: each paragraph has its fields, each licence that is named has its text, and what the
# page depends on is named with the version that is locked.
licences_are_told() {
  local file=$work/unpacked/usr/share/doc/zerodrift/copyright lock=$here/../../services/console/page/package-lock.json name version
  [ "$(head -1 "$file")" = "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/" ] || { head -1 "$file"; return 1; }
  awk -v RS= '/^Files: / && !(/\nCopyright: [^\n]/ && /\nLicense: [^\n]/) { print "incomplete: " $0; bad = 1 }
    NR > 1 && !/^Files: / && !/^License: [^\n]+\n ./ { print "no paragraph: " $0; bad = 1 } END { exit bad }' "$file" || return 1
  diff <(sed -n '/^Files:/,/^$/s/^License: //p' "$file" | sed 's/ and /\n/g' | sort -u) \
    <(awk -v RS= '/^License: / { print $2 }' "$file" | sort) || return 1
  for name in svelte uplot @bufbuild/protobuf; do
    version=$(sed -n "\\,^    \"node_modules/$name\": {,,/}/s/.*\"version\": \"\([^\"]*\)\".*/\1/p" "$lock")
    grep -q "^ $name $version (" "$file" || { echo "$name $version isn't named"; return 1; }
  done
  grep -q '^ Permission is hereby granted, free of charge' "$file"
}
check "cpack makes it" make
check "it holds what is installed" holds_what_is_installed
check "it unpacks" dpkg-deb -x "$work/zerodrift.deb" "$work/unpacked"
check "its copyright file tells the licences of all it holds" licences_are_told
check "it runs" runs
check "it depends on the libraries that it links" depends_on_the_middleware
check "apt would install it" installs
check "it stops what it removes" stops_what_it_removes
check "its version is the program's" grep -qF "zerodrift $(field Version) " <("$build/bin/zerodrift" --version)
exit $failed
