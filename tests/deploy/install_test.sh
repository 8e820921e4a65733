#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# install_test.sh BUILD_DIR: what `cmake --install` puts where, and that it works from there. A line each: PASS or FAIL; exit
# code 1: something failed.
set -uo pipefail
build=$1
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d "${TMPDIR:-/tmp}/zerodrift_install.XXXXXX")
prefix=$work/opt
domain=230  # beyond those of tests/system/domains.h
port=18766
console=
finish() { [ -z "$console" ] || kill "$console" 2>/dev/null; wait; rm -rf "$work"; }
trap finish EXIT
. "$(dirname "${BASH_SOURCE[0]}")/checks.sh"
cd "$work" || exit 2
programs='zerodrift
zerodrift-allan-monitor
zerodrift-compensation
zerodrift-console
zerodrift-ctl
zerodrift-discovery-server
zerodrift-gyro-publisher
zerodrift-navigation-filter
zerodrift-thermal-publisher'
folders='bin
lib
lib/systemd
lib/systemd/system
lib/sysusers.d
share
share/bash-completion
share/bash-completion/completions
share/doc
share/doc/zerodrift
share/fish
share/fish/vendor_completions.d
share/man
share/man/man1
share/zerodrift
share/zerodrift/config
share/zerodrift/console
share/zerodrift/idl
share/zerodrift/profiles
share/zerodrift/systemd
share/zsh
share/zsh/vendor-completions'
has_programs() { diff <(ls "$prefix/bin") <(echo "$programs"); }
has_folders() {
  diff <(cd "$prefix" && find bin lib share -maxdepth 2 -type d | sort) \
       <(echo "$folders" | sort) && [ -z "$(find "$prefix" -type d -empty)" ]
}
is_whole() {
  local file
  for file in share/zerodrift/config/paper.yaml share/zerodrift/console/index.html share/zerodrift/console/docs/index.html share/zerodrift/idl/dds/compensated_rate.idl \
    share/zerodrift/idl/proto/telemetry.proto share/zerodrift/profiles/one_computer.xml share/zerodrift/systemd/zerodrift.env \
    share/zerodrift/systemd/realtime.conf share/doc/zerodrift/LICENSE lib/sysusers.d/zerodrift.conf lib/systemd/system/zerodrift.target \
    lib/systemd/system/zerodrift-.service.d/10-common.conf share/man/man1/zerodrift-compensate.1.gz \
    share/bash-completion/completions/zerodrift share/zsh/vendor-completions/_zerodrift share/fish/vendor_completions.d/zerodrift.fish; do
    [ -s "$prefix/$file" ] || { echo "no $file"; return 1; }
  done
}
# Units of one prefix name nothing of another.
units_name() {  # PREFIX FOLDER
  local path
  for path in $(sed -n 's/^\(ExecStart\|WorkingDirectory\)=\([^ ]*\).*/\2/p' "$2"/lib/systemd/system/zerodrift-*.service{,.d/*.conf} | sort -u); do
    [[ $path == "$1"/* ]] && [ -x "$2${path#"$1"}" ] || { echo "$path isn't there"; return 1; }
  done
  [ -n "${path:-}" ]
}
simulates() {
  "$prefix/bin/zerodrift" simulate --model "$prefix/share/zerodrift/config/models/paper_fog.yaml" \
    --profile "$prefix/share/zerodrift/config/profiles/paper_chamber.yaml" --duration 60 --rate 10 --out record.csv &&
    "$prefix/bin/zerodrift" info record.csv
}
helps() {
  local command
  for command in $(sed -n 's/^zerodrift-//p' <<< "$programs"); do
    [ "$command" != ctl ] || command='ctl status'
    # shellcheck disable=SC2086  # a command may be two words
    "$prefix/bin/zerodrift" $command --help | grep -q -- --domain || { echo "$command"; return 1; }
  done
}
serves_page() {
  "$prefix/bin/zerodrift" console --domain $domain --listen 127.0.0.1:$port > console.log 2>&1 &
  console=$!
  local try
  for try in $(seq 100); do
    { exec 3<> /dev/tcp/127.0.0.1/$port; } 2>/dev/null && break
    sleep 0.1
  done
  exec 3>&-
  cat console.log
  get / && diff body "$prefix/share/zerodrift/console/index.html"
}
get() {  # PATH: into head and body
  exec 3<> /dev/tcp/127.0.0.1/$port
  printf 'GET %s HTTP/1.1\r\nHost: 127.0.0.1:%s\r\nConnection: close\r\n\r\n' "$1" $port >&3 && timeout 10 cat <&3 > answer
  exec 3>&-
  sed '/^\r$/,$d' answer | tr -d '\r' > headers && sed '1,/^\r$/d' answer > body
}
has_head() { grep -qxi -- "$1" headers || { cat headers; return 1; }; }
# As the console serves them: each page of the index, what each of them links to, with the page's own headers, and nothing beside them.
serves_documents() {
  local file name path
  get /docs && has_head 'Location: /docs/' || return 1
  get /docs/ && has_head 'Content-Security-Policy: default-src .*' && cp body index || return 1
  for file in "$source"/docs/*.md "$source/deploy/OPERATIONS.md"; do
    [ "${file##*/}" != README.md ] || continue
    name=$(basename "${file,,}" .md).html
    grep -q "href=\"$name\"" index || { echo "$name isn't in the index"; return 1; }
    get "/docs/$name" && has_head 'Content-Type: text/html; charset=utf-8' && cp body "page_$name" || return 1
    grep -qF "$(sed -n '1s/^# *//p' "$file" | cut -d '`' -f 1)" "page_$name" || { echo "$name lacks the title of $file"; return 1; }
  done
  grep -ohE '(href|src)="[a-z][^":]*"' index page_* | cut -d '"' -f 2 | sort -u > linked
  [ "$(wc -l < linked)" -gt 25 ] || { echo "few links:"; cat linked; return 1; }
  while IFS='#' read -r name path; do
    get "/docs/$name" && has_head 'HTTP/1.1 200 OK' || { echo "$name is linked to"; return 1; }
    [ -z "$path" ] || grep -q "id=\"$path\"" body || { echo "$name has no #$path"; return 1; }
  done < linked
  for path in /docs/../../config/paper.yaml /docs/..%2f..%2fconfig/paper.yaml /docs/index.html.. /docs//etc/passwd; do
    get "$path" && grep -q '^HTTP/1.1 40[04] ' headers || { echo "$path"; cat headers; return 1; }
  done
}
check "it installs" cmake --install "$build" --prefix "$prefix"
check "programs say whose they are" has_programs
check "nothing goes elsewhere" has_folders
check "configuration, page, vocabulary, profiles, units, manual, completion and licence are there" is_whole
check "units name the programs of their prefix" units_name "$prefix" "$prefix"
check "a record is simulated and read" simulates
check "every service is found" helps
check "the console serves its page" serves_page
check "the console serves the documents" serves_documents
check "it installs into a package's folder, stripped" env DESTDIR="$work/package" cmake --install "$build" --prefix /usr --strip
check "units name the programs of /usr there" units_name /usr "$work/package/usr"
is_stripped() { [ "$(stat -c %s package/usr/bin/zerodrift)" -lt "$(stat -c %s "$prefix/bin/zerodrift")" ]; }
check "programs are stripped there" is_stripped
exit $failed
