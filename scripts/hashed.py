"""Installs what the main job needs with every file checked by its SHA-256, where there is a lock.

    python -P scripts/hashed.py [pip's own options ...]

The lock is `locks/SYSTEM-MACHINE-pyVERSION.txt` of this system and Python; without one nothing is
installed, and says so. What pip installs afterwards with constraints.txt is found there already.
torch is left to that: the lock has the build without CUDA, which not every index offers.
"""

import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "locks"
_TORCH = re.compile(r"^torch==.*\\\n.*\n", re.MULTILINE)


def lock() -> Path:
    """Where the lock of this system and Python is, or would be."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    return FOLDER / f"{sys.platform}-{platform.machine()}-py{version}.txt"


def main() -> None:
    """Install, and end as pip does."""
    path = lock()
    if not path.is_file():
        print(f"hashed: no {path.name} in locks: versions are checked, not files.")
        return
    with tempfile.TemporaryDirectory() as folder:
        wanted = Path(folder) / path.name
        wanted.write_text(_TORCH.sub("", path.read_text(encoding="utf-8")), encoding="utf-8")
        pip = (sys.executable, "-P", "-m", "pip", "install", "--disable-pip-version-check")
        checked = ("--require-hashes", "--no-deps", "-r", str(wanted))
        sys.exit(subprocess.run([*pip, *sys.argv[1:], *checked], check=False).returncode)


if __name__ == "__main__":
    main()
