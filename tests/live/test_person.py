"""A person with references at all speeds, in a run folder."""

from types import SimpleNamespace

import pytest

from gaitval.apps.live import person as live_person
from gaitval.apps.live.log import LogWriter, check_person, read_log, walk_again
from gaitval.apps.live.person import folder_of, prepared
from gaitval.apps.live.walk import LiveWalk
from gaitval.apps.patients.gentle_fit import gentle_reference
from gaitval.datasets.subject_file import load_subject
from gaitval.study.predicted_tasks import range_speeds
from gaitval.study.stage import Observer, Stage

STAGE = Stage("range", lambda: None, (), ())


def test_the_folder_of_a_person_is_not_that_of_a_study():
    assert folder_of(load_subject(5)).name == "S05-live"


@pytest.mark.parametrize("side", ["none", "left"])
def test_who_has_a_prosthesis_walks_by_the_fit_of_patients(monkeypatch, side):
    """An amputee fell at a speed where the usual fit ended far from the angles."""
    wanted = []
    monkeypatch.setattr(
        live_person, "range_stage", lambda run, fit=None: wanted.append(fit) or STAGE
    )
    monkeypatch.setattr(live_person, "partial", lambda fit, **options: (fit, options))
    subject = load_subject(8).model_copy(update={"prosthesis": side})
    live_person._range_stage(SimpleNamespace(subject=subject))
    assert wanted == ([None] if side == "none" else [(gentle_reference, {"amputation": "left"})])


@pytest.mark.slow
def test_a_second_start_finds_the_references_and_walks_a_log_again(tmp_path):
    subject = load_subject(8)  # one trial, at 0.57 m/s

    class Said(Observer):
        def __init__(self):
            self.ran = []

        def started(self, stage, reason):
            self.ran.append(stage)

    first, second = Said(), Said()
    with prepared(subject, tmp_path, first) as person:
        assert first.ran == ["scale", "range"]
        assert person.speeds == pytest.approx(range_speeds([subject.walking_speed_m_s]))
        walk = LiveWalk(person)
        writer = LogWriter(tmp_path / "walks" / "log.jsonl", person, walk)
        for _ in range(500):
            walk.act()
        writer.at(walk)
        writer.close()
        assert not walk.down
    with prepared(subject, tmp_path, second) as person:
        assert not second.ran
        log = read_log(writer.path)
        check_person(log, person, writer.path)
        found = walk_again(log, LiveWalk(person, log.speed))
        assert found.differs is None
        assert found.checked == 1
