"""Damaged files of every kind, through the whole import or the first stage that uses them: each is
refused in words, changes nothing, or is reported. `tests/robustness/fuzz.py` runs more of them."""

import os
import sys

import fuzz_cases
import fuzz_commands
import numpy as np
import pytest
from fuzz import BAD, FIRST, Case, Worker, cases, merged, replaced, run_case
from fuzz_mutators import MOT

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not sys.platform.startswith("linux"), reason="the limits of a case are those of Linux"
    ),
]


FIRST_CASES, FURTHER_CASES = (150, 900) if os.environ.get("GAITVAL_FUZZ") else (75, 450)
"""What CI has time for; with GAITVAL_FUZZ twice as many, and every night some hours of others
(`fuzz.py --nightly`)."""


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    return fuzz_cases.kinds(tmp_path_factory.mktemp("files"))


@pytest.fixture(scope="module")
def worker(kinds):
    made = Worker(kinds)
    yield made
    made.close()


def test_no_damaged_file_ends_in_a_fault_or_is_taken_without_a_word(worker):
    found = list(cases(worker, FIRST_CASES, 20_000))
    bad = [case for case in found if case.outcome in BAD]
    assert not bad, "\n".join(f"--replay {case.kind}:{case.seed}: {case.why}" for case in bad)
    assert {case.kind for case in found} == set(worker.kinds)
    assert {"refused", "equal"} <= {case.outcome for case in found}


@pytest.fixture(scope="module")
def commands(tmp_path_factory):
    """The further kinds, but for those of which a case takes seconds."""
    made = fuzz_commands.kinds(tmp_path_factory.mktemp("further"))
    return {name: each for name, each in made.items() if name not in fuzz_commands.SLOW}


def test_no_damaged_file_ends_a_command_in_a_fault(commands):
    worker = Worker(commands)
    try:
        found = list(cases(worker, FURTHER_CASES, 50_000))
    finally:
        worker.close()
    bad = [case for case in found if case.outcome in BAD]
    assert not bad, "\n".join(f"--replay {case.kind}:{case.seed}: {case.why}" for case in bad)
    assert {case.kind for case in found} == set(commands)
    assert {"refused", "another input"} <= {case.outcome for case in found}


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        *("people_csv:60000", "archive:4300030", "archive:4300056", "training_log:4300011"),
        *("cohort_csv:4700229", "cohort_toml:4700163", "recording_npz:4700035"),
    ],
)
def test_what_once_was_a_fault_is_none(commands, tmp_path, case):
    """An age that is not known, a place before a file's beginning, a name of 300 letters, zeros,
    a mass that is no number, a virtual person numbered by a list, markers of another shape."""
    kind, _, seed = case.partition(":")
    found = run_case(kind, int(seed), commands[kind], fuzz_cases.Result(), tmp_path)
    assert found.outcome not in BAD, found


def test_the_kinds_are_named_as_they_are(kinds, commands):
    assert set(kinds) == set(FIRST)
    assert not set(commands) & set(FIRST)
    assert len(kinds) + len(commands) + len(fuzz_commands.SLOW) >= 18


@pytest.mark.slow
def test_a_command_that_is_no_more_is_no_refusal(tmp_path):
    """Else what proves nothing would count as refused."""
    with pytest.raises(Exception, match="No such command") as raised:
        fuzz_commands.command("nothing", tmp_path)
    assert not isinstance(raised.value, fuzz_commands.Refused)


@pytest.mark.parametrize(("text", "why"), [("[NaN]", "NaN"), ("[1, -Infinity]", "Infinity")])
def test_what_is_no_number_in_results_is_seen(tmp_path, text, why):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(fuzz_cases.SilentNonsense, match=why):
        fuzz_commands.looked_over(tmp_path)


