"""The container file and the metadata of the software say what the rest of the project says."""

import json
import re
import tomllib
from pathlib import Path

import container

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


def test_the_container_gets_what_the_wheel_is_built_of_and_no_more() -> None:
    patterns = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    needed = (
        "gaitval/plugins.py",
        "gaitval/apps/regression/seal.py",
        "models/xacro/leg.xacro",
    )
    needed += ("pyproject.toml", "hatch_build.py", "constraints.txt", "README.md", "LICENSE")
    needed += ("reports/S05/baseline/metrics.json", "reports/general/policy.safetensors")
    assert all(
        (ROOT / name).is_file() and not container.is_ignored(name, patterns) for name in needed
    )
    for name in (
        "tests/conftest.py",
        "reports/S05/report.html",
        ".git/HEAD",
        "/".join(("gaitval", "__pycache__", "a.pyc")),  # no file that is here
    ):
        assert container.is_ignored(name, patterns)


def test_steps_of_the_container_file_are_read() -> None:
    words = [word for word, _ in container.steps(DOCKERFILE)]
    assert words[:2] == ["FROM", "ARG"]
    assert words[-2:] == ["ENTRYPOINT", "CMD"]
    (user,) = (rest for word, rest in container.steps(DOCKERFILE) if word == "USER")
    assert any(f"useradd --create-home {user}" in rest for _, rest in container.steps(DOCKERFILE))
    assert list(container.steps("# x\nRUN a \\\n  && b\n")) == [("RUN", "a    && b")]


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
