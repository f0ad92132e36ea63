"""Known weaknesses of the packages that the application is locked to.

    python scripts/audit.py [--lock locks/linux-x86_64-py3.11.txt]

Asks pip-audit, which asks PyPI. Exit code 0: every package was looked up and nothing is known; 1:
something is; 2: it could not be said, because pip-audit is not installed, or its database cannot be
reached or does not know a package, which pip-audit itself passes over with exit code 0.
"""

import argparse
import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

ROOT: Final = Path(__file__).resolve().parent.parent
LOCK: Final = ROOT / "locks" / "linux-x86_64-py3.11.txt"
SECONDS: Final = 600.0


def verdict(report: dict[str, Any]) -> tuple[int, str]:
    """Exit code and words for a report of pip-audit (`--format json`)."""
    packages = report["dependencies"]
    weak = [one for one in packages if one.get("vulns")]
    skipped = [one["name"] for one in packages if "skip_reason" in one]
    if weak:
        lines = [
            f"{one['name']} {one['version']}: {weakness['id']}, mended in "
            f"{', '.join(weakness['fix_versions']) or 'no version yet'}"
            for one in weak
            for weakness in one["vulns"]
        ]
        return 1, "\n".join(["Known weaknesses:", *lines])
    if skipped or not packages:
        return 2, (
            f"Not audited: the database does not know {len(skipped)} of {len(packages)} packages "
            f"({', '.join(skipped[:5]) or 'the lock is empty'}). Is this machine's index a mirror "
            "without the data? Run it where https://pypi.org can be reached."
        )
    return 0, f"{len(packages)} packages: no known weakness."


def audited(lock: Path) -> tuple[int, str]:
    """The verdict on the packages of a lock."""
    if importlib.util.find_spec("pip_audit") is None:
        return 2, "Not audited: pip-audit is not installed (python -m pip install pip-audit)."
    command = [sys.executable, "-m", "pip_audit", "--require-hashes", "--disable-pip"]
    command += ["--requirement", str(lock), "--format", "json", "--progress-spinner", "off"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SECONDS, check=False)
        return verdict(json.loads(done.stdout))
    except subprocess.TimeoutExpired:
        return 2, f"Not audited: no answer within {SECONDS:g} s."
    except ValueError:
        why = done.stderr.strip().splitlines() or ["it says nothing"]
        return 2, f"Not audited: pip-audit ended with {done.returncode}: {why[-1][:300]}"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--lock", type=Path, default=LOCK)
    code, words = audited(parser.parse_args().lock)
    print(words)
    sys.exit(code)


if __name__ == "__main__":
    main()
