"""The container file and the metadata of the software say what the rest of the project says."""

import json
import re
import tomllib
from pathlib import Path

from gaitval import __version__

ROOT = Path(__file__).parents[2]
DOCKERFILE = (ROOT / "Dockerfile").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_container_names_no_host_and_installs_the_constrained_versions() -> None:
    (image,) = re.findall(r"^FROM (\S+)", DOCKERFILE, re.MULTILINE)
    assert re.fullmatch(r"python:3\.\d+-slim", image)
    assert "://" not in DOCKERFILE
    assert "--constraint /gaitval/constraints.txt" in DOCKERFILE
    (minor,) = re.findall(r"python:3\.(\d+)", image)
    assert f"Programming Language :: Python :: 3.{minor}" in PROJECT["classifiers"]


def test_the_container_has_the_system_libraries_of_set_up() -> None:
    setup = (ROOT / "scripts" / "setup.sh").read_text(encoding="utf-8")
    (libraries,) = re.findall(r'^libraries="([^"]+)"', setup, re.MULTILINE)
    assert set(libraries.split()) <= set(DOCKERFILE.split())


def test_extras_that_the_container_file_names_are_there() -> None:
    for extra in re.findall(r"EXTRAS=\[(\w+)\]", DOCKERFILE):
        assert extra in PROJECT["optional-dependencies"]


def test_metadata_have_the_version_the_licence_and_the_dois_of_the_citation() -> None:
    about = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert about["version"] == __version__
    assert f"\nversion: {__version__}\n" in citation
    assert about["license"].endswith("/" + PROJECT["license"])
    assert about["name"] == PROJECT["name"]
    assert about["description"] == PROJECT["description"]
    named = re.findall(r'"https://doi\.org/([^"]+)"', json.dumps(about))
    cited = set(re.findall(r"doi: (\S+)", citation))
    assert set(named) - {"10.5063/schema/codemeta-2.0"} == cited  # and none of its own
