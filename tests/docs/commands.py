#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The commands of the documents, held to what they say.

commands.py known BUILD    every `zerodrift` command and option that a document types is in the program's help; every link leads
                           somewhere; README.md keeps to one page
commands.py run BUILD      those of README.md and docs/ that need no network and no other process are run as typed, in the documents'
                           order, in a folder of their own that holds config/ alone; what runs until it is stopped is stopped once it
                           runs, with a pseudoterminal and a file where a gyro and a thermometer would be
commands.py tutorials BUILD [NAME...]
                           each page of examples/ is typed into a shell of its own, from its first command to its last, in a folder
                           that holds config/ and examples/, and what it prints is held to what the page shows

A line each, PASS, FAIL or NOT RUN with the reason; exit code 1: something failed.
"""

import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LONGEST_README = 120  # lines
SLOWEST_COMMAND_S = 600  # ends what hangs

# What isn't run, by the first rule that fits, and why. A rule that fits nothing is an error.
NOT_RUN = [
    (r"^(deploy/run|tests/run)\.sh", "installs, builds and runs everything: CI does"),
    (r"^zerodrift (compensation|discovery-server)\b.*(\.\.\.$| A )", "has a placeholder: tests/system"),
    (r"^zerodrift (ctl|record|replay)\b", "needs a running system: tests/system"),
    (r"^zerodrift bench\b", "measures for minutes: tests/system runs each for a moment"),
    (r"^zerodrift (info|allan|compensate|export) (--record )?bag\b", "needs a bag of ROS 2: tests/mcap_peer writes one and reads it"),
    (r"^mounting:", "a line of a configuration"),
    (r"^docker\b", "needs an engine: tests/containers"),
    (r"^cd build/release && cpack\b", "installs, as root: tests/deploy makes and unpacks it"),
    (r"^(cmake|c\+\+) ", "installs and builds: tests/deploy/development_test.sh does"),
    (r"^deploy/security/", "has a placeholder: tests/system makes certificates"),
]
SERVICE = r"^zerodrift (console|compensation|gyro-publisher|thermal-publisher)\b"  # runs until it is stopped
# The paper's five hours take minutes to compare; one hour has all that the commands ask of a record. A design is tried on one record
# of each explanation in place of three. A port that is free.
ADDED = {"config/profiles/paper_chamber.yaml": " --duration 1h", "zerodrift design": " --replicates 1",
         "zerodrift console": " --listen 127.0.0.1:0"}
NOT_TYPED = "# not typed by the test: "  # the first line of such a block of a tutorial; its reason follows
TUTORIALS_DOMAIN, SERVICES_DOMAIN = "225", "226"  # beyond those of tests/system
# What a command that isn't run would have left for those behind it.
STAND_INS = {"zerodrift record --out live.mcap": "zerodrift export record.csv --out live.mcap"}


def ordered_pages():
    """README.md, then docs/ in the order of its index."""
    index = (ROOT / "docs/README.md").read_text()
    names = re.findall(r"\]\(([a-z0-9-]+\.md)\)", index)
    unlisted = {path.name for path in (ROOT / "docs").glob("*.md")} - set(names) - {"README.md"}
    if unlisted:
        fail(f"docs/README.md doesn't list {', '.join(sorted(unlisted))}")
    return [ROOT / "README.md"] + [ROOT / "docs" / name for name in names]


def tutorials():
    """The pages of examples/, in the order of their index."""
    pages = [ROOT / "examples" / name for name in re.findall(r"\]\(([a-z0-9_]+/README\.md)\)", (ROOT / "examples/README.md").read_text())]
    for page in set(ROOT.glob("examples/*/README.md")) - set(pages):
        fail(f"examples/README.md doesn't list {page.parent.name}")
    return pages


def other_pages():
    return [ROOT / "docs/README.md", ROOT / "docker/README.md", ROOT / "deploy/OPERATIONS.md", *sorted(ROOT.glob("deploy/*/README.md"))]


def block_lines(text):
    """Lines of indented and fenced blocks, those that go on in the next joined; not what a command prints (```text) or what
    another program is configured with (```yaml)."""
    fenced, joined = False, ""
    for line in re.sub(r"^```(text|yaml)\n.*?^```$", "", text, flags=re.M | re.S).splitlines():
        if line.startswith("```"):
            fenced = not fenced
            continue
        if not fenced and not line.startswith("    "):
            continue
        joined += line.strip()
        if joined.endswith("\\"):
            joined = joined[:-1]
            continue
        yield joined
        joined = ""


def spans(text):
    return re.findall(r"`(zerodrift [^`]+)`", text)


def simple_commands(line):
    """The words of each command of a line; "a && b" are two, "A=b c" is c."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars="&|;")
    lexer.whitespace_split = True
    words = []
    for word in [*lexer, ";"]:
        if set(word) <= set("&|;"):
            while words and re.match(r"^\w+=", words[0]):
                words = words[1:]
            if words:
                yield words
            words = []
        else:
            words.append(word)


