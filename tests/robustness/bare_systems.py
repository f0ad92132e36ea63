"""Run the two commands of the README on bare systems: a fresh Debian in a folder, as root and as an
ordinary user.

    sudo env PYTHONPATH=. python3 tests/robustness/bare_systems.py bookworm:root trixie:user

A system is the release as debootstrap makes it (variant minbase) plus `make`, nothing else. It has
a clean checkout of HEAD. The ordinary user has no sudo: set-up must then stop and print a line,
which is run as root before the same command is repeated. The new system uses this machine's pip
settings (/etc/pip.conf, PIP_*, root's cache). Needs root and debootstrap.

Of all whose logs are in --logs is said:
the suite ran there without data, with CI=true, each time in another random order.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DEBIAN = {"bookworm": "Debian 12", "trixie": "Debian 13", "forky": "Debian 14 (testing)"}
PLACE = "/home/tester/gaitval"
CERTIFICATES = "/etc/pip-certificates.pem"
"""This machine's PIP_CERT in the new system, where no Debian package replaces it."""


def main() -> None:
    """Try each system in turn; exit 1 if a command failed."""
    arguments = _arguments()
    passed = []
    for system in arguments.systems:
        if not arguments.read:
            _try(*system.split(":"), arguments)
        passed.append(_tell(system, arguments.logs))
    _tell_orders(arguments.logs)
    sys.exit(0 if set(passed) == {2} else 1)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "systems",
        nargs="+",
        metavar="RELEASE:USER",
        choices=[f"{release}:{user}" for release in DEBIAN for user in ("root", "user")],
        help="bookworm, trixie or forky; root or user",
    )
    parser.add_argument("--mirror", help="Debian mirror (default: this machine's)")
    parser.add_argument("--folder", type=Path, default=Path("/opt/chroots"))
    parser.add_argument("--logs", type=Path, default=Path("/tmp/bare-systems"))
    parser.add_argument("--read", action="store_true", help="only write the rows of the logs")
    return parser.parse_args()


def _mirror() -> str:
    for file in sorted(Path("/etc/apt").glob("sources.list*/*")):
        found = re.search(r"^URIs: (\S+/debian)/?$", file.read_text(), re.MULTILINE)
        if found:
            return found[1]
    raise SystemExit("no Debian mirror in /etc/apt/sources.list.d: give --mirror")


def bare(release: str, arguments: argparse.Namespace) -> Path:
    """Folder of the bare release, made once."""
    base: Path = arguments.folder / release
    if not (base / "usr/bin/apt-get").is_file():
        scripts = Path("/usr/share/debootstrap/scripts")
        script = [] if (scripts / release).exists() else [str(scripts / "sid")]
        mirror = arguments.mirror or _mirror()
        subprocess.run(
            ["debootstrap", "--variant=minbase", release, str(base), mirror, *script], check=True
        )
    return base


def _fresh(release: str, user: str, arguments: argparse.Namespace) -> Path:
    """A copy of the bare release with make, the user and a clean checkout."""
    system: Path = arguments.folder / f"run-{release}-{user}"
    if system.exists():
        shutil.rmtree(system)  # mounts ended with their command: see _chroot
    subprocess.run(["cp", "-a", str(bare(release, arguments)), str(system)], check=True)
    connect(system)
    place = system / PLACE[1:]
    place.mkdir(parents=True)
    archive = subprocess.run(
        ["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True
    ).stdout
    subprocess.run(["tar", "-x", "-C", str(place)], input=archive, check=True)
    owner = "root" if user == "root" else "tester"
    script = (
        "apt-get update -qq && apt-get install -y -qq --no-install-recommends make >/dev/null"
        f" && useradd --home /home/tester tester && chown -R {owner} /home/tester"
    )
    subprocess.run([*_chroot(system), "bash", "-c", script], check=True, env=_environment("root"))
    return system


def connect(system: Path) -> None:
    """Let a system reach what this machine reaches: names, registries and certificates."""
    for name in ("/etc/resolv.conf", "/etc/hosts"):
        shutil.copy(name, system / name[1:])
    for name in ("/etc/pip.conf", *_pip_variables().values()):
        source, target = Path(name), system / name.removeprefix("/")
        if not source.is_absolute() or not source.exists():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target)
        else:
            shutil.copy(source, target)
    if CERTIFICATES in _environment("root").values():
        shutil.copy(os.environ["PIP_CERT"], system / CERTIFICATES[1:])
    # A mirror that is no longer updated is good enough here.
    still = system / "etc/apt/apt.conf.d/99-mirror"
    still.write_text('Acquire::Check-Valid-Until "false";\n')


def _pip_variables() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if name.startswith("PIP_")}


