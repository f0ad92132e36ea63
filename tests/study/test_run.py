"""Stages run only when what they depend on has changed, and survive a kill at any moment."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from simulation_fixtures import random_policy

from gaitval._internal.io.artefacts import read_json, write_json, write_text
from gaitval.apps.regression.baseline import (
    WALKING,
    installed_versions,
)
from gaitval.cli.study import STAGE_NAMES
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError, ConfigurationError, PolicyError
from gaitval.metrics.learning_gain import LearningGain, Standing
from gaitval.metrics.tolerances import limits_text
from gaitval.model.parameters import PARAMETERS
from gaitval.model.urdf import model_hash, write_urdf
from gaitval.policy.storage import save_policy
from gaitval.quantities import QUANTITIES
from gaitval.scaling.scaling import scale_subject
from gaitval.study import body_stage, one_stage
from gaitval.study import run as study
from gaitval.study import stage as stage_module
from gaitval.study.identification_stages import choose_stage, identify_stage
from gaitval.study.inputs import STORED_FILES, start_from
from gaitval.study.learning_stages import learned, train_stage
from gaitval.study.one_stage import finished_rounds, run_one
from gaitval.study.run import plan, run_subject
from gaitval.study.stage import Observer, Run, Stage, fingerprint, open_run, run_stage, why_run
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.study.stored_policy import stored_baseline
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.simulation.walker import WalkingTask

STAGES = (*STAGE_NAMES, "report")
"""Those that a command runs alone, in their order."""

FOUND = {
    "names": PARAMETERS,
    **{
        name: [0.5] * len(PARAMETERS)
        for name in (
            *("nominal", "identified", "prior_standard_deviation", "posterior_mean"),
            *("standard_deviation", "lower", "upper"),
        )
    },
    "on_bound": [False] * len(PARAMETERS),
    "verdicts": ["weak"] * len(PARAMETERS),
    "correlation": [[0.5] * len(PARAMETERS)] * len(PARAMETERS),
    "combinations": [],
    "plates": [0.0, 0.0],
    "deviance_nominal": 2.0,
    "deviance_identified": 1.0,
    "converged": True,
    "search_distance": 0.1,
    "history": [],
}
"""An identification, as its stage writes it."""


class Listener(Observer):
    """Keeps what it hears."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.reasons: dict[str, str] = {}
        self.lines: list[str] = []

    def started(self, stage: str, reason: str) -> None:
        self.ran.append(stage)
        self.reasons[stage] = reason

    def say(self, message: str) -> None:
        self.lines.append(message)


def doubling(folder: Path, version: int = 1, **values: int) -> Stage:
    """A stage that writes twice the number in `number.txt`."""

    def double() -> None:
        number = int((folder / "number.txt").read_text())
        write_text(folder / "double.txt", str(2 * number))

    return Stage("double", double, version, ("number.txt",), ("double.txt",), values=values)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_text(tmp_path / "number.txt", "21")
    write_json(tmp_path / "provenance.json", {"stages": {}})
    return tmp_path


def test_a_stage_is_skipped_when_nothing_changed(folder: Path) -> None:
    assert run_stage(doubling(folder), folder)
    assert (folder / "double.txt").read_text() == "42"
    assert not run_stage(doubling(folder), folder)
    assert why_run(doubling(folder), folder) is None


def test_a_changed_input_file_runs_the_stage_and_is_named(folder: Path) -> None:
    run_stage(doubling(folder), folder)
    write_text(folder / "number.txt", "4")
    assert why_run(doubling(folder), folder) == "number.txt changed"
    assert run_stage(doubling(folder), folder)
    assert (folder / "double.txt").read_text() == "8"


def test_a_stage_of_another_version_runs_again(folder: Path) -> None:
    run_stage(doubling(folder, version=2), folder)
    assert why_run(doubling(folder, version=2), folder) is None
    reason = "made by version 2 of double, which is at version 3 now"
    assert why_run(doubling(folder, version=3), folder) == reason
    assert run_stage(doubling(folder, version=3), folder)
    assert why_run(doubling(folder, version=3), folder) is None


def test_a_stage_depends_on_its_values_and_files_and_on_nothing_else(folder: Path) -> None:
    """Not on gaitval's version: a release runs nothing again."""
    assert {*fingerprint(doubling(folder, seed=1), folder)} == {"seed", "number.txt"}