failures = 0


def fail(line):
    global failures
    failures += 1
    print("FAIL:", line)


class Help:
    """What a program says of itself, command by command."""

    def __init__(self, program):
        self.program, self.texts = program, {}

    def of(self, path):
        if path not in self.texts:
            done = subprocess.run([self.program, *path, "--help"], capture_output=True, text=True, timeout=60)
            self.texts[path] = done.stdout if done.returncode == 0 else ""
        return self.texts[path]

    def commands(self, path):
        below = re.split(r"\n(?:Subcommands|Programs of their own):\n", self.of(path))[1:]
        return set(re.findall(r"^  ([a-z][a-z-]*)", "\n".join(below), re.M))

    def options(self, path):
        return set(re.findall(r"--[a-z][a-z0-9-]*", self.of(path)))


def unknown_words(words, helps):
    """What the program doesn't know of `zerodrift ...`."""
    path = ()
    for word in words:
        if word.startswith("--"):
            if word.split("=")[0] not in helps.options(path):
                yield f"{' '.join(('zerodrift', *path))} has no {word}"
        elif helps.commands(path):
            if word not in helps.commands(path):
                yield f"{' '.join(('zerodrift', *path))} has no command {word}"
                return
            path += (word,)


def check_links(page, text):
    for link in re.findall(r"\]\(([^)\s#]+)(?:#[^)]*)?\)", text):
        if not link.startswith("http") and not (page.parent / link).exists():
            fail(f"{page.relative_to(ROOT)}: nothing is at {link}")


def check_collector(console_help):
    """The collector's configuration names the address and the path that the console has, as Prometheus' own does."""
    block = re.search(r"^```yaml\n(.*?)^```$", (ROOT / "docs/console.md").read_text(), re.M | re.S)
    address = re.search(r"--listen .*?(\d+\.\d+\.\d+\.\d+:\d+)", console_help, re.S)
    if not block or not address:
        return fail("docs/console.md has no block of yaml, or --listen no address")
    for text in (block[1], (ROOT / "deploy/monitoring/prometheus.yaml").read_text()):
        if f'targets: ["{address[1]}"]' not in text or "job_name: zerodrift" not in text:
            fail(f"nobody scrapes {address[1]} as job zerodrift:\n{text}")
    path = re.search(r"metrics_path: (\S+)", block[1])
    if not path or f'path == "{path[1]}"' not in (ROOT / "services/console/console_node.cpp").read_text():
        fail("docs/console.md: the console has no such metrics_path")


