"""What pages, docstrings and comments name is there: files, links, code, settings, commands.

Read are the pages and the sources of the checkout. A name is looked up, not its meaning: this keeps
a page from pointing at what was moved or renamed, nothing more.
"""

import importlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from gaitval.cli import app
from gaitval.configuration import Configuration
from gaitval.subjects.subject_file import builtin_subjects

ROOT = Path(__file__).parents[2]
FOLDERS = (
    *("gaitval", "scripts", "claims", "experiments"),
    *("tests", "benchmarks", "docs", "models"),
)
PAGES = [
    *ROOT.glob("*.md"),
    *(ROOT / "docs").rglob("*.md"),
    *(ROOT / "reports").glob("*.md"),
    *(ROOT / "reports" / "recordings").glob("*.md"),
]
SOURCES = [
    path
    for folder in FOLDERS
    for suffix in ("py", "sh", "toml", "md", "j2", "xacro")
    for path in (ROOT / folder).rglob(f"*.{suffix}")
    if path != Path(__file__) and path not in PAGES
]
PACKAGE = [*(ROOT / "gaitval").rglob("*.py")]
OURS = [*PAGES, *SOURCES, ROOT / "Makefile", ROOT / "pyproject.toml"]
CHANGES = ROOT / "CHANGELOG.md"
"""It names what is gone, too."""
OTHERS = (
    *("gaitval/baselines/", "gaitval/models/", "scripts/validate_fukuchi", "scripts/research/"),
    *("docs/reference/biomechanical_standard.md"),
)
"""Paths that only a built wheel has, and those in the repositories of others."""
NAMES = {path.name for folder in FOLDERS for path in (ROOT / folder).rglob("*")}
PACKAGES = {path.stem for path in (ROOT / "gaitval").iterdir() if path.suffix in ("", ".py")}


FILES = (
    *(".c3d", ".mot", ".trc", ".tsv", ".txt", ".sto"),
    ".py",
    ".osim",
    ".zip",
    ".toml",
    ".json",
    ".csv",
    ".npz",
    ".html",
    ".pdf",
    ".safetensors",
)


def texts(files: list[Path]) -> Iterator[tuple[str, str]]:
    """Name in the checkout and text of each."""
    for path in files:
        yield str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")


def found(pattern: str, files: list[Path]) -> Iterator[tuple[str, str]]:
    """Every match (its first group), after the file it is in."""
    for name, text in texts(files):
        for match in re.finditer(pattern, text):
            yield name, match[1]


def is_file(name: str) -> bool:
    """Whether a path, from the checkout's root or the package's, or a bare name is there."""
    if "/" in name:
        return any((ROOT / start / name).exists() for start in ("", "gaitval"))
    return name in NAMES or (ROOT / name).exists()


def is_beside(page: str, name: str) -> bool:
    """Whether the page of a folder names a file of the folder."""
    return page.endswith("README.md") and ((ROOT / page).parent / name).exists()


def is_code(name: str) -> bool:
    """Whether a dotted name is a module of ours, or something that a module defines."""
    parts = ["gaitval", *name.removeprefix("gaitval.").split(".")]
    for count in range(len(parts), 1, -1):
        try:
            thing = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            members = {**getattr(thing, "__annotations__", {}), **vars(thing)}
            if part not in members:
                return False
            thing = members[part]
        home = getattr(thing, "__module__", None)  # of functions and classes
        return not str(home).startswith("gaitval") or home.split(".") == parts[:count]
    return False


def is_setting(name: str) -> bool:
    """Whether `section.key` is in the configuration."""
    section, _, key = name.partition(".")
    field = Configuration.model_fields.get(section)
    return field is not None and key in getattr(field.annotation, "model_fields", {})


@cache
def commands() -> Any:
    """All commands."""
    return get_command(app)


def command(words: list[str]) -> Any:
    """The command that a line begins with, None where there is none such."""
    here: Any = commands()
    for word in words:
        if not hasattr(here, "commands"):
            break
        here = here.commands.get(word)
    return here


