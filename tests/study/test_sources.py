"""The code of a stage: a change of what it uses is reported with its file, and no other."""

import ast
import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from gaitval.artefacts import write_json, write_text
from gaitval.study import (
    identification_stages,
    learning_stages,
    report_stages,
    scaling_stages,
    sources,
    walking_stages,
)
from gaitval.study.sources import DATA, PACKAGE, code_of
from gaitval.study.stage import INTERRUPTED, Stage, run_stage, why_run

FILES = {
    "__init__.py": "from small.other import never\n",
    "study/__init__.py": "",
    "study/stages.py": '''from typing import TYPE_CHECKING
from small.study.inputs import doubled
if TYPE_CHECKING:
    from small.person import Person
FACTOR = 3
def scale_stage(person: "Person"):
    """Multiplies."""
    def run():
        from small.scaling import scaled
        return scaled(FACTOR) + doubled()  # a comment
    return run
def push_stage():
    def run():
        from small.pushes import push
    return run
''',
    "study/inputs.py": "from small.ground import two\ndef doubled():\n    return two\n"
    "def unused():\n    from small.other import never\n",
    "scaling.py": "def scaled(n):\n    import small.lengths\n    return n\n",
    "lengths.py": "LENGTH = 1.0\n",
    "ground.py": "two = 2\n",
    "person.py": "class Person:\n    pass\n",
    "pushes.py": "push = 300\n",
    "other.py": "never = True\n",
}


def forget() -> None:
    """As in a new process."""
    kept = (sources._code, sources._tree, sources._file, sources._imported_by, sources._kept_at)
    for cached in kept:
        cached.cache_clear()


@pytest.fixture
def package(tmp_path: Path) -> Iterator[Path]:
    """A small package in the place of ours."""
    for name, text in FILES.items():
        write_text(tmp_path / "small" / name, text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "PACKAGE", tmp_path / "small")
        patch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
        forget()
        yield tmp_path / "small"
    forget()


def function(name: str, module: str = "small.study.stages") -> Callable[[], None]:
    def run() -> None:
        pass

    run.__module__, run.__qualname__ = module, f"{name}.<locals>.run"
    return run


@pytest.fixture
def code(package: Path) -> Callable[[], dict[str, str]]:
    """The code of `scale_stage` as a new process finds it."""

    def found() -> dict[str, str]:
        forget()
        return code_of(function("scale_stage"))

    return found


def test_what_a_stage_reaches_is_its_code_and_nothing_else(code) -> None:
    assert {name.removeprefix("small/") for name in code()} == {
        "study/stages.py",
        "study/inputs.py",
        "scaling.py",
        "lengths.py",
        "ground.py",
        "person.py",
    }


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("study/stages.py", "FACTOR = 3", "FACTOR = 4"),
        ("study/stages.py", "scaled(FACTOR) +", "scaled(FACTOR) -"),
        ("study/inputs.py", "return two", "return two + 1"),
        ("scaling.py", "return n", "return -n"),
        ("lengths.py", "1.0", "1.1"),
        ("ground.py", "2", "3"),
        ("person.py", "pass", "age = 1"),
    ],
)
def test_a_change_is_seen_in_its_file(package: Path, code, file: str, old: str, new: str) -> None:
    before = code()
    write_text(package / file, FILES[file].replace(old, new))
    after = code()
    assert {name for name in before if before[name] != after[name]} == {f"small/{file}"}


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("study/stages.py", "# a comment", "# another"),
        ("study/stages.py", "Multiplies.", "Multiplies a length."),
        ("study/stages.py", "import push\n", "import push as other\n"),
        ("study/inputs.py", "def unused():\n", "def unused():\n    print()\n"),
        ("pushes.py", "300", "400"),
        ("other.py", "True", "False"),
        ("__init__.py", "from", "import sys\nfrom"),
    ],
)
def test_what_is_not_its_code_is_not_seen(
    package: Path, code, file: str, old: str, new: str
) -> None:
    before = code()
    assert old in FILES[file]
    write_text(package / file, FILES[file].replace(old, new))
    assert code() == before


@pytest.mark.parametrize("damage", [None, "{", "[]"])
def test_what_was_read_of_the_sources_is_kept_for_them(
    package: Path, code, monkeypatch, tmp_path: Path, damage: str | None
) -> None:
    """By what they contain: changed ones are read again, and so are those of a damaged file."""
    first = code()
    (kept,) = (tmp_path / "cache" / "gaitval").iterdir()
    if damage is not None:
        kept.write_text(damage, encoding="utf-8")
    else:
        monkeypatch.setattr(sources, "_read_code", None)
    assert code() == first
    monkeypatch.undo()
    write_text(package / "ground.py", "two = 3\n")
    assert code() != first
    assert len(list(kept.parent.iterdir())) == 2


def test_without_a_cache_the_sources_are_read_all_the_same(
    code, monkeypatch, tmp_path: Path
) -> None:
    expected = code()
    (tmp_path / "other").write_text("a file", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "other"))
    assert code() == expected
    assert sources._kept_at() is None