def known(build):
    helps, count = Help(build / "bin/zerodrift"), 0
    for page in [*ordered_pages(), *tutorials(), *other_pages(), ROOT / "examples/README.md"]:
        text = page.read_text()
        check_links(page, text)
        for line in [*block_lines(text), *spans(text)]:
            for words in simple_commands(line):
                if words[0] != "zerodrift":
                    continue
                count += 1
                for unknown in unknown_words(words[1:], helps):
                    fail(f"{page.relative_to(ROOT)}: {line}: {unknown}")
    if count < 60:
        fail(f"only {count} commands were found")
    if list(unknown_words(["allan", "--records", "x"], helps)) != ["zerodrift allan has no --records"]:
        fail("an unknown option isn't seen")
    if list(unknown_words(["ctl", "frieze"], helps)) != ["zerodrift ctl has no command frieze"]:
        fail("an unknown command isn't seen")
    if not re.search(shown_pattern("x  1.5 … learning"), "x 1.5 0.2 learning") or re.search(shown_pattern("x 1.5"), "x 175"):
        fail("what a tutorial shows isn't held to what is said")
    # What can't be typed without ROS 2 is what the peers of tests/system are given.
    header = (ROOT / "tests/support/cyclone_loopback.h").read_text()
    settings = "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', header[header.index("kLoopbackOnly"):])).replace('\\"', '"')
    if f"'{settings}'" not in (ROOT / "examples/behind_ros2/README.md").read_text():
        fail("examples/behind_ros2: Cyclone DDS is set up otherwise than in tests/support/cyclone_loopback.h")
    check_collector(helps.of(("console",)))
    lines = len((ROOT / "README.md").read_text().splitlines())
    if lines > LONGEST_README:
        fail(f"README.md has {lines} lines, at most {LONGEST_README} are a page")
    print(f"{count} commands")