def anchors(page: Path) -> set[str]:
    """Of the headings of a page, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in headings}


def test_paths_are_there():
    """Those below our folders wherever they are named, and `x/y.py`, which is below gaitval/; but
    for those "of commit ...", which git has.
    """
    start, earlier = "|".join(FOLDERS), r"(?!`?\s+of\s+commit\b)"
    below = rf"(?<![\w/.-])((?:{start})/[\w/.-]+\.(?:py|md|toml|sh|svg|png|xacro|json)){earlier}"
    quoted = rf"`((?:[\w.-]+/)*[\w-]+\.(?:py|sh))`{earlier}"
    named = {*found(below, OURS), *found(quoted, PAGES), *found(quoted, SOURCES)}
    assert len(named) > 40
    missing = [pair for pair in sorted(named) if not pair[1].startswith(OTHERS)]
    assert [pair for pair in missing if not is_file(pair[1]) and not is_beside(*pair)] == []


def test_links_lead_somewhere():
    links = [
        (ROOT / name, link)
        for name, link in found(r"\]\(([^)\s]+)\)", PAGES)
        if not re.match(r"[a-z]+:", link)
    ]
    assert len(links) > 10
    for page, link in links:
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), (page, link)
        assert not anchor or anchor in anchors(target), (page, link)


def test_dotted_names_are_code_or_settings():
    """In backticks, or called in an example of a page."""
    sections = "|".join(sorted({*Configuration.model_fields, *PACKAGES, "gaitval"}))
    dotted = rf"((?:{sections})\.[a-z_]\w*(?:\.\w+)*)"
    ours = [page for page in OURS if page != CHANGES]
    named = {*found(rf"`(?:--set )?{dotted}(?:\(\)|=[^`]*)?`", ours)}
    named |= {*found(rf"(?m)^ +{dotted}\(", PAGES), *found(rf"--set {dotted}=", ours)}
    names = [pair for pair in sorted(named) if not pair[1].endswith(FILES)]
    assert len(names) > 30
    assert [pair for pair in names if not is_code(pair[1]) and not is_setting(pair[1])] == []


def test_commands_and_their_options_are_there():
    pages = [page for page in PAGES if page != CHANGES]
    lines = [
        (name, line.split())
        for name, line in found(r"(?m)(?:^ {4}|`|\")gaitval ([a-z][^`\"#|\n]*)", pages + PACKAGE)
    ]
    assert len(lines) > 30
    for name, words in lines:
        wanted = command(words)
        assert wanted is not None, (name, words)
        options = {option for parameter in wanted.params for option in parameter.opts}
        for option in (word.partition("=")[0].rstrip(".,;:)") for word in words):
            if option.startswith("--") and option != "--help":
                assert option in options, (name, words, option)


def test_targets_of_make_are_there():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, re.MULTILINE))
    named = {*found(r"(?:^ {4,}|`)make ([a-z-]+)", PAGES)}
    assert {target for _, target in named} >= {"subject", "test"}
    assert [pair for pair in sorted(named) if pair[1] not in targets] == []


def test_pages_tell_the_faults_of_the_plates_that_the_subjects_have():
    """The shifts of docs/paper.md, and their distance on other pages, are those of the subjects."""
    page = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    (right,) = re.findall(r"right ([\d.]+) ± [\d.]+ cm too far forward", page)
    (left,) = re.findall(r"left ([\d.]+) ± [\d.]+ cm too far back", page)
    (least, most) = re.findall(r"mean\s+vertical forces? .{,20}?(0\.\d+) to (0\.\d+)", page)[0]
    forces = []
    for subject in builtin_subjects():
        assert subject.plates is not None
        assert 1.0 / subject.plates.scale == pytest.approx(subject.mean_vertical_force, abs=2.6e-3)
        assert 100 * subject.plates.shift_right == pytest.approx(float(right), abs=0.051)
        assert 100 * subject.plates.shift_left == pytest.approx(-float(left), abs=0.051)
        forces.append(subject.mean_vertical_force)
    assert [round(each, 2) for each in (min(forces), max(forces))] == [float(least), float(most)]
    apart = 100 * (subject.plates.shift_right - subject.plates.shift_left)
    for name in ("README.md", "docs/learning.md", "docs/paper.md"):
        message = re.findall(r"off by ([\d.]+) cm relative", (ROOT / name).read_text("utf-8"))
        assert [float(each) for each in message] == [pytest.approx(apart, abs=0.051)], name
