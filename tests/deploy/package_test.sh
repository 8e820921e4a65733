#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# package_test.sh BUILD_DIR CPACK: the Debian package that cpack makes. A line each: PASS or FAIL; exit code 1: something failed.
set -uo pipefail
build=$1 cpack=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_package.XXXXXX")
trap 'rm -rf "$work"' EXIT
failed=0
check() {  # TITLE COMMAND...: shows what it wrote where it failed
  local title=$1; shift
  if "$@" > "$work/output" 2>&1; then echo "PASS: $title"; else echo "FAIL: $title"; sed 's/^/  /' "$work/output" | head -20; failed=1; fi
}
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
check "cpack makes it" make
check "it holds what is installed" holds_what_is_installed
check "it unpacks" dpkg-deb -x "$work/zerodrift.deb" "$work/unpacked"
check "it runs" runs
check "it depends on the libraries that it links" depends_on_the_middleware
check "apt would install it" installs
check "its version is the program's" grep -qF "zerodrift $(field Version) " <("$build/bin/zerodrift" --version)
exit $failed
