# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# The image: how it is built and what is in it. Sourced by run.sh. Needs: root, work, image, docker_cli, check.

readonly size_budget_mb=120 build_budget_s=300

# The checkout as it would be cloned, with what is changed in it and without what git ignores.
make_context() {
  mkdir -p "$work/context"
  (cd "$root" && git ls-files -co --exclude-standard -z | while IFS= read -r -d '' file; do
    [ ! -e "$file" ] || printf '%s\0' "$file"
  done | tar --null --files-from - -cf -) | tar -C "$work/context" -xf -
}

# What the building stages of the Dockerfile would give, from a build folder of this machine; the last stage is the Dockerfile's own.
make_image_from_build() {
  grep -qx "VERSION_CODENAME=$release" /etc/os-release || { echo "this is not Debian $release, as the image is"; return 1; }
  grep -qx 'CMAKE_BUILD_TYPE:STRING=Release' "$from_build/CMakeCache.txt" || { echo "$from_build is no release build"; return 1; }
  grep -qxE 'CMAKE_CXX_COMPILER:[A-Z]+=/usr/bin/(c\+\+|g\+\+)' "$from_build/CMakeCache.txt" ||
    { echo "$from_build is not built by Debian's own compiler"; return 1; }
  mkdir -p "$work/context/docker" "$work/context/page/usr/share/zerodrift"
  DESTDIR=$work/context/build cmake --install "$from_build" --prefix /usr --strip >/dev/null || return 1
  rm -r "$work/context/build/usr/share/man"  # as docker/Dockerfile does
  mv "$work/context/build/usr/share/zerodrift/console" "$work/context/page/usr/share/zerodrift/" || return 1
  cp "$root/docker/sbom.sh" "$work/context/docker/"
  {
    printf 'FROM scratch AS page\nCOPY page/ /install/\nFROM scratch AS build\nCOPY build/ /install/\n'
    awk '/^FROM /{stage = ""} {stage = stage $0 "\n"} END {printf "%s", stage}' "$root/docker/Dockerfile"
  } > "$work/context/docker/Dockerfile"
  build_image
}

build_image() {
  local began
  began=$(now)
  DOCKER_BUILDKIT=1 docker_cli build --no-cache --progress plain --tag "$image" --build-arg REVISION="$revision" \
    --file "$work/context/docker/Dockerfile" "$work/context" > "$work/build.log" 2>&1 || { tail -40 "$work/build.log"; return 1; }
  build_s=$(since "$began")
  echo "$build_s s"
}

in_image() { docker_cli run --rm --network none --read-only "$image" "$@"; }

image_size() {
  local bytes
  bytes=$(docker_cli image inspect --format '{{.Size}}' "$image")
  at_most "$(awk -v bytes="$bytes" 'BEGIN { printf "%.1f", bytes / 1e6 }')" "$size_budget_mb" MB
}

runs_as_ordinary_user() {
  [ "$(docker_cli image inspect --format '{{.Config.User}}' "$image")" = 10001:10001 ] \
    && [ "$(in_image id -u):$(in_image id -g)" = 10001:10001 ] && echo "10001:10001"
}

has_no_build_tools() {
  # shellcheck disable=SC2016  # expanded in the container
  in_image sh -c 'found=
    for tool in gcc g++ cc c++ cpp as ld make cmake ninja protoc fastddsgen java javac python python3 node npm curl wget; do
      command -v "$tool" >/dev/null && found="$found $tool"
    done
    for pattern in "/usr/lib/gcc*/*/*/cc1*" "/usr/lib/jvm/*" "/usr/include/c++*"; do
      for file in $pattern; do [ -e "$file" ] && found="$found $file"; done
    done
    [ -z "$found" ] || { echo "found:$found"; exit 1; }'
}

labelled() {
  local label missing='' value
  for label in title description licenses version revision base.name; do
    value=$(docker_cli image inspect --format "{{index .Config.Labels \"org.opencontainers.image.$label\"}}" "$image")
    [ -n "$value" ] || missing+=" $label"
  done
  value=$(docker_cli image inspect --format '{{index .Config.Labels "org.opencontainers.image.revision"}}' "$image")
  [ "$value" = "$revision" ] || missing+=" (revision is '$value', not '$revision')"
  [ -z "$missing" ] || { echo "missing:$missing"; return 1; }
}

