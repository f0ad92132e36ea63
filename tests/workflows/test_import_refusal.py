"""A refusal keeps what was found, and says how to go on; trials are pooled over both sides."""

import io
from pathlib import Path

import numpy as np
import pytest
from made_up_session import CONTRADICTED, MadeUpSession, made_up_session
from quick_settings import WITH_WORDS, WORDS
from typer.testing import CliRunner

from gaitval import cli
from gaitval._internal.io.artefacts import read_json
from gaitval.apps.judge.judge import judge
from gaitval.apps.judge.request import JudgeRequest
from gaitval.apps.judge.write import write_judgement
from gaitval.cli.terminal import display
from gaitval.configuration import ProcessingSettings, load_configuration
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import ConfigurationError, RecordError, TrialOnlyError
from gaitval.mocap.mot import read_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.session.importing.importing import import_files, work_out
from gaitval.session.importing.stored import Session
from gaitval.session.request import ImportOptions
from gaitval.session.session import Import
from gaitval.session.subject import subject_of
from gaitval.session.trial import valid_cycles
from gaitval.subjects.subject_file import load_subject


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> MadeUpSession:
    return made_up_session(
        tmp_path_factory.mktemp("session"), noise=0.0, seconds=2.4, rate=150.0, per_frame=2
    )


@pytest.fixture(scope="module")
def whole(session: MadeUpSession) -> Import:
    """What the whole walk gives."""
    return work_out(session.request, ProcessingSettings())


def without_force(session: MadeUpSession, path: Path, plate: str) -> Path:
    """The forces, with those of one plate zero throughout."""
    lines = session.forces.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("time"))
    names = lines[start].split("\t")
    gone = [i for i, name in enumerate(names) if plate in name]
    assert gone
    rows = []
    for line in lines[start + 1 :]:
        cells = line.split("\t")
        for i in gone:
            cells[i] = "0.0"
        rows.append("\t".join(cells))
    path.write_text("\n".join([*lines[: start + 1], *rows, ""]))
    return path


def plates(session: MadeUpSession) -> list[str]:
    """What the names of the columns of each plate's force have in common."""
    line = next(line for line in session.forces.read_text().splitlines() if line.startswith("time"))
    names = [name for name in line.split("\t") if name.endswith("_vx")]
    return [name.removesuffix("force_vx").removesuffix("vx") for name in names]


def imported(session: MadeUpSession, out: Path, **changed: object) -> object:
    given = session.request.model_dump(include=set(ImportOptions.model_fields)) | changed
    return import_files(
        ImportOptions(**given), out, configuration=load_configuration(settings=WORDS)
    )


@pytest.mark.slow
def test_without_the_forces_of_a_foot_they_are_absent(session, tmp_path):
    """The page says it in one place."""
    forces = without_force(session, tmp_path / "one.mot", plates(session)[0])
    out = tmp_path / "out"
    made = imported(session, out, forces=[forces])
    ((kind, side),) = made.subject.gait.not_recorded.items()
    assert kind == "kinetics"
    assert made.subject.gait.forces.of(side) is None
    page = (out / "recording" / "recording.html").read_text()
    assert page.count(f"{side} foot: its moments and forces were not recorded") == 1
    warned = [each["check"] for each in read_json(out / "recording" / "import.json")["warnings"]]
    assert "2 warnings about the recording" in page
    assert CONTRADICTED in warned
    assert load_subject(out / "subject.toml").origin(side, "kinetics") == "expected"
    session_of = Session.load(out)
    assert f"moment_knee_angle_{side[0]}_mean" not in session_of.curves
    assert set(session_of.subject.to_frame().query("quantity == 'knee_angle'").side) == set(SIDES)
    recording = out / "recording"
    judged = judge(
        JudgeRequest(
            model=recording / "model.osim",
            ik=recording / "trial1_ik.mot",
            id=recording / "trial1_id.sto",
            external_loads=recording / "trial1_external_loads.xml",
        )
    )
    assert not any(name.endswith(f"_{side[0]}") for name in judged.moments)
    assert write_judgement(judged, tmp_path / "judged").moments.keys() == judged.band.keys()


@pytest.mark.slow
def test_what_cannot_become_a_subject_is_written_all_the_same(session, tmp_path):
    """Too few cycles for two halves, which only the subject needs."""
    with pytest.raises(RecordError, match="Everything else was worked out"):
        imported(session, tmp_path / "out", halves="first-last")
    recording = tmp_path / "out" / "recording"
    assert (recording / "recording.html").exists()
    assert (recording / "import.json").exists()
    assert (recording / "trial1_ik.mot").exists()
    assert not (tmp_path / "out" / "subject.toml").exists()
    imported(session, tmp_path / "out", forces=[], kinematics_only=True)
    assert (tmp_path / "out" / "subject.toml").exists()


def test_a_refusal_before_the_body_leaves_a_page_and_the_way_on(session, tmp_path, monkeypatch):
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=200))
    wanted = session.request
    command = [
        "import", "--static", str(wanted.static), "--trial", str(wanted.trials[0]),
        "--mass", str(wanted.mass_kg), "--height", str(wanted.height_m), "--sex", wanted.sex,
        "--out", str(tmp_path / "out"),
    ]  # fmt: skip
    monkeypatch.setattr("sys.argv", ["gaitval", *command])
    found = CliRunner().invoke(cli.app, command)
    assert found.exit_code == 2
    message = text.getvalue()
    assert "no force plates in the trial" in message
    assert f"To continue without it: gaitval import --static {wanted.static}" in message
    assert message.rstrip().endswith("--kinematics-only")
    page = (tmp_path / "out" / "recording" / "refused.html").read_text()
    for words in ("no force plates in the trial", "marker set", "--kinematics-only"):
        assert words in page
    assert (tmp_path / "out" / "recording" / "refused.pdf").exists()