def test_a_file_is_read_once_while_nobody_writes_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And again after any change, also of equal length in place."""
    run_stage(doubling(folder), folder)
    read: list[str] = []
    hashed = stage_module.file_hash
    monkeypatch.setattr(
        stage_module, "file_hash", lambda path: (read.append(path.name), hashed(path))[1]
    )
    monkeypatch.setattr(stage_module, "_SETTLED", -1)  # as if long ago
    assert why_run(doubling(folder), folder) is None
    first = len(read)
    assert why_run(doubling(folder), folder) is None
    assert len(read) == first
    time.sleep(0.02)
    (folder / "number.txt").write_text("42")
    assert why_run(doubling(folder), folder) == "number.txt changed"
    monkeypatch.setattr(stage_module, "_SETTLED", 1 << 62)  # as if all were just written
    before = len(read)
    for _ in range(2):
        assert why_run(doubling(folder), folder) == "number.txt changed"
    assert len(read) == before + 2


def test_a_changed_setting_runs_the_stage_and_is_named(folder: Path) -> None:
    run_stage(doubling(folder, seed=0), folder)
    assert why_run(doubling(folder, seed=1), folder) == "seed changed"


@pytest.mark.parametrize("damage", [lambda path: path.unlink(), lambda path: path.write_text("4")])
def test_a_missing_or_damaged_output_runs_the_stage(
    folder: Path, damage: Callable[[Path], None]
) -> None:
    run_stage(doubling(folder), folder)
    damage(folder / "double.txt")
    assert "double.txt" in (why_run(doubling(folder), folder) or "")
    assert run_stage(doubling(folder), folder)
    assert (folder / "double.txt").read_text() == "42"


def test_force_runs_a_stage_that_is_up_to_date(folder: Path) -> None:
    run_stage(doubling(folder), folder)
    assert run_stage(doubling(folder), folder, force=True)


def test_a_missing_input_is_an_error_that_says_what_to_run(folder: Path) -> None:
    (folder / "number.txt").unlink()
    with pytest.raises(ArtefactError, match=r"number\.txt: no such file.*Run the stage"):
        run_stage(doubling(folder), folder)


def test_damaged_records_are_an_error_that_says_how_to_mend(folder: Path) -> None:
    write_text(folder / "stages.json", '{"double": ')
    with pytest.raises(ArtefactError, match=r"stages\.json: cannot be read.*Delete it"):
        run_stage(doubling(folder), folder)


def test_a_failed_stage_is_not_taken_for_finished(folder: Path) -> None:
    run_stage(doubling(folder), folder)
    write_text(folder / "number.txt", "no number")
    with pytest.raises(ValueError, match="no number"):
        run_stage(doubling(folder), folder)
    assert (folder / "double.txt").read_text() == "42"
    assert why_run(doubling(folder), folder) == "was interrupted"


def counting(folder: Path, *, until: int, stop_at: int, seed: int = 0, version: int = 1) -> Stage:
    """Counts in its workspace, a file a number; interrupted at `stop_at`."""

    def count() -> None:
        while (done := len(list((folder / "work").glob("*")))) < until:
            if done == stop_at:
                raise KeyboardInterrupt
            write_text(folder / "work" / str(done), "")
            seen.append(done)
        write_text(folder / "count.txt", str(until))

    seen: list[int] = []
    stage = Stage("count", count, version, (), ("count.txt",), {"seed": seed}, workspace="work")
    counting.seen = seen  # type: ignore[attr-defined]
    return stage


def test_an_interrupted_stage_resumes_where_it_was(folder: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_stage(counting(folder, until=6, stop_at=4), folder)
    run_stage(counting(folder, until=6, stop_at=-1), folder)
    assert counting.seen == [4, 5]  # type: ignore[attr-defined]
    assert (folder / "count.txt").read_text() == "6"


@pytest.mark.parametrize(("seed", "version", "force"), [(1, 1, False), (0, 2, False), (0, 1, True)])
def test_work_of_other_inputs_or_of_another_version_is_not_resumed(
    folder: Path, seed: int, version: int, force: bool
) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_stage(counting(folder, until=6, stop_at=4), folder)
    stage = counting(folder, until=6, stop_at=-1, seed=seed, version=version)
    run_stage(stage, folder, force=force)
    assert counting.seen == [0, 1, 2, 3, 4, 5]  # type: ignore[attr-defined]


KILLED = """
import os, sys
from pathlib import Path
from gaitval._internal.io.artefacts import replacing
from gaitval.study.stage import Stage, run_stage

folder = Path(sys.argv[1])

def die() -> None:
    with replacing(folder / "double.txt") as temporary:
        temporary.write_text("half of a nu")
        os._exit(9)

run_stage(Stage("double", die, 1, ("number.txt",), ("double.txt",)), folder, force=True)
"""


def test_kill_while_writing_leaves_the_old_output_and_runs_again(folder: Path) -> None:
    run_stage(doubling(folder), folder)
    ended = subprocess.run([sys.executable, "-c", KILLED, str(folder)], check=False)
    assert ended.returncode == 9
    assert (folder / "double.txt").read_text() == "42"
    assert why_run(doubling(folder), folder) == "was interrupted"
    assert run_stage(doubling(folder), folder)


def test_a_stage_whose_times_could_not_be_written_runs_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else they would be missing for good: a stage that has ended is not run again."""
    written = stage_module.write_json

    def failing(path: Path, *values: object) -> None:
        if path.name == "provenance.json":
            raise ArtefactError(f"{path}: cannot be written")
        written(path, *values)

    monkeypatch.setattr(stage_module, "write_json", failing)
    with pytest.raises(ArtefactError, match="cannot be written"):
        run_stage(doubling(folder), folder)
    monkeypatch.undo()
    assert run_stage(doubling(folder), folder)
    assert "double" in read_json(folder / "provenance.json")["stages"]


def test_times_are_in_the_provenance_only(folder: Path) -> None:
    run_stage(doubling(folder), folder)
    provenance = json.loads((folder / "provenance.json").read_text())
    assert {"started", "finished", "seconds", "inputs"} == set(provenance["stages"]["double"])
    assert provenance["versions"]["gaitval"]
    before = (folder / "stages.json").read_bytes()
    run_stage(doubling(folder), folder, force=True)
    assert (folder / "stages.json").read_bytes() == before


