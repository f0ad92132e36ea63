"""The wheel holds all that the installed command needs, and the sdist all that the wheel needs."""

import ast
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib import metadata
from pathlib import Path

import pytest
import sbom
from lock import canonical, locked
from numba.core.caching import _CacheLocator
from quick_settings import PAGES, QUICK

from gaitval._internal.numba.compiled import _cache_folder
from gaitval.subjects.sample import SAMPLE

ROOT = Path(__file__).parents[2]


def built(kind: str, source: Path, folder: Path) -> Path:
    """The wheel or sdist of a folder of sources."""
    subprocess.run(
        [sys.executable, "-m", "build", f"--{kind}", "--no-isolation", "--outdir", folder, source],
        check=True,
        capture_output=True,
    )
    (made,) = (path for path in folder.iterdir() if path.suffix in (".whl", ".gz"))
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("build", reason="the extra `dev` has what builds a wheel")
    return built("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def installed(wheel):
    """Folder with the contents of the wheel, as pip would place them."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(wheel.parent / "site")
    return wheel.parent / "site"


def test_models_and_policies_are_inside(installed):
    assert (installed / "gaitval/models/xacro/humanoid.urdf.xacro").is_file()
    assert (installed / "gaitval/subjects/builtin/S05.toml").is_file()
    for name in ("metrics.json", "policy/policy.safetensors", "policy/policy.json"):
        assert (installed / "gaitval/baselines/S05" / name).is_file()
    assert (installed / "gaitval/baselines/general/policy.safetensors").is_file()
    assert (installed / "gaitval/configurations/paper.toml").is_file()
    for name in SAMPLE:
        assert (installed / "gaitval/samples" / name).is_file()


def test_every_module_is_inside_with_its_data_and_the_entry_points_name_some(installed):
    for path in (ROOT / "gaitval").rglob("*"):
        if path.is_file() and path.suffix != ".pyc":
            assert (installed / path.relative_to(ROOT)).is_file(), path
    (registered,) = installed.glob("gaitval-*.dist-info")
    entries = metadata.Distribution.at(registered).entry_points
    assert {each.group for each in entries} == {"console_scripts", "pytest11"}
    for each in entries:
        at = installed.joinpath(*each.module.split("."))
        assert at.with_suffix(".py").is_file() or (at / "__init__.py").is_file(), each


@pytest.mark.slow
def test_the_wheel_of_the_sdist_is_that_of_the_checkout(wheel, tmp_path):
    # Python 3.11.2, Debian 12's, knows no `filter` yet; later ones ask for it.
    safely = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
    with tarfile.open(built("sdist", ROOT, tmp_path / "sdist")) as archive:
        archive.extractall(tmp_path, **safely)
    (source,) = tmp_path.glob("gaitval-*")
    assert not (source / "tests").exists()
    other = built("wheel", source, tmp_path / "wheel")
    assert other.name == wheel.name
    with zipfile.ZipFile(wheel) as ours, zipfile.ZipFile(other) as theirs:
        assert theirs.namelist() == ours.namelist()
        for name in ours.namelist():
            assert theirs.read(name) == ours.read(name), name
    assert other.read_bytes() == wheel.read_bytes(), "times, modes or order of the members"


@pytest.mark.slow
def test_an_sdist_is_the_same_bytes_each_time(wheel, tmp_path):
    """In another folder, with files of another day."""
    first = built("sdist", ROOT, tmp_path / "first")
    safely = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
    with tarfile.open(first) as archive:
        archive.extractall(tmp_path, **safely)
    (source,) = tmp_path.glob("gaitval-*")
    for path in source.rglob("*"):
        os.utime(path, (1e9, 1e9))
    assert built("sdist", source, tmp_path / "second").read_bytes() == first.read_bytes()


def needed_by_the_wheel(wheel: Path) -> set[str]:
    """Names of the packages that the wheel's own metadata ask for, without extras."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        lines = archive.read(name).decode().splitlines()
    texts = [line.partition(":")[2] for line in lines if line.startswith("Requires-Dist:")]
    return {
        canonical(re.split(r"[\s<>=!~;\[(]", t.strip())[0]) for t in texts if "extra ==" not in t
    }


def test_the_bill_of_materials_names_every_package_that_runs(wheel, tmp_path):
    script = ROOT / "scripts/sbom.py"
    subprocess.run([sys.executable, script, tmp_path / "bill.json"], check=True, cwd=tmp_path)
    bill = json.loads((tmp_path / "bill.json").read_text())
    versions = {each["name"]: each["version"] for each in bill["components"]}
    assert versions.pop("three") == "0.187.0"  # bundled into the report
    with zipfile.ZipFile(wheel) as archive:
        bundle = archive.read("gaitval/reporting/vendor/three.min.js")
        assert "gaitval/reporting/vendor/three.LICENSE" in archive.namelist()
    (three,) = (each for each in bill["components"] if each["name"] == "three")
    assert three["hashes"][0]["content"] == hashlib.sha256(bundle).hexdigest()
    needed = needed_by_the_wheel(wheel)
    assert {"numpy", "dartpy"} <= needed <= versions.keys()
    assert {"torch", "stable-baselines3"} <= versions.keys() - needed  # of the extra `study`
    assert "kiwisolver" in versions  # what only a dependency needs
    assert "pytest" not in versions
    for name, version in versions.items():
        assert version == metadata.version(name)
    references = {each["bom-ref"] for each in [bill["metadata"]["component"], *bill["components"]]}
    for each in bill["dependencies"]:
        assert {each["ref"], *each["dependsOn"]} <= references


@pytest.fixture(scope="module")
def bill():
    """The bill of materials of what is installed here."""
    return sbom.bill()


def test_what_runs_with_gaitval_asks_nobody_for_sources(bill):
    for each in bill["components"]:
        licences = [
            one.get("expression") or one["license"].get("id") or one["license"]["name"]
            for one in each.get("licenses", ())
        ]
        assert licences, f"{each['name']}: nobody knows its licence"
        choices = [text for one in licences for text in one.split(" OR ")]
        copyleft = [text for text in choices if re.search(r"A?GPL|Affero|General Public", text)]
        assert len(copyleft) < len(choices), f"{each['name']}: {licences}"


@pytest.mark.slow
def test_every_library_that_the_core_imports_is_asked_for():
    """What is not in pyproject.toml, but happens to be installed, is found here."""
    known = {"pytest", *sbom.closure(extras_of_it=frozenset({"all"}))}  # whose plug-in it is has it
    owners = metadata.packages_distributions()
    for path in (ROOT / "gaitval").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            for name in {each.partition(".")[0] for each in names} - sys.stdlib_module_names:
                if found := {canonical(each) for each in owners.get(name, ())}:
                    assert found & known, f"{path}: {name}"


def test_locks_have_a_hash_of_everything_in_the_versions_of_the_constraints(wheel):
    wanted = {
        (canonical(found[1]), found[2])
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if (found := re.match(r"([A-Za-z0-9._-]+)==([^;\s]+)", line))
    }
    (path,) = (ROOT / "locks").glob("*.txt")
    assert "://" not in path.read_text()
    packages = locked(path)
    assert needed_by_the_wheel(wheel) <= packages.keys()
    for name, (version, hashes) in packages.items():
        assert (name, version.partition("+")[0]) in wanted
        assert hashes
        assert all(re.fullmatch("[0-9a-f]{64}", each) for each in hashes)


@contextmanager
def shared_compiled(installed: Path) -> Iterator[None]:
    """Let the copy load what the checkout's functions were compiled to, as far as they were yet:
    it saves a minute. numba knows the sources, which are the same, by their folder. In the same
    cache, since its files are believed in no other."""
    with ExitStack() as stack:
        for source in (ROOT / "gaitval").rglob("*.py"):
            copy = installed / source.relative_to(ROOT)
            theirs, ours = (
                _cache_folder() / _CacheLocator.get_suitable_cache_subpath(str(path))
                for path in (source, copy)
            )
            if theirs.is_dir() and not ours.exists():
                shutil.copytree(theirs, ours)
                stack.callback(shutil.rmtree, ours)
        yield


@pytest.mark.slow
def test_the_main_job_runs_away_from_the_checkout(installed, tmp_path):
    """From the wheel's files alone, in an empty folder, from the general policy to the report."""
    code = (
        f"import sys; sys.path.insert(0, {str(installed)!r}); import gaitval.cli as c;"
        f"assert c.__file__.startswith({str(installed)!r}), c.__file__; c.main()"
    )
    empty = tmp_path / "empty"
    empty.mkdir()
    settings = [argument for setting in (*QUICK, *PAGES) for argument in ("--set", setting)]
    with shared_compiled(installed):
        done = subprocess.run(
            [sys.executable, "-I", "-c", code, "subject", "5", *settings],
            cwd=empty,
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    run = empty / "reports" / "S05"
    stored = installed / "gaitval/baselines/general/policy.safetensors"
    assert (run / "start/policy.safetensors").read_bytes() == stored.read_bytes()
    for name in ("model.urdf", "metrics.json", "report.html", "report-details.html", "report.pdf"):
        assert (run / name).stat().st_size > 0