bill_of_materials_is_true() {
  in_image cat /usr/share/zerodrift/sbom.spdx.json > "$work/sbom.json"
  # shellcheck disable=SC2016  # dpkg-query's own variables
  in_image dpkg-query -W -f '${db:Status-Abbrev}\t${Package}\t${Version}\t${Architecture}\n' > "$work/installed.txt"
  python3 - "$work/sbom.json" "$work/installed.txt" <<'PYTHON'
import json, sys
document = json.load(open(sys.argv[1]))
assert document["spdxVersion"] == "SPDX-2.3" and document["SPDXID"] == "SPDXRef-DOCUMENT" and document["dataLicense"] == "CC0-1.0"
image, *packages = document["packages"]
listed = {(p["name"], p["versionInfo"], p["externalRefs"][0]["referenceLocator"].split("arch=")[1].split("&")[0]) for p in packages}
installed = {tuple(row.split("\t")[1:]) for row in open(sys.argv[2]).read().splitlines() if row.startswith("ii")}
ids = [p["SPDXID"] for p in document["packages"]]
contained = {r["relatedSpdxElement"] for r in document["relationships"] if r["relationshipType"] == "CONTAINS"}
if listed != installed or len(set(ids)) != len(ids) or contained != set(ids[1:]) or len(installed) < 50:
    sys.exit(f"differs: {sorted(listed ^ installed)[:5]}, {len(ids) - len(set(ids))} ids twice")
print(f"{len(packages)} packages")
PYTHON
}

# Needs what ldd says of all programs, and of each that the checkout says is a service or the command line.
links_are_complete() {
  # shellcheck disable=SC2016  # expanded in the container
  in_image sh -c 'status=0
    for program in '"${programs[*]}"'; do
      path=$(command -v "$program") || { echo "$program is not installed"; status=1; continue; }
      ldd "$path" > /dev/null || status=1
      missing=$(ldd "$path" | grep "not found") && { echo "$program: $missing"; status=1; }
    done
    exit $status'
}

# The Dockerfile lists the package of every library that a program names, not only what others happen to bring.
libraries_are_listed() {
  local program library package listed unlisted=''
  listed=$(sed -n '/^# What the programs link/,/rm -rf/p' "$root/docker/Dockerfile" | grep -oE '^ +lib[a-z0-9.+-]+' | tr -d ' ')
  local container
  container=$(docker_cli create "$image")
  mkdir -p "$work/programs"
  for program in "${programs[@]}"; do docker_cli cp --follow-link "$container:/usr/bin/$program" "$work/programs/" || return 1; done
  docker_cli rm "$container" >/dev/null
  for library in $(objdump -p "$work"/programs/* | awk '$1 == "NEEDED" {print $2}' | sort -u); do
    package=$(in_image sh -c "dpkg-query -S '*/$library' 2>/dev/null | head -1" | cut -d: -f1)
    case $package in
      libc6|libgcc-s1|libstdc++6) ;;  # the compiler's own
      *) grep -qxF "$package" <<< "$listed" || unlisted+=" $library($package)" ;;
    esac
  done
  [ -z "$unlisted" ] || { echo "not listed:$unlisted"; return 1; }
}

help_of_every_program() {
  local program
  for program in "${programs[@]}"; do in_image "$program" --help >/dev/null || { echo "$program --help: $?"; return 1; }; done
  in_image zerodrift --help | grep -q health
}

serves_page() {
  local status=0
  docker_cli run -d --name page --network host --read-only --cap-drop ALL --security-opt no-new-privileges \
    --tmpfs /run/zerodrift:uid=10001 "$image" console --domain "$domain" --listen 127.0.0.1:8799 >/dev/null || return 1
  local tries body=''
  for tries in $(seq 50); do
    body=$(curl --silent --fail --max-time 2 http://127.0.0.1:8799/ || true)
    [ -z "$body" ] || break
    sleep 0.1
  done
  local script
  script=$(grep -oE 'src="[^"]+\.js"' <<< "$body" | head -1 | cut -d'"' -f2)
  [ -n "$script" ] || { echo "no script in what is served after $tries tries"; status=1; }
  curl --silent --fail --max-time 2 "http://127.0.0.1:8799/${script#./}" | wc -c | awk '{print $1 " bytes of script"; exit !($1 > 10000)}' || status=1
  docker_cli rm -f page >/dev/null
  return "$status"
}

# On a Debian that has nothing but its base: the package brings what it needs, the units' user and nothing that runs.
package_installs() {
  local folder=$work/package_context
  mkdir -p "$folder"
  (cd "$from_build" && cpack -B "$work/package" > /dev/null) || return 1
  cp "$work"/package/zerodrift_*.deb "$folder/zerodrift.deb"
  printf '%s\n' 'FROM debian:bookworm-slim' 'COPY zerodrift.deb /tmp/' \
    'RUN apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends systemd /tmp/zerodrift.deb' > "$folder/Dockerfile"
  DOCKER_BUILDKIT=1 docker_cli build --progress plain --tag zerodrift-package:test "$folder" > "$work/package.log" 2>&1 || { tail -20 "$work/package.log"; return 1; }
  docker_cli run --rm --network none zerodrift-package:test sh -ec '
    zerodrift --version
    zerodrift console --help > /dev/null
    cd /usr/share/zerodrift
    zerodrift simulate --model config/models/paper_fog.yaml --profile config/profiles/paper_chamber.yaml --duration 60s --out /tmp/record.csv
    zerodrift info /tmp/record.csv > /dev/null
    getent passwd zerodrift
    systemd-analyze verify --man=no zerodrift-console.service
    ! dpkg -l gcc >/dev/null 2>&1'
}