def test_a_case_is_made_again_from_its_seed(kinds):
    for kind, made in kinds.items():
        assert fuzz_cases.damaged(kind, made, 7) == fuzz_cases.damaged(kind, made, 7)
        assert len({fuzz_cases.damaged(kind, made, seed) for seed in range(20)}) > 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "mutator", "words"),
    [
        ("wbds:3", "frozen", "stuck channel"),
        ("c3d_walking:6", "c3d_channels", "stuck channel"),
        ("trc:43", "clipped", "stuck coordinate"),
        ("trc:90", "noisy", "noise"),
        ("c3d_standing:163", "c3d_points", "height of a foot's marker"),
    ],
)
def test_what_once_went_through_without_a_word_is_told(worker, case, mutator, words):
    kind, _, seed = case.partition(":")
    found = worker.run(kind, int(seed))
    assert (found.mutator, found.outcome) == (mutator, "told"), found
    assert words in found.why


def _force_that_is_silent_in_mid_stance(data: bytes, _: np.random.Generator) -> bytes:
    table = MOT.read(data)
    columns = [table.head[-1].split("\t").index(f"ground_force_l_v{axis}") for axis in "xyz"]
    loaded = np.flatnonzero(table.values[:, columns[1]] > 0.0)
    begin = next(i for i in loaded if i > 10 and table.values[i - 1, columns[1]] == 0.0)
    values = table.values.copy()
    values[begin + 60 : begin + 105, columns] = 0.0
    return MOT.write(type(table)(table.head, values, table.clock))


def test_a_plate_that_is_silent_in_mid_stance_is_told_of(kinds, worker, tmp_path):
    made = kinds["mot"]
    (name,) = made.files
    silent = fuzz_cases.Kind(made.seeds, {name: (_force_that_is_silent_in_mid_stance,)}, made.run)
    case = run_case("mot", 0, silent, worker.results["mot"], tmp_path)
    assert case.outcome in ("told", "refused"), case
    assert "motion" in case.why


def test_figures_are_replaced_seed_by_seed():
    def found(first, last, outcome):
        return [Case("trc", n, "walk.trc", "cut", outcome, "", {}, 1.0) for n in range(first, last)]

    stored = {}
    merged(stored, found(0, 10, "silent"))
    merged(stored, found(20, 25, "refused"))
    merged(stored, found(0, 12, "told"))
    assert [(run["seeds"], run["outcomes"], run["bad"]) for run in stored["trc"]] == [
        ([0, 11], {"told": 12}, []),
        ([20, 24], {"refused": 5}, []),
    ]
    with pytest.raises(SystemExit, match=r"a part of \[0, 11\]"):
        merged(stored, found(0, 5, "told"))


def test_a_bad_case_is_replaced_by_what_it_is_now():
    def case(seed, outcome):
        return Case("trc", seed, "walk.trc", "cut", outcome, "", {}, 1.0)

    stored = {}
    merged(stored, [case(0, "silent"), case(1, "told"), case(2, "silent")])
    replaced(stored, [case(0, "told"), case(2, "fault")])
    (run,) = stored["trc"]
    assert run["outcomes"] == {"fault": 1, "told": 2}
    assert [(bad["seed"], bad["outcome"]) for bad in run["bad"]] == [(2, "fault")]
    assert [(one["seed"], one["was"]) for one in run["mended"]] == [(0, "silent")]
    with pytest.raises(SystemExit, match="trc:1 is not among the bad cases"):
        replaced(stored, [case(1, "refused")])


@pytest.mark.parametrize("wrong", ["raises", "nonsense", "dies"])
def test_what_goes_wrong_is_seen(kinds, wrong):
    """Else the first test proves nothing."""

    def run(folder):
        if (folder / "model.urdf").read_bytes() == kinds["urdf"].seeds["model.urdf"]:
            return fuzz_cases.Result()
        if wrong == "raises":
            raise KeyError("link")
        if wrong == "dies":
            os._exit(3)
        raise fuzz_cases.SilentNonsense("mass: -1")

    kind = fuzz_cases.Kind(kinds["urdf"].seeds, kinds["urdf"].files, run)
    broken = Worker({"urdf": kind})
    try:
        assert broken.run("urdf", 1).outcome == ("silent" if wrong == "nonsense" else "fault")
        assert broken.run("urdf", 2).outcome in BAD  # the process is there again
    finally:
        broken.close()