def pip_variables() -> dict[str, str]:
    """This machine's settings of pip, for a system that is connected."""
    certificates = {"PIP_CERT": CERTIFICATES} if "PIP_CERT" in os.environ else {}
    return _pip_variables() | certificates


def _environment(user: str) -> dict[str, str]:
    home = "/root" if user == "root" else "/home/tester"
    return {
        **pip_variables(),
        "PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        "HOME": home,
        "LANG": "C.UTF-8",
        "CI": "true",
        "PIP_CACHE_DIR": f"{home}/pip-cache",
    }


def _chroot(system: Path, user: str = "root") -> list[str]:
    """Start of a command in the system; its mounts disappear when the command ends."""
    root = shlex.quote(str(system))
    cache = Path.home() / ".cache/pip"
    inside = _environment(user)["PIP_CACHE_DIR"]
    mounts = ""
    if cache.is_dir() and user == "root":
        mounts += f"mkdir -p {root}{inside}; mount --bind {cache} {root}{inside};"
    return in_system(system, "root" if user == "root" else "tester", mounts)


def in_system(system: Path, user: str, further: str = "") -> list[str]:
    """Start of a command of a user in a system, with `further` lines after the mounts."""
    root = shlex.quote(str(system))
    mounts = f"mount -t proc proc {root}/proc; mount --rbind /dev {root}/dev;{further}"
    who = "" if user == "root" else f"--userspec={user}:{user} "
    return [
        *("unshare", "--mount", "--propagation", "private", "bash", "-c"),
        f'set -e; {mounts} exec chroot {who}{root} "$@"',
        "bash",
    ]


def _run(system: Path, user: str, line: str, log: Path) -> tuple[bool, str]:
    """Whether a line exited with 0, and what it printed."""
    started = time.time()
    done = subprocess.run(
        [*_chroot(system, user), "bash", "-c", f"cd {PLACE} && {line}"],
        env=_environment(user),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    minutes = (time.time() - started) / 60
    with log.open("a") as file:
        file.write(f"$ {line}\n{done.stdout}\n[exit {done.returncode}, {minutes:.1f} min]\n\n")
    print(f"  {line}: exit {done.returncode}, {minutes:.1f} min", flush=True)
    return done.returncode == 0, done.stdout


def _try(release: str, user: str, arguments: argparse.Namespace) -> None:
    arguments.logs.mkdir(parents=True, exist_ok=True)
    log = arguments.logs / f"{release}-{user}.log"
    log.unlink(missing_ok=True)
    print(f"{DEBIAN[release]}, {user}: log in {log}", flush=True)
    system = _fresh(release, user, arguments)
    walked, printed = _run(system, user, "make subject S=5", log)
    if user != "root":
        line = re.search(r"^ +(sudo .*)$", printed, re.MULTILINE)
        if walked or line is None:
            print("  set-up did not stop with a line to run")
            return
        message, _ = _run(system, "root", line[1].replace("sudo ", ""), log)
        walked, printed = _run(system, user, "make subject S=5", log)
        walked = walked and message
    tested, printed = _run(system, user, "make test", log)
    _run(system, user, "du -sh .venv; .venv/bin/python --version; df -h /dev/shm", log)
    print("\n".join(re.findall(r".*\d+ passed.*|.*randomly-seed.*", printed)))
    if walked and tested:
        shutil.rmtree(system)


def _failures(line: str) -> int:
    """Failures, errors among them, in the last line that pytest printed."""
    return sum(int(count) for count in re.findall(r"(\d+) (?:failed|errors?)", line))


def _tell_orders(logs: Path) -> None:
    """Print failures over the orders in the logs; a suite that did not end counts as one."""
    runs = {path.stem.replace("-", ":"): path.read_text() for path in sorted(logs.glob("*-*.log"))}
    seeds = {system: re.findall(r"randomly-seed=(\d+)", text) for system, text in runs.items()}
    ended = (re.findall(r"\n(=+ .*\d+ passed.*)", text) for text in runs.values())
    failed = sum(_failures(lines[-1]) if lines else 1 for lines in ended)
    print(f"  orders: {seeds}")
    print(f"  {failed} failures of the suite in {len(runs)} random orders")


def _tell(system: str, logs: Path) -> int:
    """Print of a system, from its log, how many of the two commands ended with 0."""
    release, user = system.split(":")
    text = (logs / f"{release}-{user}.log").read_text()
    ended = dict(re.findall(r"^\$ (.*)\n(?:.*\n)*?\[exit (\d+),", text, re.MULTILINE))
    passed = sum(ended.get(command) == "0" for command in ("make subject S=5", "make test"))
    if user != "root" and "sudo " not in text:
        passed = 0  # set-up has to stop with the line
    print(f"  {passed} of 2 commands pass on {DEBIAN[release]}, {user}", flush=True)
    return passed


if __name__ == "__main__":
    main()
