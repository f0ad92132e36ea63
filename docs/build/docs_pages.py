"""Pages of the documentation site that are made from the code and from files of the repository."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from architecture import FOLDERS

ROOT = Path(__file__).parents[2]

BORROWED = {
    "accuracy.md": "reports/README.md",
    "contributing.md": "CONTRIBUTING.md",
    "changelog.md": "CHANGELOG.md",
}
"""Pages that are files of the repository, unchanged."""

COUNTERPARTS = {
    **{file: page for page, file in BORROWED.items()},
    **{f"gaitval/{folder}": f"reference/{folder}.md" for folder in FOLDERS},
    "README.md": "index.md",
    "gaitval/cli/terminal/app.py": "reference/commands.md",
    "gaitval/configuration.py": "reference/configuration.md",
    "gaitval/metrics/tolerances.toml": "reference/limits.md",
}
"""The page that shows a file of the repository: links to the file lead there."""

GUIDES = 4.0
"""What a page that was written to be read counts in the search, against the reference's 1."""
CODE = 0.001
"""What a page of docstrings counts: there are ten times as many of those as of guides."""
NOTES = 0.1
"""What the page of dead ends counts: it is found where no guide has the words."""


def weight(page: str) -> float:
    """What a page counts in the search."""
    if page in {f"reference/{folder}.md" for folder in (*FOLDERS, "ground")}:
        return CODE
    if page == "what-we-tried.md":
        return NOTES
    looked_up = page.startswith("reference/") or page in BORROWED or page == "paper.md"
    return 1.0 if looked_up else GUIDES


def generated() -> Iterator[tuple[str, str]]:
    """Path below docs/ and Markdown text of each generated page."""
    for page, file in BORROWED.items():
        yield page, (ROOT / file).read_text(encoding="utf-8")
    yield "reference/commands.md", commands_page()
    yield "reference/configuration.md", configuration_page()
    yield "reference/limits.md", limits_page()
    for folder in FOLDERS:
        modules = sorted((ROOT / "gaitval" / folder).rglob("[!_]*.py"))
        yield f"reference/{folder}.md", code_page(folder, modules)
    yield (
        "reference/ground.md",
        code_page("the ground", sorted((ROOT / "gaitval").glob("[!_]*.py"))),
    )


def code_page(title: str, modules: list[Path]) -> str:
    """The docstrings of modules, for mkdocstrings to fill in."""
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in modules]
    return "\n\n".join([f"# {title}", *(f"::: {name}" for name in names), ""])


def table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table; line breaks and bars in cells are escaped."""
    lines = [header, ("---",) * len(header), *rows]
    return "\n".join(
        "| " + " | ".join(re.sub(r"\s+", " ", cell).replace("|", "\\|") for cell in line) + " |"
        for line in lines
    )


def commands_page() -> str:
    """The help of every command, as `gaitval COMMAND --help` shows it."""
    from typer.main import get_command

    from gaitval.cli import app

    root: Any = get_command(app)
    parts = ["# Commands", plain(root.help)]
    for name, command in root.commands.items():
        inner = getattr(command, "commands", None)
        if inner is None:
            parts += command_section(f"gaitval {name}", command)
            continue
        for part, each in inner.items():
            parts += command_section(f"gaitval {name} {part}", each)
    return "\n\n".join(parts) + "\n"


def command_section(name: str, command: Any) -> list[str]:
    """Heading, help, examples and options of one command."""
    text, _, examples = (command.help or "").partition("Examples:\n")
    arguments = [p.metavar or p.name.upper() for p in command.params if p.opts[0][0] != "-"]
    usage = " ".join([name, *arguments, "[OPTIONS]"])
    rows = [
        (
            ", ".join(f"`{option}`" for option in parameter.opts),
            plain(getattr(parameter, "help", None) or ""),
            "required" if parameter.required else default_of(parameter),
        )
        for parameter in command.params
    ]
    parts = [f"## {name}", plain(text), f"    {usage}"]
    if examples:
        parts += ["Examples:", "\n".join(f"    {line.strip()}" for line in examples.splitlines())]
    return [*parts, table(("option", "meaning", "default"), rows)]


def default_of(parameter: Any) -> str:
    """The default of an option, if its help shows it."""
    shown = getattr(parameter, "show_default", True)
    if not shown or parameter.default in (None, False):
        return ""
    return f"`{parameter.default}`"


def plain(text: str) -> str:
    """Help text without terminal markup, safe as Markdown."""
    text = re.sub(r"\[/?(?:bold|red|dim)?\]", "", text.replace("\b", ""))
    return text.replace("*", r"\*").replace("_", r"\_").strip()


def configuration_page() -> str:
    """Every setting with default, unit and reason, from `gaitval/configuration.py`."""
    from gaitval.configuration import Configuration

    parts = [
        "# Configuration",
        "Every constant of a run. A TOML file (`--config my.toml`) or `--set section.key=value` "
        "changes it. Written from `gaitval/configuration.py` when this site is built.",
    ]
    seed = Configuration.model_fields["seed"].default
    parts += ["## seed", f"`seed = {seed}`. The seed of every random number."]
    for name, field in Configuration.model_fields.items():
        section = field.annotation
        if name == "seed" or section is None:
            continue
        rows = [
            (f"`{key}`", f"`{toml(each.default)}`", each.description or "")
            for key, each in section.model_fields.items()
        ]
        text = re.sub(r"\s*\n\s*", " ", (section.__doc__ or "").replace("\n\n", "\0"))
        parts += [f"## {name}", text.replace("\0", "\n\n").strip()]
        parts += [table(("key", "default", "meaning"), rows)]
    return "\n\n".join(parts) + "\n"


def toml(value: Any) -> str:
    """A default as it would be written in a TOML file."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(toml(each) for each in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:g}" if value < 1e4 else f"{value:_.0f}"


def limits_page() -> str:
    """The limits with their sources, from `gaitval/metrics/tolerances.toml`."""
    from gaitval.metrics.tolerances import (
        JUDGED_UNITS,
        RECORDING_UNITS,
        WALK_UNITS,
        load_registry,
    )
    from gaitval.metrics.verdicts import SIGNS

    parts = [
        "# Limits and their sources",
        "Written from `gaitval/metrics/tolerances.toml` when this site is built. A limit of the "
        "role *acceptance* decides the verdict of a report; one of the role *context* is shown "
        "beside it. *published*: the source states this value for this use. *derived*: computed "
        "from what the source states. *convention*: ours, because no consensus value was found. "
        "*Unread*: the value is recalled, or was read in a secondary source.",
    ]
    registry = load_registry()
    for title, units in (
        ("Simulated walks", WALK_UNITS),
        ("Imported recordings", RECORDING_UNITS),
        ("OpenSim models and results (`gaitval judge`)", JUDGED_UNITS),
    ):
        rows = [
            (
                entry.title,
                f"{SIGNS[entry.limit]} {entry.value:g} {entry.unit}",
                entry.role,
                entry.status + ("" if entry.verified else ", unread"),
                f"{entry.citation}. {entry.locator}. {entry.note}",
            )
            for entry in registry.tolerance
            if entry.measure in units
        ]
        parts += [f"## {title}"]
        parts += [table(("measure", "limit", "role", "status", "source and note"), rows)]
    rows = [(f"`{each.measure}`", f"{each.value:g} {each.unit}") for each in registry.margin]
    parts += ["## Margins of `gaitval check`"]
    parts += ["A measure may be worse than in the stored baseline by no more than this."]
    parts += [table(("measure", "margin"), rows)]
    return "\n\n".join(parts) + "\n"
