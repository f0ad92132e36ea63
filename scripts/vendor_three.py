"""Shipped: writes gaitval/reporting/vendor, the part of three.js that the replay uses, in one file.

    python scripts/vendor_three.py             needs node and npm, and a package registry
    python scripts/vendor_three.py --check     compares the file with its record; needs neither

`scripts/three/package-lock.json` pins the versions of three.js and of esbuild, and the hash of
every file that npm fetches; the same versions give the same bytes. Written are
`gaitval/reporting/vendor/three.min.js` with the licence of three.js at its head, the licence
itself, and `three.json`: name, version, licence, where it comes from, and the hashes.
"""

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RECIPE = ROOT / "scripts" / "three"
FOLDER = ROOT / "gaitval" / "reporting" / "vendor"
BUNDLE, LICENCE, RECORD = "three.min.js", "three.LICENSE", "three.json"


def sha256(data: bytes) -> str:
    """Hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def bundled(folder: Path) -> dict[str, bytes]:
    """The three files by name, made in an empty folder."""
    for path in RECIPE.iterdir():
        if path.is_file():
            shutil.copy(path, folder)
    subprocess.run(
        ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--silent"],
        cwd=folder,
        check=True,
    )
    licence = (folder / "node_modules" / "three" / "LICENSE").read_bytes()
    (binary,) = (folder / "node_modules" / "@esbuild").glob("*/bin/esbuild")
    options = "--bundle --minify --format=iife --global-name=THREE --target=es2022 --charset=ascii"
    made = subprocess.run(
        [binary, "entry.js", *options.split(), "--legal-comments=none", "--log-level=warning"],
        cwd=folder,
        check=True,
        capture_output=True,
    ).stdout
    locked = json.loads((folder / "package-lock.json").read_text())["packages"]
    three, esbuild = (locked[f"node_modules/{name}"] for name in ("three", "esbuild"))
    notice = f"three.js {three['version']}, the part that gaitval uses\n\n".encode() + licence
    bundle = b"/*!\n" + notice.strip() + b"\n*/\n" + made
    record = {
        "name": "three",
        "version": three["version"],
        "licence": three["license"],
        "purl": f"pkg:npm/three@{three['version']}",
        "package_integrity": three["integrity"],
        "bundled_by": f"esbuild {esbuild['version']}",
        "bundle": BUNDLE,
        "bundle_sha256": sha256(bundle),
    }
    return {
        BUNDLE: bundle,
        LICENCE: licence,
        RECORD: (json.dumps(record, indent=1) + "\n").encode(),
    }


def problems() -> list[str]:
    """How the stored bundle differs from its record and from the recipe; empty if it does not."""
    record = json.loads((FOLDER / RECORD).read_text())
    locked = json.loads((RECIPE / "package-lock.json").read_text())["packages"]
    bundle = (FOLDER / BUNDLE).read_bytes()
    found = []
    if sha256(bundle) != record["bundle_sha256"]:
        found.append(f"{BUNDLE} has another SHA-256 than {RECORD} says")
    if locked["node_modules/three"]["integrity"] != record["package_integrity"]:
        found.append(f"{RECORD} is of another version than scripts/three/package-lock.json pins")
    if (FOLDER / LICENCE).read_bytes().strip() not in bundle:
        found.append(f"{BUNDLE} does not carry its licence")
    return found


def main() -> None:
    """Write the bundle, or check it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare the file with its record")
    if parser.parse_args().check:
        if found := problems():
            sys.exit("\n".join(found) + "\nRun scripts/vendor_three.py.")
        return
    with tempfile.TemporaryDirectory() as folder:
        files = bundled(Path(folder))
    FOLDER.mkdir(exist_ok=True)
    for name, data in files.items():
        (FOLDER / name).write_bytes(data)
        print(f"{FOLDER / name}: {len(data):,} bytes, SHA-256 {sha256(data)}")


if __name__ == "__main__":
    main()
