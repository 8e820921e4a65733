# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# A Docker engine of its own for tests/containers/run.sh: daemon, compose, buildx and the base image, without any registry.
# Sourced. Needs: work (a folder for this run), cache (kept between runs). Gives: docker_cli, engine_* functions.

readonly release=bookworm next_release=trixie base_image=debian:bookworm-slim
# A bridge of our own: Docker's usual one belongs to whichever daemon was started last.
# Numbered by this process, so that two runs don't meet.
readonly engine_net=172.31.$((BASHPID % 100 * 2 + 20)) computers_net=172.31.$((BASHPID % 100 * 2 + 21))
readonly engine_bridge=zd$BASHPID
engine_pid='' engine_socket='' engine_containers=''

# Prints why no engine can run here; nothing where one can.
engine_obstacle() {
  [ "$(id -u)" -eq 0 ] || { echo "not root"; return; }
  local tool
  for tool in dockerd debootstrap iptables apt-get; do
    command -v "$tool" >/dev/null || { echo "$tool is not installed (deploy/setup.sh containers installs it)"; return; }
  done
  grep -qw overlay /proc/filesystems || modprobe overlay 2>/dev/null || { echo "the kernel has no overlay file system"; return; }
  [ -e /sys/fs/cgroup/memory ] || [ -e /sys/fs/cgroup/cgroup.controllers ] || { echo "no cgroups are mounted"; return; }
  [ -w /sys/fs/cgroup ] || { echo "cgroups are not writable"; return; }
  local probe=$work/probe
  mkdir -p "$probe"/{lower,upper,work,merged}
  if mount -t overlay overlay -o "lowerdir=$probe/lower,upperdir=$probe/upper,workdir=$probe/work" "$probe/merged" 2>/dev/null; then
    umount "$probe/merged"
  else
    echo "overlay cannot be mounted on $work"
  fi
}

# Starts the daemon on a socket of its own and waits until it answers.
engine_start() {
  engine_socket=$work/docker.sock
  local mtu
  # Bridges take the packet size of the way out, which on virtual machines is often below 1500.
  mtu=$(cat "/sys/class/net/$(ip -4 route show default | awk '{print $5; exit}')/mtu" 2>/dev/null || echo 1500)
  ip link show "$engine_bridge" >/dev/null 2>&1 || ip link add "$engine_bridge" type bridge || return 1
  ip address replace "$engine_net.1/24" dev "$engine_bridge"
  ip link set "$engine_bridge" up mtu "$mtu"
  dockerd --data-root "$work/docker" --exec-root "$work/exec" --pidfile "$work/dockerd.pid" \
    --host "unix://$engine_socket" --storage-driver overlay2 --bridge "$engine_bridge" --mtu "$mtu" > "$work/dockerd.log" 2>&1 &
  engine_pid=$!
  local tries
  for tries in $(seq 100); do
    ! docker_cli version >/dev/null 2>&1 || return 0
    kill -0 "$engine_pid" 2>/dev/null || break
    sleep 0.2
  done
  echo "the daemon did not answer after $tries tries: $(grep -E 'level=(fatal|error)|failed' "$work/dockerd.log" | tail -1)"
  return 1
}

# Ends what was started here and nothing else. Safe to call twice.
engine_stop() {
  [ -n "$engine_pid" ] || return 0
  engine_containers=$(docker_cli ps -aq 2>/dev/null || true)
  # shellcheck disable=SC2086  # one word a container
  [ -z "$engine_containers" ] || docker_cli rm -f $engine_containers >/dev/null 2>&1 || true
  docker_cli network prune --force >/dev/null 2>&1 || true
  kill -TERM "$engine_pid" 2>/dev/null || true
  local tries
  for tries in $(seq 100); do
    kill -0 "$engine_pid" 2>/dev/null || break
    [ "$tries" -ne 80 ] || kill -KILL "$engine_pid" 2>/dev/null || true
    sleep 0.1
  done
  wait "$engine_pid" 2>/dev/null || true
  engine_pid=''
  ip link delete "$engine_bridge" 2>/dev/null || true
  awk -v prefix="$work/" 'index($2, prefix) == 1 {print $2}' /proc/mounts | sort -r | while read -r mount_point; do
    umount -l "$mount_point" 2>/dev/null || true
  done
}