def text_of(code: str) -> str:
    return sources._text(ast.parse(code).body[0])


def test_the_text_of_a_statement_is_ours_and_not_that_of_a_version_of_python() -> None:
    """3.11 has no `type_params`, 3.12 an empty list of them, `ast.dump` of 3.13 no empty list."""
    assert text_of("def double(x):\n    return 2 * x") == (
        "FunctionDef(args=arguments(args=[arg(arg='x')]), body=[Return(value=BinOp(left=int(2), "
        "op=Mult(), right=Name(ctx=Load(), id='x')))], name='double')"
    )
    assert text_of("f'a{x:{n}.1f}'") == (
        "Expr(value=JoinedStr('a', FormattedValue(conversion=-1, format_spec=JoinedStr("
        "FormattedValue(conversion=-1, value=Name(ctx=Load(), id='n')), '.1f'), "
        "value=Name(ctx=Load(), id='x'))))"
    )
    assert text_of("'\u03bc'") == r"Expr(value=str('\u03bc'))"


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("x = 1", "x = 1.0"),
        ("x = 1", "x = True"),
        ("x = '1'", "x = 1"),
        ("x = 'y'", "x = b'y'"),
        ("return_ = None", "return_ = ()"),
        ("f(a)", "f(*a)"),
        ("f({**a})", "f({a: a})"),
        ("f'{x}'", "f'{x!r}'"),
        ("f'{x}'", "'{x}'"),
        ("def f(x, /): ...", "def f(x): ..."),
        ("def f(*, x): ...", "def f(*, x=None): ..."),
        ("def f(): return", "def f(): return None"),
        ("for x in y: z()", "async def f(): z()"),
    ],
)
def test_statements_that_differ_have_different_texts(one: str, other: str) -> None:
    assert text_of(one) != text_of(other)


def test_pieces_of_a_string_are_one_string() -> None:
    assert text_of("f'a' 'b' f'{x}' ''") == text_of("f'ab{x}'")


def test_functions_of_elsewhere_have_no_code_here(package: Path) -> None:
    assert code_of(function("scale_stage")) != {}
    assert code_of(function("scale_stage", "tests.somewhere")) == {}


STAGE_CODE = {
    "scale_stage": ("scaling/scaling.py", "model/urdf.py", "datasets/subject.py"),
    "reference_stage": ("reference/dynamic_fit.py", "datasets/subject.py", "compiled.py"),
    "need_stage": ("metrics/policy_comparison.py", "policy/rollouts.py"),
    "train_stage": ("policy/training.py", "policy/learner.py", "simulation/walker.py"),
    "identify_stage": ("identification/begin.py", "contact/forces.py"),
    "evaluate_stage": ("metrics/epsilon.py", "policy/rollouts.py"),
    "choose_stage": ("study/inputs.py",),
    "correct_stage": ("learning_control/correct.py", "metrics/reference_curves.py"),
    "simulate_stage": ("simulation/walker.py", "metrics/rollouts.py", "reference/adjustment.py"),
    "push_stage": ("metrics/push_recovery.py", "reference/adjustment.py"),
    "validate_stage": ("metrics/validation.py", "metrics/tolerances.toml"),
    "report_stage": ("reporting/report.py", "reporting/report.html.j2"),
}
ROUND = {f"gaitval/metrics/{name}.py" for name in ("round_errors", "typed", "identified_body")}
"""How a round's error and the body that it found are stored, which the next round reads."""
NOT_CODE = {
    "train_stage": ("reporting/", "metrics/", "session/", "cli/"),
    "scale_stage": ("policy/", "simulation/", "metrics/"),
    "push_stage": ("reporting/", "identification/", "metrics/validation.py"),
    "validate_stage": ("reporting/", "cli/", "policy/training.py"),
}


GROUPS = scaling_stages, learning_stages, identification_stages, walking_stages, report_stages


@pytest.mark.slow
@pytest.mark.parametrize("name", STAGE_CODE)
def test_every_stage_knows_the_code_that_it_runs(name: str) -> None:
    (stage,) = (vars(module)[name] for module in GROUPS if name in vars(module))
    found = code_of(function(name, stage.__module__))
    assert {f"gaitval/{each}" for each in STAGE_CODE[name]} <= found.keys()
    strangers = tuple(f"gaitval/{each}" for each in NOT_CODE.get(name, ()))
    assert not strangers or not [each for each in {*found} - ROUND if each.startswith(strangers)]


@pytest.mark.parametrize(
    "name",
    [
        "learning_stages:train_stage", "scaling_stages:reference_stage",
        "identification_stages:identify_stage", "walking_stages:correct_stage",
    ],
)  # fmt: skip
def test_a_page_is_no_code_of_what_computes(name: str) -> None:
    """A word in a template must not make anybody walk again."""
    assert not [file for file in code_of(f"gaitval.study.{name}") if "/reporting/" in file]


