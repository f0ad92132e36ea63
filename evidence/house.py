"""What a reader of the code meets: its size, names, types, comments and words; what a change of it
touches, and whether numbers stayed.

`start` says something only on a machine that does nothing else. `touched` reads the history of a
checkout in which four changes were shown, each with a line `Shown-change: NAME` in its message.
"""

import ast
import fnmatch
import io
import json
import os
import re
import runpy
import subprocess
import sys
import tempfile
import tokenize
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import evidence
from evidence import ROOT
from evidence.rows import git

PACKAGE = ROOT / "gaitval"
MARK = "loaded modules:"
LOADED = f"""
import sys
from gaitval.cli import main
sys.argv[0] = "gaitval"
try:
    main()
finally:
    files = [getattr(each, "__file__", None) or "" for name, each in list(sys.modules.items())
             if name.partition(".")[0] == "gaitval"]
    print({MARK!r}, *(file for file in files if file.endswith(".py")), file=sys.stderr)
"""
LOOSE = re.compile(r"dict\[str, Any\]|\bJson\b")
LOOSE_IN = ("metrics", "reporting", "study")
ROOMS = ("docs/build", "evidence", "experiments", "scripts", "tests/robustness")
RUNS = 5
CSV = evidence.FOLDER / "house.csv"
LINES = "lines of gaitval/"
REACHED = "lines reached by gaitval subject and gaitval import together, without gaitval/cli"
METHODS = ("training.samples", "identification.", "correction.")
"""Quick settings that choose another method than the default one."""
SHORT = ("identification.generations=2", "correction.steps=1")
"""The same of the default methods, in as few steps as they have."""
MEASURES = {
    "lines *": {
        "code": (
            "evidence/house.py:size,reached,_modules_of,lines_of,METHODS,SHORT",
            "gaitval/*.py",
        ),
        "allowed": 100_000,
        "why": "tests/test_house.py counts anew at every change",
    },
    "*, cold": {
        "code": ("gaitval/__init__.py", "gaitval/cli/*.py", "evidence/house.py:start,_seconds"),
        "allowed": 60,
        "why": "a statement that defines a command or an option takes under 1 ms",
    },
    "files touched by *": {"code": ("evidence/house.py:touched,changes,files_of,COUNTED",)},
    "numbers of the ten stored baselines *": {
        "code": ("evidence/house.py:numbers,differing,numbers_of,_named",),
        "data": ("reports/S*/baseline/metrics.json",),
    },
    "*": {"code": ("evidence/house.py:types,words",)},
}
"""What the rows depend on; see evidence/stale.py."""

SHOWN = {
    "a new import option": (2, 3),
    "a new verdict": (3, 4),
    "a new contact law": (2, 3),
    "a prosthesis side on Subject": (4, 6),
}
"""Changes that commits show, with the number of files that each should touch, and may."""
TRAILER = "Shown-change"
"""What names the change in the message of its commit."""
COUNTED = (("gaitval/*", "models/*"), ("*.schema.json",))
"""Files that count, and those of them that do not because a script writes them. Tests,
documentation and evidence are elsewhere. Translations of the pages' texts count."""

BASELINES = "reports/S*/baseline/metrics.json"
BEFORE = evidence.option("--before", metavar="COMMIT", help="the commit to compare HEAD with")
UNCOUNTED = ("provenance", "schema_version")
"""Parts of `metrics.json` that say how it was made, and no number of the walk."""
NAMES = ("id", "measure", "name", "kind", "curve", "target")
"""What a row of a list is known by, whatever its place."""

OLD_WORDS = (
    r"told", r"untold", r"tell(?:s|ing)?", r"doubt(?:s|ed|ful)?", r"mend(?:s|ed|ing)?",
    r"witness(?:es)?", r"habit(?:s)?", r"begun",
)  # fmt: skip
"""The private dialect of earlier versions: for known to the model, held out, says, warning, fix,
second-engine check, action bias, started."""