def test_a_refusal_keeps_the_subject_of_the_import_before(session, tmp_path):
    out = tmp_path / "out"
    imported(session, out, forces=[], kinematics_only=True)
    own = (out / "subject.toml").read_text(encoding="utf-8")
    with pytest.raises(ConfigurationError, match="gian: this fault cannot be corrected"):
        imported(session, out, correct=["gian"])
    assert (out / "subject.toml").read_text(encoding="utf-8") == own  # before anything is done
    with pytest.raises(RecordError, match=r"import before is kept: \S+subject\.toml\.before"):
        imported(session, out, forces=[])
    assert not (out / "subject.toml").exists()
    assert (out / "subject.toml.before").read_text(encoding="utf-8") == own


@pytest.mark.slow
def test_a_refusal_after_the_body_keeps_it(session, tmp_path):
    """A walk that is shorter than two steps shows no whole cycle of one side."""
    with pytest.raises(RecordError, match=r"complete .* gait cycle") as caught:
        imported(
            session, tmp_path / "out", trials=[cut(session, tmp_path, 0.0, 0.9)],
            forces=[], kinematics_only=True,
        )  # fmt: skip
    assert "trial with poses" in str(caught.value)
    recording = tmp_path / "out" / "recording"
    for name in ("refused.html", "model.urdf", "scaling.csv", "cycles.csv", "trial1_ik.mot"):
        assert (recording / name).exists(), name
    assert not (recording / "import.json").exists()
    imported(session, tmp_path / "out")
    assert not (recording / "refused.html").exists()


def cut(session: MadeUpSession, folder: Path, begin: float, end: float) -> Path:
    """A part of the walk, s, without forces."""
    whole = read_recording(session.walking)
    frames = slice(*(round(at * whole.marker_rate) for at in (begin, end)))
    path = folder / f"part_{begin:g}_{end:g}.trc"
    write_trc(path, whole.with_markers(whole.names, whole.markers[frames]))
    return path


def one_cycle(session: MadeUpSession, whole: Import, folder: Path, side: Side) -> Path:
    """A part of the walk that shows one cycle of a side and none of the other."""
    (walk,) = whole.trials
    other = opposite(side)
    strikes = [
        event.time for event in walk.events if (event.side, event.kind) == (other, "heel_strike")
    ]
    # from just before a strike of one foot to just after its next, so the other has one or none
    begin, end = next(
        (cycle.start, cycle.end)
        for cycle in valid_cycles(walk, side, kinetics=False)
        if sum(cycle.start - 0.1 < at < cycle.end + 0.1 for at in strikes) < 2
    )
    return cut(session, folder, max(begin - 0.1, 0.0), end + 0.1)


def test_trials_that_show_one_side_each_are_pooled(session, whole, tmp_path):
    request = session.request
    trials = [one_cycle(session, whole, tmp_path, side) for side in SIDES]
    pooled = request.model_copy(
        update={"trials": tuple(trials), "forces": (), "kinematics_only": True}
    )
    found = work_out(pooled, ProcessingSettings())
    counts = [
        {side: len(valid_cycles(walk, side, kinetics=False)) for side in SIDES}
        for walk in found.trials
    ]
    assert counts == [{"right": 1, "left": 0}, {"right": 0, "left": 1}]
    subject = subject_of(found)
    both = subject_of(whole)
    assert subject.walking_speed_m_s == pytest.approx(both.walking_speed_m_s, rel=0.05)
    assert {name for name in found.angles if name.startswith("knee")} == {
        "knee_angle_r",
        "knee_angle_l",
    }


def test_a_trial_without_a_whole_cycle_is_a_trial_with_moments(session, tmp_path, monkeypatch):
    """Poses and moments need no gait cycle; only a subject does."""
    out = tmp_path / "out"
    with pytest.raises(TrialOnlyError, match="trial with moments") as made:
        imported(session, out, trial_time=[(0.3, 1.25)])
    for side in SIDES:
        assert f"moments of the {side} leg from" in str(made.value)
    moments = read_storage(out / "recording" / "trial1_id.sto")
    assert np.isfinite(moments.column("knee_angle_r_moment")).mean() > 0.5
    assert not (out / "subject.toml").exists()
    assert "a trial, and no subject" in (out / "recording" / "refused.html").read_text()
    with pytest.raises(TrialOnlyError, match="trial with poses"):
        imported(session, tmp_path / "poses", trial_time=[(0.3, 1.25)], kinematics_only=True)
    request = session.request
    command = [
        "import", "--static", str(request.static), "--trial", str(request.trials[0]),
        "--forces", str(request.forces[0]), "--mass", str(request.mass_kg),
        "--height", str(request.height_m), "--sex", request.sex, "--trial-time", "0.3:1.25",
        "--out", str(tmp_path / "command"), *WITH_WORDS,
    ]  # fmt: skip
    result = CliRunner().invoke(cli.app, command)
    assert result.exit_code == 0, result.output
    assert "Made: trial with moments" in " ".join(result.output.split())