# Debian's client, whatever else lies in PATH.
docker_cli() { DOCKER_HOST=unix://$engine_socket DOCKER_CONFIG=$work/config /usr/bin/docker "$@"; }

# Where this machine takes packages of the release (or "-security", "-updates") from.
mirror_of() { apt-get indextargets --format '$(RELEASE) $(REPO_URI)' | awk -v suite="$1" '$1 == suite {print $2; exit}'; }

# Compose 2 and buildx come from the next Debian release (this one's compose 1 rejects today's files); they need no newer libc.
engine_plugins() {
  local plugins=$cache/cli-plugins
  if [ ! -x "$plugins/docker-compose" ] || [ ! -x "$plugins/docker-buildx" ]; then
    local apt=$work/apt
    rm -rf "$apt"
    mkdir -p "$apt"/{lists/partial,archives/partial,unpacked} "$plugins"
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $(mirror_of $release) $next_release main" > "$apt/sources.list"
    local options=(-q -o Dir::Etc::SourceList="$apt/sources.list" -o Dir::Etc::SourceParts=/dev/null
      -o Dir::State::Lists="$apt/lists" -o Dir::Cache::Archives="$apt/archives" -o APT::Sandbox::User=root)
    apt-get "${options[@]}" update > "$work/plugins.log" 2>&1 || return 1
    (cd "$apt/archives" && apt-get "${options[@]}" download docker-compose docker-buildx) >> "$work/plugins.log" 2>&1 || return 1
    local package
    for package in "$apt"/archives/*.deb; do dpkg-deb -x "$package" "$apt/unpacked" || return 1; done
    find "$apt/unpacked" -type f \( -name docker-compose -o -name docker-buildx \) -perm -u+x -exec cp -t "$plugins" {} +
  fi
  mkdir -p "$work/config"
  ln -sfn "$plugins" "$work/config/cli-plugins"
  docker_cli compose version >/dev/null && docker_cli buildx version >/dev/null
}

# What a registry would give for the FROM line, made from Debian's packages as Docker's slim images are: no documentation,
# no package lists. It trusts what this machine trusts, so that the build reaches the package registries that this machine does.
engine_base_image() {
  local archive=$cache/$release-slim.tar
  if [ ! -s "$archive" ]; then
    local root=$work/base
    debootstrap --variant=minbase "$release" "$root" "$(mirror_of $release)" > "$work/debootstrap.log" 2>&1 || return 1
    local suite
    for suite in $release $release-updates $release-security; do
      [ -z "$(mirror_of $suite)" ] || echo "deb $(mirror_of $suite) $suite main"
    done > "$root/etc/apt/sources.list"
    mkdir -p "$root/usr/local/share/ca-certificates" "$root/etc/ssl/certs"
    cp /usr/local/share/ca-certificates/*.crt "$root/usr/local/share/ca-certificates/" 2>/dev/null || true
    printf '%s\n' 'path-exclude /usr/share/doc/*' 'path-include /usr/share/doc/*/copyright' 'path-exclude /usr/share/man/*' \
      'path-exclude /usr/share/groff/*' 'path-exclude /usr/share/info/*' 'path-exclude /usr/share/lintian/*' \
      'path-exclude /usr/share/locale/*' > "$root/etc/dpkg/dpkg.cfg.d/docker"
    echo force-unsafe-io > "$root/etc/dpkg/dpkg.cfg.d/docker-apt-speedup"
    printf '%s\n' 'DPkg::Post-Invoke { "rm -f /var/cache/apt/archives/*.deb /var/cache/apt/*.bin || true"; };' \
      'Dir::Cache::pkgcache ""; Dir::Cache::srcpkgcache "";' > "$root/etc/apt/apt.conf.d/docker-clean"
    printf '%s\n' 'Acquire::GzipIndexes "true"; Acquire::Languages "none";' 'Apt::AutoRemove::SuggestsImportant "false";' \
      > "$root/etc/apt/apt.conf.d/docker-small"
    find "$root/usr/share/doc" -type f ! -name copyright -delete
    find "$root/usr/share/doc" -type d -empty -delete
    rm -rf "$root"/usr/share/{man,groff,info,lintian,locale}/* "$root"/var/cache/apt/*.bin \
      "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/* "$root"/var/log/{bootstrap.log,apt/*,dpkg.log}
    tar -C "$root" --numeric-owner -cf "$archive.partial" . && mv "$archive.partial" "$archive"
    rm -rf "$root"
  fi
  docker_cli import --change 'CMD ["bash"]' "$archive" "$base_image" >/dev/null
}