@cache
def tree_of(path: Path) -> ast.Module:
    """The syntax tree of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))


def modules(folder: Path = PACKAGE) -> list[Path]:
    """All modules of a folder."""
    return sorted(folder.rglob("*.py"))


def lines_of(paths: list[Path]) -> int:
    """Lines of modules, blank ones and docstrings among them."""
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in paths)


def reached() -> list[Path]:
    """Modules of the package that `gaitval subject` and `gaitval import` load with the default
    methods: no training unless the person needs one, identification, one round of correction. The
    sizes are the quick ones of the tests, and the recording is the sample.
    """
    quick = runpy.run_path(str(ROOT / "tests" / "support" / "quick_settings.py"))["QUICK"]
    sizes = [each for each in quick if not each.startswith(METHODS)]
    settings = [word for each in (*sizes, *SHORT) for word in ("--set", each)]
    with tempfile.TemporaryDirectory() as place:
        sample, cache = Path(place) / "sample", Path(place) / "cache"
        _modules_of(cache, "data", "sample", str(sample))
        about = json.loads((sample / "truth.json").read_text(encoding="utf-8"))
        person = [f"--mass={about['mass_kg']}", f"--height={about['height_m']}",
                  f"--sex={about['sex']}"]  # fmt: skip
        loaded: set[Path] = set()
        for out in (Path(place) / "compiling", Path(place) / "compiled"):
            loaded = _modules_of(cache, "subject", "5", "--out", str(out / "subject"), *settings)
            loaded |= _modules_of(cache, "import", "--static", str(sample / "standing.c3d"),
                                  "--trial", str(sample / "walking.c3d"), *person,
                                  "--out", str(out / "import"))  # fmt: skip
    return sorted(loaded)


def _modules_of(cache: Path, *words: str) -> set[Path]:
    """Files of the package that a command has loaded when it ends, with numba's `cache`.

    Raises
    ------
    SystemExit : the command failed.
    """
    run = [sys.executable, "-c", LOADED, *words]
    # numba's index of what others compiled loads the types of its arguments, another law's for one
    own = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    done = subprocess.run(run, cwd=ROOT, env=own, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"gaitval {' '.join(words)}: {done.stderr}")
    return {Path(line) for line in done.stderr.partition(MARK)[2].split()}


def shared_names() -> dict[str, list[str]]:
    """Public classes of one name that are defined in several modules, with those."""
    found: dict[str, list[str]] = {}
    for path in modules():
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(path.relative_to(ROOT).as_posix())
    return {name: places for name, places in found.items() if len(places) > 1}


def loose_types() -> Counter[str]:
    """How often a folder's modules write `dict[str, Any]` or `Json`."""
    return Counter(
        {
            name: sum(
                len(LOOSE.findall(path.read_text(encoding="utf-8")))
                for path in modules(PACKAGE / name)
            )
            for name in LOOSE_IN
        }
    )


def comment_lines() -> int:
    """Lines of the package that are a comment alone."""
    count = 0
    for path in modules():
        with tokenize.open(path) as file:
            for token in tokenize.generate_tokens(io.StringIO(file.read()).readline):
                alone = token.line.lstrip().startswith("#")
                count += token.type == tokenize.COMMENT and alone
    return count


