# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# What can be judged without running anything. Sourced by run.sh. Needs: root, work, docker_cli, check.

project_files() { (cd "$root" && git ls-files -co --exclude-standard -- "$@" | while read -r file; do [ ! -e "$file" ] || echo "$file"; done); }

shell_scripts_are_clean() {
  local scripts=() file
  while read -r file; do
    case $file in
      *.sh) scripts+=("$file") ;;
      *.*) ;;
      *) if head -c 64 "$root/$file" | grep -qE '^#!.*\b(ba)?sh'; then scripts+=("$file"); fi ;;
    esac
  done < <(project_files)
  # Variables cross from one sourced file to another; `a= b=` empties two.
  (cd "$root" && shellcheck --severity=warning --exclude=SC1007,SC2034,SC2154 "${scripts[@]}") && echo "${#scripts[@]} scripts"
}

# Lines may be longer than prose's 80; truth values of others' formats are theirs.
yaml_is_clean() {
  local files
  mapfile -t files < <(project_files '*.yaml' '*.yml')
  (cd "$root" && yamllint --strict --config-data '{extends: default, rules: {line-length: {max: 180}, document-start: disable,
    truthy: {check-keys: false}, braces: {max-spaces-inside: 1}, comments: {min-spaces-from-content: 1}}}' "${files[@]}") \
    && echo "${#files[@]} files"
}

dockerfile_is_clean() {
  mkdir -p "$work/lint"
  cp "$here"/dockerfile_lint.mjs "$here"/package.json "$here"/package-lock.json "$work/lint/"
  (cd "$work/lint" && npm ci --no-audit --no-fund --loglevel=error && node dockerfile_lint.mjs "$root/docker/Dockerfile")
}

compose_files_are_valid() {
  local addresses=(ZERODRIFT_ADDRESS_A=192.0.2.1 ZERODRIFT_ADDRESS_B=192.0.2.2 ZERODRIFT_SECURITY=/etc/zerodrift/security) count=0 arguments
  while read -r arguments; do
    # shellcheck disable=SC2086  # words are wanted
    (cd "$root/deploy/compose" && env "${addresses[@]}" DOCKER_HOST="unix://$engine_socket" DOCKER_CONFIG="$work/config" \
      /usr/bin/docker compose $arguments config -q) || { echo "compose $arguments"; return 1; }
    count=$((count + 1))
  done <<'END'
-f one_computer.yaml
-f one_computer.yaml --profile navigation
-f one_computer.yaml -f realtime.yaml
-f one_computer.yaml -f realtime.yaml --profile navigation
-f one_computer.yaml -f security.yaml --profile navigation
-f one_computer.yaml -f ../../tests/containers/shared_memory.yaml
-f two_computers.yaml --profile a
-f two_computers.yaml --profile b
-f two_computers.yaml --profile a --profile b
-f two_computers.yaml -f ../../tests/containers/two_computers.yaml --profile a
END
  echo "$count combinations"
}

# Every service of every file: what a deployment must not do, and what it must.
compose_files_are_hardened() {
  local files
  for files in "-f one_computer.yaml --profile navigation" "-f two_computers.yaml --profile a --profile b" \
               "-f one_computer.yaml -f realtime.yaml" "-f one_computer.yaml -f security.yaml --profile navigation"; do
    # shellcheck disable=SC2086
    (cd "$root/deploy/compose" && ZERODRIFT_ADDRESS_A=192.0.2.1 ZERODRIFT_ADDRESS_B=192.0.2.2 ZERODRIFT_SECURITY=/x docker_cli compose $files config --format json) \
      > "$work/compose.json" || return 1
    python3 - "$work/compose.json" "$files" <<'PYTHON' || return 1
import json, sys
for name, service in json.load(open(sys.argv[1]))["services"].items():
    wrong = [what for what, good in {
        "read_only": service.get("read_only"), "cap_drop": service.get("cap_drop") == ["ALL"],
        "no-new-privileges": "no-new-privileges:true" in service.get("security_opt", []),
        "not privileged": not service.get("privileged"), "user": service.get("user") == "10001:10001",
        "memory": int(service.get("mem_limit", 0)) > 0, "pids": service.get("pids_limit", 0) > 0,
        "rotation": "max-size" in service.get("logging", {}).get("options", {}), "restart": service.get("restart") == "unless-stopped",
        "health": "healthcheck" in service, "no latest": not service["image"].endswith(":latest") and ":" in service["image"],
        "run": any(entry.startswith("/run/zerodrift") for entry in service.get("tmpfs", [])),
        "grace": service.get("stop_grace_period") == "5s"}.items() if not good]
    if wrong:
        sys.exit(f"{sys.argv[2]}: {name} lacks {', '.join(wrong)}")
PYTHON
  done
}