def test_a_function_can_be_named_without_loading_it() -> None:
    named = code_of("gaitval.study.scaling_stages:scale_stage")
    assert named == code_of(function("scale_stage", "gaitval.study.scaling_stages"))
    assert "gaitval/scaling/scaling.py" in named


def test_the_templates_of_the_body_are_code_of_scale() -> None:
    assert "models/xacro/leg.xacro" in code_of(
        function("scale_stage", "gaitval.study.scaling_stages")
    )


NOT_READ_BY_A_STAGE = (
    "apps/",  # pages, and what is above the stages
    "importing/",
    "measurement/",
    "configurations/",  # the settings themselves are inputs
    "datasets/",  # likewise the subject
    "model/devices/shipped/",  # likewise: the subject has the whole table
    "samples/",  # a recording to import
    *("measurement/", "scaling/markers/"),  # an import reads them
    *(f"apps/{name}/" for name in ("cohort", "judge", "live", "patients", "regression")),
    *("apps/devices/experiments", "apps/devices/side_by_side.html.j2"),
    "metrics/metrics.schema.json",  # written from the models
    "importing/import.schema.json",
    "identification/identification.schema.json",
    "py.typed",
)


def test_all_data_files_are_known_to_the_module_that_reads_them() -> None:
    assert all(importlib.util.find_spec(module) for module in DATA)
    read = {path for patterns in DATA.values() for each in patterns for path in PACKAGE.glob(each)}
    files = [path for path in PACKAGE.rglob("*") if path.is_file()]
    unknown = [
        path
        for path in files
        if path.suffix not in (".py", ".pyc", ".pyi")
        and path not in read
        and not path.relative_to(PACKAGE).as_posix().startswith(NOT_READ_BY_A_STAGE)
    ]
    assert not unknown


def test_no_stage_imports_by_a_name_that_is_worked_out() -> None:
    """Imports are read from the syntax: `importlib` would hide them."""
    for path in PACKAGE.rglob("*.py"):
        if path.parent == PACKAGE or path.parent.name in ("cli", "cohort"):  # above the stages
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            assert getattr(node, "attr", "") != "import_module", path


# --- the records of a run folder ----------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_json(tmp_path / "provenance.json", {"stages": {}})
    return tmp_path


@pytest.fixture
def scale(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Stage]:
    """A stage whose code has this hash; it fails where `ready.txt` is not there."""

    def stage(code: str) -> Stage:
        def run() -> None:
            write_text(folder / "work" / "half.txt", code)
            (folder / "ready.txt").read_text()
            write_text(folder / "model.urdf", code)

        found = {"gaitval/scaling/scaling.py": code, "gaitval/errors.py": "0"}
        monkeypatch.setattr("gaitval.study.stage.code_of", lambda function: found)
        return Stage("scale", run, (), ("model.urdf",), workspace="work")

    write_text(folder / "ready.txt", "")
    return stage


def test_a_stage_runs_again_after_a_change_of_its_code_and_says_where(folder: Path, scale) -> None:
    assert run_stage(scale("a"), folder)
    assert why_run(scale("a"), folder) is None
    reason = "the code of scale has changed: gaitval/scaling/scaling.py"
    assert why_run(scale("b"), folder) == reason
    assert run_stage(scale("b"), folder)
    assert why_run(scale("b"), folder) is None


def test_what_other_code_began_is_not_resumed(folder: Path, scale) -> None:
    (folder / "ready.txt").unlink()
    for code in ("a", "b"):
        with pytest.raises(FileNotFoundError):
            run_stage(scale(code), folder)
    assert why_run(scale("b"), folder) == INTERRUPTED
    write_text(folder / "work" / "more.txt", "")
    write_text(folder / "ready.txt", "")
    run_stage(scale("b"), folder)
    assert (folder / "work" / "more.txt").exists()  # the same code goes on
    (folder / "ready.txt").unlink()
    with pytest.raises(FileNotFoundError):
        run_stage(scale("c"), folder)
    assert not (folder / "work" / "more.txt").exists()


@pytest.mark.usefixtures("package")
def test_a_wheel_has_the_names_of_a_checkout(tmp_path: Path, monkeypatch) -> None:
    """The body model lies inside the package there; its code is the same."""
    checkout, wheel = tmp_path / "checkout" / "gaitval", tmp_path / "wheel" / "gaitval"
    found = []
    for package, models in (
        (checkout, checkout.parent / "models" / "xacro"),
        (wheel, wheel / "models" / "xacro"),
    ):
        (package / "model").mkdir(parents=True)
        (package / "model" / "__init__.py").write_text("")
        (package / "model" / "urdf.py").write_text("def read():\n    return 1\n")
        models.mkdir(parents=True)
        (models / "leg.xacro").write_text("<leg/>")
        monkeypatch.setattr(sources, "PACKAGE", package)
        forget()
        found.append(code_of("gaitval.model.urdf:read"))
    assert found[0] == found[1]
    assert "models/xacro/leg.xacro" in found[0]