def public_functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Public functions of modules, with their places."""
    for path in modules():
        for node in tree_of(path).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                yield f"{path.relative_to(ROOT)}: {node.name}", node


def undocumented() -> list[str]:
    """Public functions of which something is not said: what it is, a parameter that is not, by its
    name in the text, or an error that it raises itself.
    """
    return [place for place, node in public_functions() if not is_documented(node)]


def is_documented(node: ast.FunctionDef) -> bool:
    """Whether the docstring names every parameter and every error that the body raises."""
    text = ast.get_docstring(node)
    if not text:
        return False
    given = node.args
    names = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    raised = {
        each.exc.func.id
        for each in ast.walk(node)
        if isinstance(each, ast.Raise)
        and isinstance(each.exc, ast.Call)
        and isinstance(each.exc.func, ast.Name)
        and each.exc.func.id[0].isupper()  # else it is the function that makes the error
    }
    return all(re.search(rf"\b{re.escape(name)}\b", text) for name in (*names, *raised))


def old_words() -> list[str]:
    """Words of the old dialect in what users and developers read, with their places: pages of the
    documentation, texts of the code, docstrings, templates. Names of the code are no words: what is
    in backticks or fences, a parameter in front of its description, an annotation, a text without
    a space.
    """
    pattern = re.compile(rf"\b(?:{'|'.join(OLD_WORDS)})\b", re.IGNORECASE)
    pages = (*sorted(ROOT.glob("docs/**/*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md")
    texts = [(str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")) for path in pages]
    for path in sorted(PACKAGE.rglob("*.j2")):
        text = re.sub(r"\{[{%#].*?[}%#]\}", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        texts.append((str(path.relative_to(ROOT)), text))
    for path in modules():
        annotations = {
            getattr(node, field, None)
            for node in ast.walk(tree_of(path))
            for field in ("annotation", "returns")
        }
        for node in ast.walk(tree_of(path)):
            if (
                isinstance(node, ast.Constant)
                and isinstance(node.value, str)
                and " " in node.value
                and node not in annotations
            ):
                texts.append((f"{path.relative_to(ROOT)}:{node.lineno}", node.value))
    return [f"{place}: {word}" for place, text in texts for word in pattern.findall(_prose(text))]


def _prose(text: str) -> str:
    """A text without names of the code."""
    text = re.sub(r"^ *```.*?^ *```$", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"`[^`]*`", "", text)
    return re.sub(r"^ *(?:\w+, )*\w+ :", "", text, flags=re.MULTILINE)


def scripts_without_page() -> list[str]:
    """Scripts that the page of their room does not name."""
    found = []
    for room in ROOMS:
        page = ROOT / room / "README.md"
        text = page.read_text(encoding="utf-8") if page.is_file() else ""
        for path in sorted((ROOT / room).rglob("*")):
            script = path.suffix in (".py", ".sh") and path.name != "__init__.py"
            if script and path.name not in text:
                found.append(path.relative_to(ROOT).as_posix())
    return found


def _row(what: str, value: float, unit: str, goal: float, must: float, n: int) -> evidence.Row:
    return evidence.Row(what, value, unit, "<=", goal, must, n)


def _at_least(what: str, value: float, unit: str, goal: float, must: float, n: int) -> evidence.Row:
    return evidence.Row(what, value, unit, ">=", goal, must, n)


@evidence.measurement()
def size(_: Namespace) -> list[evidence.Row]:
    """Lines of the package, and of what `gaitval subject` and `gaitval import` reach behind the
    command line, whose own modules are the same for every command.
    """
    both = [path for path in reached() if PACKAGE / "cli" not in path.parents]
    extras = ROOT / "extras"
    print(f"beside it, extras/: {lines_of(modules(extras)) if extras.is_dir() else 0} lines")
    return [
        _row(LINES, lines_of(modules()), "lines", 50_000, 53_000, len(modules())),
        _row(REACHED, lines_of(both), "lines", 38_000, 40_000, len(both)),
    ]  # fmt: skip


@evidence.measurement()
def types(_: Namespace) -> list[evidence.Row]:
    """Class names with two meanings, and loosely typed dictionaries."""
    shared, loose = shared_names(), loose_types()
    print("\n".join(f"{name}: {', '.join(places)}" for name, places in shared.items()))
    print(loose)
    folders = ", ".join(LOOSE_IN)
    return [
        evidence.none_may("public class names with two meanings", len(shared), "names",
                          len(modules())),
        _row(f"dict[str, Any] and Json in {folders}", loose.total(), "uses", 20, 60, len(LOOSE_IN)),
    ]  # fmt: skip


@evidence.measurement()
def words(_: Namespace) -> list[evidence.Row]:
    """Comments, documented functions, words of the old dialect, scripts that a page names."""
    lines, functions = lines_of(modules()), sum(1 for _ in public_functions())
    lacking, old, nameless = undocumented(), old_words(), scripts_without_page()
    print("\n".join([*lacking[:40], *old[:40], *nameless]))
    return [
        _at_least("comment lines of gaitval/", 100 * comment_lines() / lines, "%", 3, 2, lines),
        _at_least("public functions whose parameters and errors are documented",
                  100 * (1 - len(lacking) / functions), "%", 100, 95, functions),
        evidence.none_may("words of the old dialect in docs, help and messages", len(old),
                          "words", len(modules())),
        evidence.none_may("scripts without a page that names them", len(nameless), "scripts",
                          len(ROOMS)),
    ]  # fmt: skip


@evidence.measurement()
def start(_: Namespace) -> list[evidence.Row]:
    """Seconds of `import gaitval` and of `gaitval --help`, each in a process of its own."""
    # the least of several: what else the machine does can only add to it
    took = {
        "import gaitval": _seconds("import gaitval"),
        "gaitval --help": _seconds("import sys; sys.argv = ['gaitval', '--help']; "
                                   "from gaitval.cli import main; main()"),
    }  # fmt: skip
    limits = {"import gaitval": (0.1, 0.3), "gaitval --help": (0.4, 0.6)}
    return [
        _row(f"{name}, cold", seconds, "s", *limits[name], RUNS) for name, seconds in took.items()
    ]


def _seconds(code: str) -> float:
    timed = (
        "import time; t = time.perf_counter()\ntry:\n    exec({!r})\nfinally:\n    "
        "import sys; print(time.perf_counter() - t, file=sys.stderr)"
    )
    found = []
    for _ in range(RUNS):
        done = subprocess.run([sys.executable, "-c", timed.format(code)], cwd=ROOT,
                              capture_output=True, text=True, check=False)  # fmt: skip
        found.append(float(done.stderr.split()[-1]))
    return min(found)


def changes() -> dict[str, str]:
    """The commit that shows each change, the newest if there are several, by the change's name."""
    # a unit separator stands between the commit and the names, a record separator between these
    form = f"--format=%H%x1f%(trailers:key={TRAILER},valueonly,separator=%x1e)"
    found: dict[str, str] = {}
    for line in git("log", form).splitlines():
        commit, _, names = line.partition("\x1f")
        for name in filter(None, names.split("\x1e")):
            found.setdefault(name.strip(), commit)
    return found


