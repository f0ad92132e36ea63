"""Writes the software bill of materials of the application, as CycloneDX 1.6 in JSON.

    python scripts/sbom.py [FILE]        (default: dist/gaitval-VERSION.cdx.json, beside the wheel)

It lists what gaitval imports when it runs: its dependencies and theirs, with those of `EXTRAS`, as
they are installed here, with their licences and what depends on what; and what is bundled into it
(`gaitval/reporting/vendor`). SHA-256 are those of the locks in `locks/`, where the
version is the same; they are left out of a package that no lock has.
"""

import argparse
import json
import uuid
from importlib import metadata
from pathlib import Path
from typing import Any

from lock import FOLDER, ROOT, canonical, locked
from packaging.requirements import Requirement

NAME = "gaitval"
EXTRAS = frozenset({"study"})
"""Of the application: what training needs, too."""
VENDOR = ROOT / "gaitval" / "reporting" / "vendor"
_TEXT = 80
"""Longest licence that is a name; some packages state the whole text."""
_PHRASES = {
    "Permission is hereby granted, free of charge": "MIT License",
    "Redistribution and use in source and binary forms": "BSD License",
}
"""What a licence's text says, and its name, for packages that state no name."""


def requirements(name: str, extras: frozenset[str] = frozenset()) -> list[Requirement]:
    """What an installed package needs here, with these of its extras."""
    wanted = [Requirement(text) for text in metadata.requires(name) or ()]
    return [
        each
        for each in wanted
        if each.marker is None
        or any(each.marker.evaluate({"extra": extra}) for extra in ("", *sorted(extras)))
    ]


def closure(name: str = NAME, extras_of_it: frozenset[str] = EXTRAS) -> dict[str, list[str]]:
    """All packages that one needs at run time, itself among them: what each of them needs.

    Raises
    ------
    PackageNotFoundError : one is not installed.
    """
    extras: dict[str, set[str]] = {canonical(name): set(extras_of_it)}
    found: dict[str, list[str]] = {}
    waiting = [canonical(name)]
    while waiting:
        each = waiting.pop()
        needed = requirements(each, frozenset(extras[each]))
        found[each] = sorted({canonical(one.name) for one in needed})
        for one in needed:
            key = canonical(one.name)
            known = extras.setdefault(key, set())
            if key not in found or not one.extras <= known:
                known |= one.extras
                waiting.append(key)
    return found


def _licences(name: str) -> list[dict[str, Any]]:
    about = metadata.metadata(name)
    if expression := about.get("License-Expression"):
        return [{"expression": expression}]
    named = [
        line.rpartition("::")[2].strip()
        for line in about.get_all("Classifier") or ()
        if line.startswith("License ::")
    ]
    text = (about.get("License") or "").strip()
    if not named and text and "\n" not in text and len(text) <= _TEXT:
        named = [text]
    if not named or named[0].startswith("Copyright"):
        contents = _licence_text(name) or text
        named = [each for phrase, each in _PHRASES.items() if phrase in contents] or named
    return [{"license": {"name": name}} for name in sorted(set(named))]


def _licence_text(name: str) -> str:
    """The text of a package's licence, from the files that it is installed with."""
    texts = [
        each.read_text(encoding="utf-8")
        for each in metadata.files(name) or ()
        if each.name.upper().startswith("LICEN")
    ]
    return " ".join("\n".join(texts).split())


def _reference(name: str) -> str:
    return f"pkg:pypi/{name}@{metadata.version(name)}"


def component(name: str, hashes: dict[str, dict[str, set[str]]]) -> dict[str, Any]:
    """A package: name, version, licence, and the hashes that are locked for this version."""
    version = metadata.version(name)
    digests = sorted(hashes.get(name, {}).get(version, ()))
    values: dict[str, Any] = {
        "type": "application" if name == NAME else "library",
        "bom-ref": _reference(name),
        "purl": _reference(name),
        "name": name,
        "version": version,
        "licenses": _licences(name),
        "hashes": [{"alg": "SHA-256", "content": digest} for digest in digests],
    }
    return {key: value for key, value in values.items() if value}


def bundled() -> list[dict[str, Any]]:
    """Libraries whose code is in gaitval's own files, from the records beside them."""
    records = [
        json.loads(path.read_text(encoding="utf-8")) for path in sorted(VENDOR.glob("*.json"))
    ]
    return [
        {
            "type": "library",
            "bom-ref": record["purl"],
            "purl": record["purl"],
            "name": record["name"],
            "version": record["version"],
            "licenses": [{"license": {"id": record["licence"]}}],
            "hashes": [{"alg": "SHA-256", "content": record["bundle_sha256"]}],
        }
        for record in records
    ]


def bill() -> dict[str, Any]:
    """The bill of materials; the same packages give the same bytes."""
    hashes: dict[str, dict[str, set[str]]] = {}
    for path in sorted(FOLDER.glob("*.txt")):
        for name, (version, digests) in locked(path).items():
            hashes.setdefault(name, {}).setdefault(version, set()).update(digests)
    needs = closure()
    inside = bundled()
    components = [component(name, hashes) for name in sorted(needs) if name != NAME] + inside
    contents = json.dumps(components, sort_keys=True)
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_OID, contents)}",
        "version": 1,
        "metadata": {"component": component(NAME, hashes)},
        "components": components,
        "dependencies": [
            {
                "ref": _reference(name),
                "dependsOn": [_reference(each) for each in needs[name]]
                + [each["bom-ref"] for each in inside if name == NAME],
            }
            for name in sorted(needs)
        ],
    }


def main() -> None:
    """Write the bill."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("file", nargs="?", type=Path, help="default: in dist/, beside the wheel")
    path = parser.parse_args().file
    path = path or ROOT / "dist" / f"{NAME}-{metadata.version(NAME)}.cdx.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(bill(), indent=1) + "\n", encoding="utf-8")
    print(path)


if __name__ == "__main__":
    main()
