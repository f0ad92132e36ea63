"""Writes the exact files of the application: every package, its version and SHA-256.

    pip install --dry-run --ignore-installed --report REPORT -c constraints.txt '.[study]'
    python scripts/lock.py REPORT

pip says which file it would take of each package, with the hash that the index states; this keeps
the hashes and leaves the addresses out. A file is for one system, so the lock is named after it.
To install from it, with every file checked:

    python -m pip install --require-hashes --no-deps -r LOCK
    python -m pip install --no-deps gaitval-*.whl
"""

import argparse
import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "locks"


def canonical(name: str) -> str:
    """A package's name as indexes compare them: small letters, one hyphen (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(path: Path) -> dict[str, tuple[str, tuple[str, ...]]]:
    """Version and SHA-256 of each package of a lock, by canonical name."""
    found = {}
    for line in path.read_text(encoding="utf-8").replace("\\\n", " ").splitlines():
        parts = line.split()
        if parts and not line.startswith("#"):
            name, _, version = parts[0].partition("==")
            hashes = (part.removeprefix("--hash=sha256:") for part in parts[1:])
            found[canonical(name)] = (version, tuple(hashes))
    return found


def _line(item: dict[str, Any]) -> str:
    name, version = canonical(item["metadata"]["name"]), item["metadata"]["version"]
    digest = item["download_info"].get("archive_info", {}).get("hashes", {}).get("sha256")
    if not digest:
        raise SystemExit(f"lock: {name} {version}: the index states no SHA-256; lock nothing.")
    return f"{name}=={version} \\\n    --hash=sha256:{digest}"


def main() -> None:
    """Write `locks/SYSTEM.txt` from pip's report."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("report", type=Path, help="what `pip install --report` wrote")
    report = json.loads(parser.parse_args().report.read_text(encoding="utf-8"))
    where = report["environment"]
    system = "-".join(
        [where["sys_platform"], where["platform_machine"], f"py{where['python_version']}"]
    )
    installed = [
        item for item in report["install"] if canonical(item["metadata"]["name"]) != "gaitval"
    ]
    lines = [
        f"# What gaitval runs on, on {system}; written by scripts/lock.py. Versions are those of",
        "# constraints.txt; torch is the build without CUDA.",
        *sorted(map(_line, installed)),
    ]
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{system}.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(path)


if __name__ == "__main__":
    main()