def files_of(commit: str) -> list[str]:
    """Files that a commit touches and that count; one that it moves counts with both its names."""
    names = git(
        "diff-tree", "--root", "-r", "--no-commit-id", "--name-only", "--no-renames", "-z", commit
    )
    counted, written = COUNTED
    return [
        name
        for name in filter(None, names.split("\0"))
        if any(fnmatch.fnmatchcase(name, each) for each in counted)
        and not any(fnmatch.fnmatchcase(name, each) for each in written)
    ]


@evidence.measurement()
def touched(_: Namespace) -> list[evidence.Row]:
    """Files of the package that a new option, verdict, contact law and prosthesis side touch."""
    shown = changes()
    if missing := [name for name in SHOWN if name not in shown]:
        print(f"No commit of this history shows {', '.join(missing)}: a shallow clone has none.")
        return []
    rows = []
    for name, (goal, must) in SHOWN.items():
        files = files_of(shown[name])
        print(f"{name} ({shown[name][:9]}): {', '.join(files)}")
        rows.append(_row(f"files touched by {name}", len(files), "files", goal, must, 1))
    return rows


@evidence.measurement(BEFORE)
def numbers(given: Namespace) -> list[evidence.Row]:
    """Numbers of the stored baselines that differ between a commit and HEAD."""
    if given.before is None:
        print("No commit to compare with: give --before COMMIT.")
        return []
    try:
        listed = git("ls-tree", "-r", "--name-only", given.before, "reports").splitlines()
    except subprocess.CalledProcessError:
        raise SystemExit(f"{given.before}: no commit of this history.") from None
    files = [name for name in listed if fnmatch.fnmatchcase(name, BASELINES)]
    there = set(git("ls-tree", "-r", "--name-only", "HEAD", "reports").splitlines())
    different, count = 0, 0
    for name in files:
        before = json.loads(git("show", f"{given.before}:{name}"))
        now = json.loads(git("show", f"HEAD:{name}")) if name in there else {}
        found = differing(before, now)
        for place in found[:10]:
            print(f"{name}: {place}")
        different += len(found)
        count += len(numbers_of(before))
    what = "numbers of the ten stored baselines that differ"
    return [evidence.none_may(what, different, "numbers", count)]


def differing(before: dict[str, Any], now: dict[str, Any]) -> list[str]:
    """Places of numbers of a `metrics.json` that another does not have, or has otherwise; what only
    the other one has does not count.
    """
    other = numbers_of(now)
    return [place for place, value in numbers_of(before).items() if other.get(place) != value]


def numbers_of(metrics: dict[str, Any]) -> dict[str, float]:
    """Every number of a `metrics.json` by its place, but for those of `UNCOUNTED`."""
    found: dict[str, float] = {}

    def look(value: object, place: str) -> None:
        if isinstance(value, dict):
            for name, each in value.items():
                look(each, f"{place}/{name}")
        elif isinstance(value, list):
            for name, each in zip(_named(value), value, strict=True):
                look(each, f"{place}/{name}")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[place] = value

    look({name: each for name, each in metrics.items() if name not in UNCOUNTED}, "")
    return found


def _named(rows: list[Any]) -> list[str]:
    """Names of the rows of a list by what they say they are, else by their places."""
    names = [
        " ".join(str(row[name]) for name in NAMES if name in row) if isinstance(row, dict) else ""
        for row in rows
    ]
    return names if all(names) and len({*names}) == len(names) else [*map(str, range(len(rows)))]