def run_service(line, folder, environment):
    """As typed, until its main loop writes the health file; a stop is an orderly end."""
    health = Path(folder, "health")
    health.unlink(missing_ok=True)
    began = time.monotonic()
    service = subprocess.Popen(shlex.split(line), cwd=folder, env={**environment, "ZERODRIFT_HEALTH_FILE": str(health)},
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    while service.poll() is None and not health.exists() and time.monotonic() - began < SLOWEST_COMMAND_S:
        time.sleep(0.05)
    runs = service.poll() is None and health.exists()
    service.terminate()
    said, _ = service.communicate(timeout=SLOWEST_COMMAND_S)
    if runs and service.returncode == 0:
        print(f"PASS: {time.monotonic() - began:.1f} s, until it ran and was stopped: {line}", flush=True)
    else:
        fail(f"{'ended' if runs else 'never ran, and ended'} with {service.returncode}: {line}\n{said[-2000:]}")


def hardware(folder):
    """What stands for the devices that README.md names, by their names; nothing comes from them but a temperature."""
    _, gyro = os.openpty()
    thermometer = Path(folder, "temp1_input")
    thermometer.write_text("25000\n")
    return {"/dev/ttyUSB0": os.ttyname(gyro), "/sys/class/hwmon/hwmon2/temp1_input": str(thermometer)}


def run_line(line, folder, environment):
    began = time.monotonic()
    try:
        done = subprocess.run(["/bin/bash", "-euo", "pipefail", "-c", line], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SLOWEST_COMMAND_S)
        code, said = done.returncode, done.stdout
    except subprocess.TimeoutExpired:
        code, said = "none", f"still runs after {SLOWEST_COMMAND_S} s"
    if code != 0:
        fail(f"exit code {code}: {line}\n{said[-2000:]}")
    else:
        print(f"PASS: {time.monotonic() - began:.1f} s: {line}", flush=True)


def run(build):
    environment = {**os.environ, "PATH": f"{build / 'bin'}:/usr/bin:/bin", "LC_ALL": "C.UTF-8", "ZERODRIFT_DOMAIN": SERVICES_DOMAIN}
    done, fitted, stood_in = set(), set(), set()
    with tempfile.TemporaryDirectory(prefix="zerodrift_docs_") as folder:
        Path(folder, "config").symlink_to(ROOT / "config")
        devices = hardware(folder)
        for page in ordered_pages():
            print(f"--- {page.relative_to(ROOT)}")
            for line in block_lines(page.read_text()):
                bare = re.sub(r"\s+#.*$", "", line)
                if not bare or bare in done:
                    continue
                done.add(bare)
                if bare in STAND_INS:
                    stood_in.add(bare)
                    run_line(STAND_INS[bare], folder, environment)
                rule = next((rule for rule in NOT_RUN if re.search(rule[0], bare)), None)
                if rule is not None:
                    fitted.add(rule)
                    print(f"NOT RUN ({rule[1]}): {bare}")
                    continue
                typed = bare + "".join(more for name, more in ADDED.items() if name in bare)
                for name, stand_in in devices.items():
                    typed = typed.replace(name, stand_in)
                (run_service if re.search(SERVICE, bare) else run_line)(typed, folder, environment)
    for pattern, _ in set(NOT_RUN) - fitted:
        fail(f"no command fits the rule {pattern}")
    for line in set(STAND_INS) - stood_in:
        fail(f"no document types {line}")
    for name in [*ADDED, *devices]:
        if not any(name in line for line in done):
            fail(f"no document types {name}")


def shown_pattern(line):
    """What a line that a page shows stands for: an ellipsis for anything, spaces for any number of them."""
    parts = [r"\s+".join(re.escape(word) for word in part.split()) for part in line.split("…")]
    return r"^\s*" + ".*".join(parts) + r"\s*$"


def check_shown(name, shown, said):
    """Each line that the page shows was said, in the page's order."""
    for line in filter(str.strip, shown.splitlines()):
        found = re.search(shown_pattern(line), said, re.M)
        if not found:
            fail(f"{name}: nobody said, or not in this order: {line}")
        else:
            said = said[found.end():]


def end_session(leader):
    """Every process of a session; whatever their groups are."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            session = int(stat.read_text().rpartition(")")[2].split()[3])
            if session == leader:
                os.kill(int(stat.parent.name), signal.SIGKILL)
        except (OSError, IndexError):
            pass  # it ended meanwhile


def type_tutorial(page, environment):
    """In one shell, as somebody would: its background processes are those of the page."""
    name, text = page.parent.name, page.read_text()
    script, shown, count = [], [], 0
    for kind, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S):
        if kind == "text":
            shown.append(block)
        elif kind != "sh":
            fail(f"{name}: a block is of sh or text, found '{kind}'")
        elif block.startswith(NOT_TYPED):
            print(f"NOT TYPED ({block.splitlines()[0].removeprefix(NOT_TYPED)}): {len(block.splitlines()) - 1} commands of {name}")
        else:
            for line in block_lines(f"```\n{block}```\n"):
                count += 1
                script += [f"echo {shlex.quote('$ ' + line)}", line]
    if not count or re.search(r"^    \S", text, re.M):
        fail(f"{name}: a tutorial's commands stand in blocks of sh, and nothing is indented")
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="zerodrift_tutorial_") as folder:
        for given in ("config", "examples"):
            Path(folder, given).symlink_to(ROOT / given)
        # On the way out nothing is left behind.
        shell = ["trap 'kill $(jobs -p) 2> /dev/null || true' EXIT", *script]
        typed = subprocess.Popen(["/bin/bash", "-euo", "pipefail", "-c", "\n".join(shell)], cwd=folder, env=environment,
                                 stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True)
        try:
            said, _ = typed.communicate(timeout=SLOWEST_COMMAND_S)
        except subprocess.TimeoutExpired:
            end_session(typed.pid)
            said, _ = typed.communicate()
            fail(f"{name}: still runs after {SLOWEST_COMMAND_S} s\n{said[-2000:]}")
            return
    if typed.returncode != 0:
        fail(f"{name}: exit code {typed.returncode} after\n{said[-2000:]}")
        return
    before = failures
    check_shown(name, "".join(shown), said)
    if failures == before:
        print(f"PASS: {time.monotonic() - began:.1f} s: {count} commands of {name}", flush=True)
    else:
        print(said)


def tutorials_run(build, names):
    environment = {**os.environ, "PATH": f"{build / 'bin'}:/usr/bin:/bin", "LC_ALL": "C.UTF-8", "ZERODRIFT_DOMAIN": TUTORIALS_DOMAIN}
    pages = [page for page in tutorials() if not names or page.parent.name in names]
    for page in pages:
        type_tutorial(page, environment)
    if len(pages) < (len(names) or 4):
        fail(f"only {len(pages)} tutorials were found")


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("known", "run", "tutorials") or (len(sys.argv) > 3 and sys.argv[1] != "tutorials"):
        sys.exit("usage: commands.py known|run BUILD | tutorials BUILD [NAME...]")
    built = Path(sys.argv[2]).resolve()
    if sys.argv[1] == "tutorials":
        tutorials_run(built, sys.argv[3:])
    else:
        {"known": known, "run": run}[sys.argv[1]](built)
    sys.exit(1 if failures else 0)
