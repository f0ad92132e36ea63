"""Run the steps of the Dockerfile on a bare Debian, in order, where there is no Docker.

    sudo env PYTHONPATH=. python3 tests/robustness/container.py [--extras [pages]]

The image that it begins with is a bare Debian 13 with its Python 3.13 in an environment at
/usr/local; all else is done as the file says: what it copies is a clean checkout of HEAD without
what .dockerignore names. Then its entry point is called as its users call it, a second time as
somebody else. Network, registries and certificates are this machine's. Needs root and debootstrap.

What a daemon does besides, such as layers and volumes, is not tried.
"""

import argparse
import fnmatch
import json
import re
import shlex
import shutil
import subprocess
import tarfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path, PurePosixPath

import bare_systems

ROOT = Path(__file__).resolve().parents[2]
RELEASE = "trixie"
PYTHON = (
    "apt-get update -qq && apt-get install -y -qq --no-install-recommends"
    " python3 python3-venv python3-pip ca-certificates >/dev/null && python3 -m venv /usr/local"
)
CALLS = (["--help"], ["check", "--quick", "--baseline", "S05"])
WRITTEN = ("compiled", "tmp")
"""Folders of the image in which a call leaves something; the next container is new."""
STRANGER = "4242"
"""Somebody who is not in the image, as `docker run --user` makes them."""


def steps(text: str) -> Iterator[tuple[str, str]]:
    """The instructions of a Dockerfile: word and rest, without comments and broken lines."""
    whole = re.sub(r"\\\n", " ", re.sub(r"^#.*\n", "", text, flags=re.MULTILINE))
    for line in filter(None, map(str.strip, whole.splitlines())):
        word, _, rest = line.partition(" ")
        yield word, rest.strip()


def is_ignored(name: str, patterns: list[str]) -> bool:
    """Whether .dockerignore's `patterns` leave a file out; the last that fits decides."""
    parents = [str(each) for each in (PurePosixPath(name), *PurePosixPath(name).parents)]
    ignored = False
    for pattern in patterns:
        bare = pattern.removeprefix("!").removeprefix("**/")
        anywhere = "**/" in pattern
        if any(
            fnmatch.fnmatch(each.rsplit("/", 1)[-1] if anywhere else each, bare)
            and (anywhere or each.count("/") == bare.count("/"))
            for each in parents
        ):
            ignored = not pattern.startswith("!")
    return ignored


class Image:
    """A system that steps change.

    Attributes
    ----------
    root : its folder.
    variables : of the environment of its commands.
    user, place : who runs them, and where.
    """

    def __init__(self, root: Path, extras: str) -> None:
        self.root = root
        self.variables = {"PATH": "/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8"}
        self.user, self.place, self.entry, self.extras = "root", "/", [""], extras

    def run(self, words: list[str], user: str | None = None) -> None:
        """Run a command; raises CalledProcessError if it fails."""
        who = user or self.user
        home = {"HOME": {"root": "/root", STRANGER: "/"}.get(who, f"/home/{who}")}
        start = bare_systems.in_system(self.root, who)
        line = f"cd {shlex.quote(self.place)} && exec {shlex.join(words)}"
        subprocess.run(
            [*start, "/bin/sh", "-c", line],
            check=True,
            env=bare_systems.pip_variables() | self.variables | home,
        )

    def do(self, word: str, rest: str) -> None:
        """One step."""
        if word == "FROM":
            self.run(["/bin/sh", "-c", PYTHON])
        elif word in ("ARG", "ENV"):
            name, _, value = rest.partition("=")
            self.variables[name] = self.extras if name == "EXTRAS" else value.strip('"')
        elif word == "RUN":
            self.run(["/bin/sh", "-c", rest])
        elif word == "COPY":
            self.copy(*rest.split())
        elif word == "USER":
            self.user = rest
        elif word == "WORKDIR":
            self.place = rest
            (self.root / rest[1:]).mkdir(parents=True, exist_ok=True)
        elif word == "ENTRYPOINT":
            self.entry = json.loads(rest)
        elif word != "CMD":
            raise ValueError(f"{word}: this script does not know how to do that step")

    def copy(self, source: str, target: str) -> None:
        """Copy the checkout, but for what is ignored."""
        assert source == "."
        patterns = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
        packed = subprocess.run(
            ["git", "archive", "HEAD"], cwd=ROOT, check=True, capture_output=True
        ).stdout
        with tarfile.open(fileobj=BytesIO(packed)) as archive:
            for each in archive.getmembers():
                if not is_ignored(each.name.rstrip("/"), patterns) and not each.isdir():
                    archive.extract(each, self.root / target[1:], filter="data")


def main() -> None:
    """Do every step and every call, and write how many failed: after one, the rest do as well."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--extras", default="", help="as the build argument EXTRAS")
    parser.add_argument("--mirror", help="Debian mirror (default: this machine's)")
    parser.add_argument("--folder", type=Path, default=Path("/opt/chroots"))
    arguments = parser.parse_args()
    root = arguments.folder / "container"
    shutil.rmtree(root, ignore_errors=True)
    subprocess.run(["cp", "-a", str(bare_systems.bare(RELEASE, arguments)), str(root)], check=True)
    bare_systems.connect(root)
    image = Image(root, arguments.extras)
    instructions = list(steps((ROOT / "Dockerfile").read_text(encoding="utf-8")))
    calls = [(words, user) for user in (None, STRANGER) for words in CALLS]
    done = 0
    try:
        for word, rest in instructions:
            print(f"{word} {rest}", flush=True)
            image.do(word, rest)
            done += 1
        for words, user in calls:
            print(f"gaitval {shlex.join(words)}, as {user or image.user}", flush=True)
            for left in (each for name in WRITTEN for each in (root / name).iterdir()):
                shutil.rmtree(left) if left.is_dir() else left.unlink()
            image.run([*image.entry, *words], user)
            done += 1
    except subprocess.CalledProcessError as error:
        print(error)
    count = len(instructions) + len(calls)
    print(f"{count - done} of {count} steps and calls of the entry point fail")
    if done == count:
        shutil.rmtree(root)


if __name__ == "__main__":
    main()
