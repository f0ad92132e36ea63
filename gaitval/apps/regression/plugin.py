"""pytest plug-in: tests that a stored walk still reaches its accuracy.

    def test_knee(gaitval_check):
        gaitval_check("S05", quantities=["knee_angle"])

Installing gaitval installs it. The stored policy walks again with the installed code and libraries,
once for each baseline however many tests ask for it (also over the workers of pytest-xdist), and
every chosen measure must be within its margin of the stored one. Tests that use the fixture carry
the marker `gaitval`, so that `-m "not gaitval"` leaves them out.
"""

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    from gaitval.apps.regression.regression import Row
    from gaitval.metrics.tolerances import Measure

_CheckFixture = Callable[..., "list[Row]"]

_MOVED: Final = pytest.StashKey[dict[str, list[str]]]()
"""What moved by more than its margin, lines by baseline, for the summary."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the plug-in's options to pytest's `parser`."""
    group = parser.getgroup("gaitval", "accuracy of stored walks")
    group.addoption(
        "--gaitval-full",
        action="store_true",
        help="also the long walks and the pushes: minutes instead of seconds for each baseline",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker in pytest's `config`."""
    config.addinivalue_line("markers", "gaitval: walks a stored policy again (gaitval_check)")
    config.stash[_MOVED] = {}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests among `items` that walk."""
    for item in items:
        if "gaitval_check" in getattr(item, "fixturenames", ()):
            item.add_marker("gaitval")


@pytest.fixture
def gaitval_check(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> _CheckFixture:
    """A function that fails the test if a stored walk has lost accuracy (for pytest's `request`, in
    folders of `tmp_path_factory`).

    Its parameters: `baseline`, the folder (relative to pytest's root) or a built-in subject
    ("S05"), whose baseline comes with gaitval; `quantities`, measures
    ("angle_rmse") or their targets, with or without the side ("knee_angle", "knee_angle_r"), all
    of them if left out. It returns the rows that were compared; a quantity of which none would be
    compared fails the test.
    """
    from gaitval.apps.regression.stored_baselines import find_baseline
    from gaitval.errors import GaitvalError

    def check(baseline: str | Path, quantities: Sequence[str] | None = None) -> "list[Row]":
        __tracebackhide__ = True
        refused = None
        try:
            folder = find_baseline(baseline, request.config.rootpath).resolve()
            # before the walk, which takes seconds
            _check_quantities(folder, quantities, full=_is_full(request.config))
            rows, inputs = _compared(request.config, folder, tmp_path_factory)
            chosen = [row for row in rows if quantities is None or _names(row) & {*quantities}]
        except GaitvalError as error:
            refused = str(error)
        if refused is not None:  # not inside `except`: pytest would show both errors
            pytest.fail(refused, pytrace=False)
        request.node.user_properties.append(("inputs of the walk", inputs))
        worse = [row for row in chosen if row.change == "lost"]
        request.config.stash[_MOVED][str(baseline)] = [
            _line(row) for row in rows if row.change != "kept"
        ]
        if worse:
            pytest.fail(
                f"{folder}: {len(worse)} of {len(chosen)} measures are worse than stored by more "
                "than their margin.\n"
                + "\n".join(f"  {_line(row)}" for row in worse)
                + f"\nInputs: {inputs}. If the change is intended, store a new "
                "baseline with `gaitval baseline SUBJECT`.",
                pytrace=False,
            )
        return chosen

    return check


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Write to `terminalreporter` what moved, of every baseline walked here (`config`)."""
    for baseline, lines in config.stash[_MOVED].items():
        if lines:
            terminalreporter.write_sep("-", f"gaitval: {baseline}")
            for line in lines:
                terminalreporter.write_line(line)


def _compared(
    config: pytest.Config, folder: Path, temporary: pytest.TempPathFactory
) -> "tuple[list[Row], str]":
    """The rows of a baseline, and what its walk depends on that has changed since."""
    import filelock

    from gaitval._internal.io.artefacts import value_hash, write_json
    from gaitval.apps.regression.baseline import changed_inputs, stored_metrics, walk_again
    from gaitval.apps.regression.regression import LONG_MEASURES, compare
    from gaitval.apps.regression.seal import inputs_in_words
    from gaitval.metrics.results import read_metrics
    from gaitval.study.inputs import METRICS
    from gaitval.study.stage import Observer

    full = _is_full(config)
    stored = stored_metrics(folder / METRICS)
    # One folder for all workers of pytest-xdist, which are started side by side.
    base = temporary.getbasetemp()
    shared = base.parent if hasattr(config, "workerinput") else base
    walked = shared / f"gaitval-{value_hash([str(folder), full])[:16]}.json"
    with filelock.FileLock(walked.with_suffix(".lock")):
        if not walked.exists():
            write_json(walked, walk_again(folder, Observer(), quick=not full).as_dict())
        now = read_metrics(walked)
    rows = compare(stored, now, leave_out=() if full else LONG_MEASURES)
    inputs = inputs_in_words(changed_inputs(folder, now))
    return rows, inputs


def _is_full(config: pytest.Config) -> bool:
    """Whether the long walks and the pushes are measured, too."""
    return bool(config.getoption("--gaitval-full"))


def _names(row: "Row | Measure") -> set[str]:
    """What a row is chosen by: its measure, and its target with and without the side."""
    return {row.measure, row.target, row.target.removesuffix("_r").removesuffix("_l")}


def _check_quantities(folder: Path, quantities: Sequence[str] | None, *, full: bool) -> None:
    """Raise ArtefactError unless every one of the `quantities` is compared, of a `full` walk or a
    short one: a test that compares nothing would pass whatever was lost.
    """
    from gaitval.apps.regression.baseline import stored_metrics
    from gaitval.apps.regression.regression import LONG_MEASURES
    from gaitval.errors import ArtefactError
    from gaitval.study.inputs import METRICS

    measures = stored_metrics(folder / METRICS).measures
    if quantities is None:
        return
    if not quantities:
        raise ArtefactError(
            "gaitval_check: quantities is empty, so nothing would be compared; name at least one, "
            "or leave it out for all."
        )
    known = sorted(set().union(*map(_names, measures)))
    for wanted in quantities:
        if wanted not in known:
            near = difflib.get_close_matches(wanted, known, n=3)
            raise ArtefactError(
                f"gaitval_check: no quantity {wanted!r} among the measures of this baseline"
                + (f"; did you mean {' or '.join(near)}?" if near else f": {', '.join(known)}.")
            )
    short = set().union(*(_names(row) for row in measures if row.measure not in LONG_MEASURES))
    left_out = [wanted for wanted in quantities if wanted not in short]
    if left_out and not full:
        raise ArtefactError(
            f"gaitval_check: {', '.join(left_out)} is only measured with --gaitval-full, so it "
            "would not be compared. Run pytest with --gaitval-full, or leave it out of quantities."
        )


def _line(row: "Row") -> str:
    values = ["not measured" if v is None else f"{v:.4g}" for v in (row.baseline, row.current)]
    return (
        f"{row.measure} of {row.target}: {values[0]} → {values[1]} {row.unit} (margin "
        f"{row.margin:g}): {row.change}"
    )