# --- the stages of a subject, with fast stand-ins for what they run -----------------------

Opener = Callable[..., Run]


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Opener]:
    """Opens `tmp_path/run` for subject 5 with some settings, as often as wanted."""
    contexts = []

    def opener(*settings: str) -> Run:
        while contexts:
            contexts.pop().__exit__(None, None, None)
        context = open_run(
            load_subject("5"),
            load_configuration(settings=settings),
            tmp_path / "run",
            Listener(),
        )
        contexts.append(context)
        return context.__enter__()

    def leave() -> None:
        while contexts:
            contexts.pop().__exit__(None, None, None)

    opener.leave = leave  # type: ignore[attr-defined]
    yield opener
    leave()


@contextmanager
def at_once(function: Callable[..., float], *arguments: object) -> Iterator[Callable[[], float]]:
    """`beside`, in this process, where stand-ins are known."""
    yield partial(function, *arguments)


def parts_of(total: float | None) -> dict[str, float] | None:
    if total is None:
        return None
    return {"angles": 0.0, "moments": 0.0, "forces": total, "total": total}


def standing(falls: int = 0, survived: int = 96) -> Standing:
    return Standing(
        walks=8, falls=falls, pushes=96, survived=survived, epsilon=1.0, scatter=0.1,
        weakest_phase=100.0 * survived / 96,
    )  # fmt: skip


def gain_of(
    samples: int, start: Standing | None = None, trained: Standing | None = None
) -> LearningGain:
    """Of a training of so many samples; a start that is not given survives a push less."""
    return LearningGain.of(samples, start or standing(survived=95), trained or standing())


