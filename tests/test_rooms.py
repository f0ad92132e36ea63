"""Each room of scripts has a page that names every file in it, with its command."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("docs/build", "experiments", "evidence", "tests/robustness", "scripts")
ROW = re.compile(r"^\| `([^`]+)` \| (.+) \| (.*) \|$", re.MULTILINE)


def scripts(room: str) -> set[str]:
    """The scripts of a room, from its folder on."""
    return {
        path.relative_to(ROOT / room).as_posix()
        for end in ("py", "sh")
        for path in (ROOT / room).rglob(f"*.{end}")
        if path.name != "__init__.py"
    }


def rows(room: str) -> dict[str, tuple[str, str]]:
    """What the room's page says of each file, and its command."""
    text = (ROOT / room / "README.md").read_text(encoding="utf-8")
    return {name: (what, command) for name, what, command in ROW.findall(text)}


def docstring(path: Path) -> str:
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


@pytest.mark.parametrize("room", ROOMS)
def test_a_page_names_every_script_and_no_other(room):
    assert rows(room).keys() == scripts(room)


@pytest.mark.parametrize("room", ROOMS)
def test_commands_of_a_page_name_the_script(room):
    for name, (_, command) in rows(room).items():
        module = name.removesuffix(".py").replace("/", ".")
        for ours in re.findall(r"python3? (?:-m )?([\w./-]+)", command):
            assert ours in (f"{room}/{name}", f"{room}.{module}", "evidence"), (name, ours)


@pytest.mark.parametrize("room", ROOMS)
def test_what_is_shipped_is_said_in_the_first_line_and_on_the_page(room):
    for name, (what, _) in rows(room).items():
        if name.endswith(".py"):
            first = docstring(ROOT / room / name).partition("\n")[0]
            assert first.startswith("Shipped: ") == what.startswith("**shipped:**"), name
            if first.startswith("Shipped: "):
                (named, *_) = re.findall(r"(?:gaitval|extras|reports)/[\w./]*\w", first)
                assert (ROOT / named).exists(), name


def test_whatever_says_who_wrote_it_names_one_that_ships():
    """Files of the package that a script has written name it at their head."""
    rooms = "|".join(ROOMS)
    found = []
    for path in (ROOT / "gaitval").rglob("*"):
        if path.suffix in (".csv", ".toml") and "builtin" not in path.parts:
            head = " ".join(path.read_text(encoding="utf-8").split()[:200])
            found += re.findall(
                rf"[a-z]+ed? by (?:# )?((?:{rooms})/[\w/]+\.py)", head, re.IGNORECASE
            )
    assert len(found) >= 3
    for name in found:
        assert docstring(ROOT / name).startswith("Shipped: "), name


@pytest.mark.parametrize("room", ROOMS)
def test_arguments_are_read_by_argparse_alone(room):
    for name in sorted(scripts(room)):
        path = ROOT / room / name
        tree = ast.parse(path.read_text(encoding="utf-8")) if path.suffix == ".py" else ast.Module()
        read = [
            node.lineno
            for node in ast.walk(tree)
            if isinstance(node, ast.Subscript)
            and ast.unparse(node.value) == "sys.argv"
            and ast.unparse(node.slice) != "1:"
        ]
        assert not read, f"{room}/{name}, line {read}"


def test_the_list_of_measurements_needs_none_of_their_libraries():
    """`--list` reads sources; a bare system has no numpy."""
    code = "import sys; sys.modules['numpy'] = None; from evidence.__main__ import main; "
    done = subprocess.run(
        [sys.executable, "-c", f"{code}main(['--list'])"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    listed = [line.split()[:2] for line in done.stdout.splitlines()]
    assert ["first", "stale"] in listed
    page = (ROOT / "evidence" / "README.md").read_text(encoding="utf-8")
    for topic, row in listed:
        assert re.search(rf"evidence {topic}\b(?!.*`{topic}`)", page), (topic, row)


def test_an_unknown_topic_or_row_is_refused_with_those_that_there_are():
    from evidence.__main__ import main

    with pytest.raises(SystemExit, match=r"No topic is called 'nothing'.*first"):
        main(["nothing"])
    with pytest.raises(SystemExit, match=r"first has no 'nothing'.*verdicts"):
        main(["first", "nothing"])