@pytest.fixture
def stand_ins(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """Every stage but the choice of a round writes its name.

    The list is epsilon by round, None where the walk fell.
    """
    epsilons: list[float | None] = [3.0, 2.0, 2.5, 1.5]

    def stand_in_of(real: Callable[..., Stage]) -> Callable[..., Stage]:
        def stage(run: Run, *numbers: int) -> Stage:
            original: Stage = real(run, *numbers)

            def write() -> None:
                for output in original.outputs:
                    if output.endswith("epsilon.json"):
                        error = parts_of(epsilons[numbers[0] - 1])
                        written = {"nominal": None, "identified": error, "floor": 1.0}
                        write_json(run.folder / output, {**written, "scatter": 0.1})
                    elif output.endswith("identification.json"):
                        write_json(run.folder / output, FOUND)
                    elif output.endswith("gain.json"):
                        write_json(run.folder / output, gain_of(20).as_dict())
                    elif output.endswith("training.csv"):
                        rows = "samples,wall_seconds,cycles\n10,1.5,2\n20,3.0,4\n"
                        write_text(run.folder / output, rows)
                    else:
                        about = {"stage": original.name, "values": original.values, "measures": []}
                        write_text(run.folder / output, json.dumps(about))

            return replace(original, run=write)

        return stage

    def stand_in(name: str) -> None:
        stage = stand_in_of(getattr(study, name))
        for module in (study, one_stage):
            monkeypatch.setattr(module, name, stage, raising=module is study)

    for name in (*STAGES, "need", "hand_on", "evaluate", "repeat"):
        stand_in(f"{name}_stage")
    monkeypatch.setattr("gaitval.study.body_stage.stage", stand_in_of(body_stage.stage))
    monkeypatch.setattr("gaitval.policy.beside.beside", at_once)
    monkeypatch.setattr(study, "general_policy", lambda *_: None)
    return epsilons


def ran(run: Run) -> list[str]:
    assert isinstance(run.observer, Listener)
    return run.observer.ran


def test_the_stored_policy_is_found_whatever_the_run_folder_is_called(tmp_path: Path) -> None:
    found = stored_baseline(tmp_path / "mine", "S05")
    assert found is not None
    assert found.parts[-3:] == ("reports", "S05", "baseline")
    assert stored_baseline(tmp_path / "S05", "someone") is None
    write_json(tmp_path / "mine" / "baseline" / "metrics.json", {})
    assert stored_baseline(tmp_path / "mine", "S05") == tmp_path / "mine" / "baseline"


def test_main_job_runs_every_stage_once_and_then_none(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=2")
    run_subject(run)
    assert ran(run) == [
        "scale",
        "reference",
        "need-1",
        "train-1",
        "identify-1",
        "keep-1",
        "evaluate-1",
        "need-2",
        "train-2",
        "identify-2",
        "keep-2",
        "evaluate-2",
        "choose",
        "correct",
        "simulate",
        "repeat",
        "body",
        "push",
        "validate",
        "report",
    ]
    again = opened("identification.rounds=2")
    run_subject(again)
    assert ran(again) == []


def test_both_stages_of_a_first_round_that_is_interrupted_run_again(
    opened: Opener, stand_ins: list[float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = opened("training.workers=2")
    whole = study.train_stage

    def interrupted(run: Run, round_number: int) -> Stage:
        def interrupt() -> None:
            raise KeyboardInterrupt

        return replace(whole(run, round_number), run=interrupt)

    monkeypatch.setattr(study, "train_stage", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_subject(run)
    monkeypatch.setattr(study, "train_stage", whole)
    assert read_json(run.folder / "stages.json")["identify-1"]["outputs"] is None
    again = opened("training.workers=2")
    run_subject(again)
    assert isinstance(again.observer, Listener)
    assert "identify-1: runs beside need-1 (was interrupted)" in messages(again)
    assert again.observer.ran[:2] == ["train-1", "identify-1"]
    assert all(each["outputs"] for each in read_json(run.folder / "stages.json").values())


def test_algorithm_1_ends_below_kappa(opened: Opener, stand_ins: list[float | None]) -> None:
    run = opened("identification.rounds=4", "identification.kappa=2.2")
    run_subject(run)
    assert finished_rounds(run) == 2
    identification = json.loads((run.folder / "identification.json").read_text())
    rounds = [(each["round"], each["epsilon"]["total"]) for each in identification["rounds"]]
    assert rounds == [(1, 3.0), (2, 2.0)]


def test_algorithm_1_ends_when_a_round_gains_less_than_walks_differ(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    stand_ins[:] = [3.0, 2.0, 1.95, 1.0]
    run = opened("identification.rounds=4", "identification.kappa=0.1")
    run_subject(run)
    assert finished_rounds(run) == 3
    assert json.loads((run.folder / "identification.json").read_text())["chosen_round"] == 3


def test_a_round_after_a_fall_counts_as_a_gain(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    stand_ins[:] = [None, 2.0, 1.0, 0.5]
    run = opened("identification.rounds=3", "identification.kappa=0.1")
    run_subject(run)
    assert finished_rounds(run) == 3


def test_the_round_with_the_smallest_epsilon_is_chosen(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=3", "identification.kappa=0.1")
    run_subject(run)
    assert "keep-2" in (run.folder / "policy" / "policy.json").read_text()
    identification = json.loads((run.folder / "identification.json").read_text())
    assert identification["chosen_round"] == 2
    assert identification["epsilon_identified"]["total"] == 2.0


def test_the_log_goes_on_over_the_rounds(opened: Opener, stand_ins: list[float | None]) -> None:
    stand_ins[:] = [3.0, 2.0]
    run = opened("identification.rounds=2")
    run_subject(run)
    assert (run.folder / "policy" / "training.csv").read_text().splitlines() == [
        "samples,wall_seconds,cycles",
        "10,1.5,2",
        "20,3.0,4",
        "30,4.5,2",
        "40,6.0,4",
    ]


def test_where_nothing_was_learned_another_round_is_not_tried(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=3", "identification.kappa=0.1")
    run_subject(run)
    gain = run.folder / "rounds/1/policy/gain.json"
    assert not study.algorithm_1_ends(run, 1)[0]
    write_json(gain, gain_of(0).as_dict())
    done, why = study.algorithm_1_ends(run, 1)
    assert done
    assert "nothing was learned" in why


def test_who_still_falls_or_is_pushed_over_learns_on_while_that_helps(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    """However near the walk is to its reference."""
    run = opened("identification.rounds=2", "identification.kappa=9.0")
    run_subject(run)
    assert finished_rounds(run) == 1
    few, more = standing(survived=10), standing(survived=20)
    for gain, rounds, ends, words in (
        (gain_of(20, few, more), 1, False, "still needs training"),
        (gain_of(20, few, few), 1, False, "still needs training"),
        (gain_of(20, more, few), 1, True, "did not help"),
        (gain_of(20, standing(falls=2), standing(falls=1)), 1, False, "still needs training"),
        (gain_of(20, few, standing()), 1, True, "kappa"),
    ):
        write_json(run.folder / f"rounds/{rounds}/policy/gain.json", gain.as_dict())
        done, why = study.algorithm_1_ends(run, rounds)
        assert (done, words in why) == (ends, True), why


def test_a_round_that_lacks_less_is_chosen_before_one_that_is_nearer(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=2")
    run_subject(run)
    few, more = standing(survived=10), standing(survived=60)

    def chosen(*rounds: tuple[LearningGain, float]) -> int:
        for number, (gain, total) in enumerate(rounds, start=1):
            folder = run.folder / f"rounds/{number}"
            write_json(folder / "policy/gain.json", gain.as_dict())
            errors = read_json(folder / "epsilon.json")
            write_json(folder / "epsilon.json", errors | {"identified": parts_of(total)})
        choose_stage(run, len(rounds)).run()
        found = json.loads((run.folder / "identification.json").read_text())
        return int(found["chosen_round"])

    assert chosen((gain_of(20, few, more), 1.0), (gain_of(20, more), 2.0)) == 2
    assert chosen((gain_of(20, few, more), 1.0), (gain_of(20, more, few), 2.0)) == 1
    # who stands as many as acceptance asks for lacks nothing
    assert chosen((gain_of(20), 2.0), (gain_of(20, None, standing(survived=90)), 1.0)) == 2
    assert chosen((gain_of(20), 1.0), (gain_of(20), 1.0)) == 2
    # a round that trained nothing walks with the policy of the one before
    untrained = LearningGain.none_needed(standing(), 80.0)
    assert chosen((gain_of(20), 1.0), (untrained, 1.0)) == 1


def test_a_round_that_fell_is_the_last_to_be_chosen(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    stand_ins[0] = None
    run = opened("identification.rounds=2")
    run_subject(run)
    assert json.loads((run.folder / "identification.json").read_text())["chosen_round"] == 2


def test_more_rounds_keep_the_finished_ones(opened: Opener, stand_ins: list[float | None]) -> None:
    run_subject(opened("identification.rounds=1", "identification.kappa=0.1"))
    more = opened("identification.rounds=2", "identification.kappa=0.1")
    run_subject(more)
    assert ran(more)[:4] == ["need-2", "train-2", "identify-2", "keep-2"]


@pytest.mark.parametrize(
    ("setting", "first"),
    [
        ("validation.filter_frequency=12", "need-1"),
        ("correction.steps=2", "correct"),
        ("validation.cycles=30", "need-1"),
        ("validation.consecutive_cycles=30", "correct"),
        ("pushes.force=200", "need-1"),
        ("identification.generations=3", "identify-1"),
        ("training.learning_rate=1e-4", "train-1"),
        ("contact.dissipation=1.0", "reference"),
    ],
)
def test_a_setting_runs_only_the_stages_that_it_concerns(
    opened: Opener, stand_ins: list[float | None], setting: str, first: str
) -> None:
    run_subject(opened("identification.rounds=1"))
    changed = opened("identification.rounds=1", setting)
    run_subject(changed)
    assert ran(changed)[0] == first


@pytest.mark.parametrize(
    ("name", "identifier", "folder", "command"),
    [
        ("scale", "S05", "reports/S05", "gaitval stage scale S05"),
        ("train-2", "S05", "reports/S05", "gaitval stage train S05 --round 2"),
        ("scale", "S05", "my runs", "gaitval stage scale S05 --out 'my runs'"),
        ("scale", "me", "reports/me", "gaitval stage scale me.toml"),
    ],
)
def test_the_command_of_a_stage_names_the_run(
    name: str, identifier: str, folder: str, command: str
) -> None:
    subject = load_subject("5").model_copy(update={"identifier": identifier})
    stage = Stage(name, lambda: None, 1, (), ())
    assert stage.command(Run(Path(folder), subject, load_configuration())) == command


def test_a_command_that_is_refused_changes_nothing(
    opened: Opener, stand_ins: list[float | None], tmp_path: Path
) -> None:
    run = opened("identification.rounds=1")
    run_subject(run)

    def files() -> dict[Path, bytes]:
        found = (path for path in run.folder.rglob("[!.]*") if path.is_file())
        return {path: path.read_bytes() for path in found}

    before = files()
    opened.leave()  # type: ignore[attr-defined]
    other = load_configuration(settings=("identification.rounds=1", "seed=7"))
    seed = r"validate depends on train-1.*seed changed.*`gaitval stage train S05 --out"
    for folder, why in ((run.folder, seed), (tmp_path / "new", "validate depends on scale")):
        with (
            pytest.raises(ArtefactError, match=why),
            open_run(run.subject, other, folder, Observer()) as refused,
        ):
            run_one(refused, "validate")
    assert files() == before
    assert not list((tmp_path / "new").glob("[!.]*"))


def test_what_a_short_stage_has_lost_is_made_again_and_not_refused(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=1")
    run_subject(run)
    lost = run.folder / "identification.json"  # of `choose`, and an input of `correct`
    content = lost.read_bytes()
    lost.unlink()
    run_one(run, "validate")
    assert lost.read_bytes() == content


def test_stages_one_by_one_give_what_the_main_job_gives(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=1")
    for name in STAGES:
        run_one(run, name)
    again = opened("identification.rounds=1")
    run_subject(again)
    assert ran(again) == []


def test_identification_needs_no_training(opened: Opener, stand_ins: list[float | None]) -> None:
    run = opened("identification.rounds=1")
    for name in ("scale", "reference", "identify"):
        run_one(run, name)
    assert ran(run) == ["scale", "reference", "need-1", "identify-1"]


def test_force_of_one_stage_runs_it_alone(opened: Opener, stand_ins: list[float | None]) -> None:
    run_subject(opened("identification.rounds=1"))
    run = opened("identification.rounds=1")
    run_one(run, "report", force=True)
    assert ran(run) == ["report"]


def test_scratch_trains_again_after_a_start_from_a_stored_policy(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("identification.rounds=1")
    write_text(run.folder / "start" / "policy.safetensors", "weights")
    write_text(run.folder / "start" / "policy.json", "{}")
    for name in ("scale", "reference"):
        run_one(run, name)
    run_stage(study.train_stage(run, 1), run.folder)
    run_subject(run)
    assert ran(run).count("train-1") == 0  # the start it was trained from is kept
    run_subject(run, scratch=True)
    assert ran(run).count("train-1") == 1
    assert not (run.folder / "start").exists()


def hold(folder: Path) -> None:
    with open_run(load_subject("5"), load_configuration(), folder, Observer()):
        pass


def test_two_runs_do_not_share_a_folder(opened: Opener, tmp_path: Path) -> None:
    opened()
    taken = rf"another gaitval \(process {os.getpid()}\) is running in this folder"
    with pytest.raises(ArtefactError, match=taken):
        hold(tmp_path / "run")


HOLDING = """
import sys
import time
from pathlib import Path
from gaitval.configuration import load_configuration
from gaitval.subjects.subject_file import load_subject
from gaitval.study.stage import Observer, open_run

with open_run(load_subject("5"), load_configuration(), Path(sys.argv[1]), Observer()):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_killed_run_leaves_its_folder_free(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDING, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        try:
            assert other.stdout is not None
            assert other.stdout.readline() == "held\n"
            with pytest.raises(ArtefactError, match=rf"\(process {other.pid}\) is running in this"):
                hold(tmp_path)
        finally:
            other.kill()
    hold(tmp_path)
    assert not (tmp_path / ".process").exists()


@pytest.mark.skipif(
    not hasattr(os, "O_NOFOLLOW"), reason="links are followed here: there is no O_NOFOLLOW"
)
def test_a_link_in_the_place_of_the_lock_is_not_followed(tmp_path: Path) -> None:
    theirs = tmp_path / "theirs.txt"
    theirs.write_text("theirs")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / ".lock").symlink_to(theirs)
    with pytest.raises(ArtefactError, match=r"\.lock: cannot be locked .* must be a plain file"):
        hold(tmp_path / "run")
    assert theirs.read_text() == "theirs"


WITHOUT_POSIX = """
import sys
import time

for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
import multiprocessing
import os

del os.sched_getaffinity, os.fork
assert "spawn" in multiprocessing.get_all_start_methods()
import gaitval.cli

gaitval.cli.main()
"""


@pytest.mark.slow
def test_stages_run_without_what_posix_alone_has(tmp_path: Path) -> None:
    """As on Windows, as far as that can be had here; the lock is then filelock's of files."""
    folder = tmp_path / "run"
    command = [sys.executable, "-c", WITHOUT_POSIX, "stage", "scale", "5", "--out", str(folder)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (folder / "model.urdf").exists()


def test_every_stage_reads_only_what_earlier_stages_write(opened: Opener) -> None:
    run = opened("identification.rounds=2")
    written = {"subject.toml", "configuration.toml"}
    for stage in plan(run, 2):
        assert set(stage.inputs) <= written, stage.name
        written |= set(stage.outputs)
    assert set(STORED_FILES) <= written


def test_every_stage_has_the_version_of_its_name(opened: Opener) -> None:
    """In every round, so that raising one number is enough."""
    versions = {stage.name: stage.version for stage in plan(opened(), 2)}
    assert versions == {name: STAGE_VERSIONS[name.partition("-")[0]] for name in versions}
    assert installed_versions() == {name: versions[name] for name in WALKING}


def new_sentence(patch: pytest.MonkeyPatch) -> None:
    text = limits_text() + "# another sentence\n"
    patch.setattr("gaitval.metrics.tolerances.limits_text", lambda: text)


def new_quantity(patch: pytest.MonkeyPatch) -> None:
    another = replace(QUANTITIES[0], name="another")
    patch.setattr("gaitval.quantities.QUANTITIES", (*QUANTITIES, another))


def new_push_limit(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("gaitval.metrics.tolerances.push_limit", lambda: 12.0)


def new_version(patch: pytest.MonkeyPatch) -> None:
    patch.setitem(STAGE_VERSIONS, "identify", STAGE_VERSIONS["identify"] + 1)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "stages"),
    [
        (new_sentence, ["validate"]),
        (new_quantity, ["validate"]),
        (new_push_limit, ["need-1", "keep-1", "choose"]),
        (new_version, ["identify-1"]),
    ],
)
def test_a_change_of_gaitval_makes_those_stages_invalid_that_depend_on_it(
    opened: Opener,
    stand_ins: list[float | None],
    monkeypatch: pytest.MonkeyPatch,
    change: Callable[[pytest.MonkeyPatch], None],
    stages: list[str],
) -> None:
    """Stages after them run again if their files differ."""
    run = opened("identification.rounds=1")
    run_subject(run)

    def invalid() -> list[str]:
        return [each.name for each in plan(run, 1) if why_run(each, run.folder) is not None]

    assert invalid() == []
    change(monkeypatch)
    assert invalid() == stages


def test_provenance_names_versions_seed_and_hashes(
    opened: Opener, stand_ins: list[float | None]
) -> None:
    run = opened("seed=3", "identification.rounds=1")
    run_subject(run)
    provenance = json.loads((run.folder / "provenance.json").read_text())
    assert provenance["seed"] == 3
    assert {"gaitval", "dartpy", "torch", "numpy"} <= set(provenance["versions"])
    assert len(provenance["configuration"]) == len(provenance["subject"]) == 64
    train = provenance["stages"]["train-1"]
    assert train["inputs"] == fingerprint(train_stage(run, 1), run.folder)


def test_killed_main_job_resumes_at_the_interrupted_stage(
    opened: Opener, stand_ins: list[float | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = opened("identification.rounds=1")
    whole = study.simulate_stage

    def interrupted(run: Run) -> Stage:
        def stop() -> None:
            os.kill(os.getpid(), signal.SIGINT)
            raise AssertionError("not interrupted")

        return replace(whole(run), run=stop)

    monkeypatch.setattr(study, "simulate_stage", interrupted)
    # A shell starts its background jobs, and so their tests, deaf to the interrupt.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_subject(run)
    finally:
        signal.signal(signal.SIGINT, before)
    monkeypatch.setattr(study, "simulate_stage", whole)
    again = opened("identification.rounds=1")
    run_subject(again)
    assert ran(again) == ["simulate", "repeat", "body", "push", "validate", "report"]
    assert isinstance(again.observer, Listener)
    assert again.observer.reasons["simulate"] == "was interrupted"


# ---- What a training starts from. ----


def stored_policy(folder: Path, task: WalkingTask, **about: object) -> Path:
    """A policy of 128 hidden units in `folder`."""
    policy = random_policy(task, scale=0.0, units=128)
    save_policy(replace(policy, about={**policy.about, **about}), folder)
    return folder


@pytest.fixture(scope="module")
def folder_with_reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished scaling and reference motion; the reference takes seconds to fit."""
    folder = tmp_path_factory.mktemp("scaled") / "run"
    with open_run(load_subject("5"), load_configuration(), folder, Listener()) as run:
        run_one(run, "scale")
        run_one(run, "reference")
    return folder


@pytest.fixture
def scaled(
    opened: Opener, folder_with_reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Run:
    """A run whose body is scaled, with no stored policy anywhere."""
    monkeypatch.setattr(study, "general_policy", lambda *_: None)
    shutil.copytree(folder_with_reference, tmp_path / "run")
    return opened()


def messages(run: Run) -> str:
    assert isinstance(run.observer, Listener)
    return "\n".join(run.observer.lines)


@pytest.fixture
def general(
    scaled: Run, task: WalkingTask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There is a general policy."""
    stored = stored_policy(tmp_path / "general", task, general=True)
    monkeypatch.setattr(study, "general_policy", lambda *_: stored)


def test_without_a_stored_policy_a_training_starts_from_nothing(scaled: Run) -> None:
    study.choose_start(scaled, study.train_stage(scaled, 1))
    assert not (scaled.folder / "start").exists()
    assert "training from nothing" in messages(scaled)
    files = ("model.urdf", "reference.npz", "rounds/1/need.json")
    assert study.train_stage(scaled, 1).inputs == files


@pytest.mark.slow
@pytest.mark.usefixtures("general")
def test_a_body_without_a_policy_of_its_own_starts_from_the_general_one(scaled: Run) -> None:
    study.choose_start(scaled, study.train_stage(scaled, 1))
    assert read_json(scaled.folder / "start" / "policy.json")["general"]
    assert "general policy" in messages(scaled)
    study.choose_start(scaled, study.train_stage(scaled, 1), scratch=True)
    assert not (scaled.folder / "start").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("general")
def test_a_start_that_is_half_there_is_chosen_again(scaled: Run) -> None:
    """As a kill between its two files, or an earlier gaitval, leaves a folder."""
    study.choose_start(scaled, study.train_stage(scaled, 1))
    record = {"inputs": {}, "version": 1, "outputs": {}}
    write_json(scaled.folder / "stages.json", {"train-1": record})
    (scaled.folder / "start" / "policy.json").unlink()
    (scaled.folder / "rounds/1/need.json").unlink(missing_ok=True)
    study.choose_start(scaled, study.train_stage(scaled, 1))
    assert read_json(scaled.folder / "start" / "policy.json")["general"]


def test_a_training_starts_from_the_policy_that_is_named(
    scaled: Run, task: WalkingTask, tmp_path: Path
) -> None:
    """Its files count among the training's inputs; the same ones are not copied again."""
    named = stored_policy(tmp_path / "named", task, general=True)
    start_from(scaled, named)
    copied = scaled.folder / "start" / "policy.json"
    assert copied.read_bytes() == (named / "policy.json").read_bytes()
    assert "start/policy.json" in study.train_stage(scaled, 1).inputs
    assert str(named) in messages(scaled)
    before = copied.stat().st_mtime_ns
    start_from(scaled, named)
    assert copied.stat().st_mtime_ns == before
    with pytest.raises(PolicyError, match="nowhere"):
        start_from(scaled, tmp_path / "nowhere")
    assert copied.exists()
    with pytest.raises(ConfigurationError, match="Give one of --scratch and --start"):
        study.run_subject(scaled, scratch=True, start=named)


@pytest.mark.slow
@pytest.mark.usefixtures("general")
def test_the_persons_own_stored_policy_is_no_start(scaled: Run) -> None:
    """A built-in person is learned as anybody is, so that the result is what a user will get."""
    assert stored_baseline(scaled.folder, "S05") is not None
    study.choose_start(scaled, study.train_stage(scaled, 1))
    assert read_json(scaled.folder / "start" / "policy.json")["general"]


@pytest.mark.slow
@pytest.mark.usefixtures("scaled", "general")
def test_a_policy_of_another_size_is_not_started_from(opened: Opener) -> None:
    run = opened("training.hidden_units=64")
    study.choose_start(run, study.train_stage(run, 1))
    assert not (run.folder / "start").exists()
    assert "128 hidden units, but training.hidden_units is 64" in messages(run)


@pytest.mark.parametrize("key", ["inputs", "outputs"])
@pytest.mark.parametrize("value", ["renamed", None, [], "text"])
def test_a_record_that_was_edited_is_refused_with_its_key(
    folder: Path, key: str, value: object
) -> None:
    run_stage(doubling(folder), folder)
    records = read_json(folder / "stages.json")
    kept = records["double"].pop(key)
    if value != "renamed":
        records["double"][key] = value
    write_json(folder / "stages.json", records)
    if (key, value) == ("outputs", None):  # has not ended
        assert run_stage(doubling(folder), folder)
    else:
        with pytest.raises(ArtefactError, match=rf"stages.json: double: {key} .* Remove double"):
            run_stage(doubling(folder), folder)
        write_json(folder / "stages.json", {})  # what the message says
        assert run_stage(doubling(folder), folder)
    assert read_json(folder / "stages.json")["double"][key] == kept


@pytest.mark.parametrize("name", ["stages.json", "provenance.json"])
@pytest.mark.parametrize("content", ["[]", "1", '{"stages": 3}'])
def test_records_of_another_shape_are_refused(
    opened: Opener, tmp_path: Path, name: str, content: str
) -> None:
    run = opened()
    write_text(run.folder / name, content)
    with pytest.raises(ArtefactError, match=rf"{name}: .*was edited. Delete"):
        run_one(opened(), "scale")


def test_what_a_kill_left_half_written_is_removed_at_the_next_start(tmp_path: Path) -> None:
    folder = tmp_path / "run" / "rounds" / "1" / "policy"
    folder.mkdir(parents=True)
    for path in (tmp_path / "run" / ".partial-report-x8.pdf", folder / ".partial-policy-x8.json"):
        path.write_text("")
    hold(tmp_path / "run")
    assert not list(tmp_path.rglob(".partial-*"))


def test_locking_leaves_the_contents_of_the_lock(tmp_path: Path) -> None:
    """It may be another name of somebody's file: a hard link cannot be distinguished from it."""
    theirs = tmp_path / "theirs.txt"
    theirs.write_text("theirs")
    (tmp_path / "run").mkdir()
    os.link(theirs, tmp_path / "run" / ".lock")
    hold(tmp_path / "run")
    assert theirs.read_text() == "theirs"


def test_a_folder_that_may_not_be_written_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As root may write everywhere, the system's answer is put in its place."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("os.mkdir", refuse)
    with pytest.raises(ArtefactError, match=r"run: cannot be written: its folder may not .*--out"):
        hold(tmp_path / "run")


def test_what_is_unusual_in_a_subject_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    person = load_subject("5")
    moments = {
        curve: each.model_copy(
            update={
                "mean": 0.1 * each.mean,
                "cosine": tuple(0.1 * value for value in each.cosine),
                "sine": tuple(0.1 * value for value in each.sine),
            }
        )
        for curve, each in person.gait.moments.items()
    }
    gait = person.gait.model_copy(update={"moments": moments})
    changed = person.model_copy(update={"gait": gait})
    listener = Listener()
    with open_run(changed, load_configuration(), tmp_path / "run", listener) as run:
        run_one(run, "scale")
        monkeypatch.setattr(
            "gaitval.walk.reference.dynamic_fit.consistent_reference",
            lambda *_: (_ for _ in ()).throw(KeyboardInterrupt),
        )
        with pytest.raises(KeyboardInterrupt):
            run_one(run, "reference")
        assert any("times the size of other people's" in line for line in listener.lines)


def test_a_policy_for_legs_that_differ_is_that_of_the_scaled_body(
    opened: Opener, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A later round trains with the legs that were found; a policy is known by the scaled body."""
    run = opened()
    model = scale_subject(run.subject).model
    run.folder.mkdir(parents=True, exist_ok=True)
    write_urdf(model, run.folder / "model.urdf")
    monkeypatch.setattr("gaitval.policy.training.train", lambda *_, **given: given)
    found: Any = learned(run, [None], None, run.folder / "trained", 10)  # type: ignore[list-item]
    assert model_hash(found["scaled"]) == model_hash(model)


def test_a_run_is_not_written_over_one_of_another_subject(tmp_path):
    """Its policy would be lost."""
    configuration = load_configuration()
    with open_run(load_subject("S05"), configuration, tmp_path / "run", Observer()):
        pass
    before = (tmp_path / "run" / "subject.toml").read_bytes()
    with (
        pytest.raises(ConfigurationError, match=r"run: holds a run of S05, .* S07 .* --out"),
        open_run(load_subject("S07"), configuration, tmp_path / "run", Observer()),
    ):
        pass
    assert (tmp_path / "run" / "subject.toml").read_bytes() == before
    with open_run(load_subject("S05"), configuration, tmp_path / "run", Observer()):
        pass


def test_identification_by_rollouts_takes_the_policy_of_each_round(opened: Opener) -> None:
    run = opened("identification.method=rollouts")
    for number in (1, 2):
        inputs = identify_stage(run, number).inputs
        assert f"rounds/{number}/trained/policy.safetensors" in inputs
        assert not any("identification.json" in each for each in inputs)
    assert "rounds/1/identification/identification.json" in identify_stage(opened(), 2).inputs
    assert load_configuration("paper").identification.method == "rollouts"
