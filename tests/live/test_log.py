"""What was done, from a file, walked again."""

import json
from dataclasses import replace

import pytest

from gaitval.apps.devices.of_subject import tables
from gaitval.apps.live.command import _check
from gaitval.apps.live.doing import ChangeBody, Clock, PushPelvis, Restart, SetSpeed, Wear
from gaitval.apps.live.log import LogWriter, check_person, read_log, walk_again
from gaitval.apps.live.walk import LiveWalk
from gaitval.errors import ArtefactError, RecordError

DOINGS = (
    (40, PushPelvis(0.0, 150.0)),
    (40, SetSpeed(1.2)),
    (90, Clock(0.25)),
    (120, ChangeBody("shank_length", 1.02)),
    (160, PushPelvis(-80.0, 20.0)),
    (300, PushPelvis(0.0, 1200.0)),
    (900, Restart()),
)


@pytest.fixture(scope="module")
def written(person, tmp_path_factory):
    """A log with a bit of everything, a fall too."""
    walk = LiveWalk(person, person.speeds[1])
    writer = LogWriter(tmp_path_factory.mktemp("logs") / "walks" / "one.jsonl", person, walk)
    for step, doing in DOINGS:
        while walk.step < step:
            walk.act()
        writer.did(walk.step, doing)
        if not isinstance(doing, Clock):
            walk.do(doing)
        writer.at(walk)
    for _ in range(60):
        walk.act()
    writer.at(walk)
    writer.close()
    return writer.path


def test_a_log_is_walked_again_bit_for_bit(written, person):
    log = read_log(written)
    check_person(log, person, written)
    found = walk_again(log, LiveWalk(person, log.speed))
    assert found.differs is None
    assert found.checked == len(DOINGS) + 1
    assert log.steps == 960


def test_a_push_that_was_an_action_later_is_seen(written, person, tmp_path):
    rows = written.read_text().split("\n")
    values = json.loads(rows[1])
    assert values["do"] == "push"
    rows[1] = json.dumps({**values, "step": values["step"] - 1})
    path = tmp_path / "changed.jsonl"
    path.write_text("\n".join(rows))
    log = read_log(path)
    assert walk_again(log, LiveWalk(person, log.speed)).differs == 40


def test_a_log_that_was_cut_off_is_read_up_to_there(written, person, tmp_path):
    """As a process leaves it that is killed while it writes."""
    path = tmp_path / "cut.jsonl"
    path.write_text(written.read_text()[:-20])
    log = read_log(path)
    found = walk_again(log, LiveWalk(person, log.speed))
    assert found.differs is None
    assert found.equal == 900  # the hash after it was cut off


def test_without_a_hash_nothing_is_called_equal(written, person, tmp_path):
    rows = [row for row in written.read_text().split("\n") if "digest" not in row]
    path = tmp_path / "killed.jsonl"
    path.write_text("\n".join(rows))
    log = read_log(path)
    with pytest.raises(RecordError, match="no hash, so nothing could be compared"):
        _check(log, LiveWalk(person, log.speed), path)


def test_a_log_that_cannot_be_written_says_so(written, person, walk, tmp_path):
    writer = LogWriter(tmp_path / "log.jsonl", person, walk)
    writer._file.close()
    writer._file = open("/dev/full", "w")  # noqa: SIM115
    with pytest.raises(ArtefactError, match=r"log\.jsonl: cannot be written \(No space"):
        writer.did(0, DOINGS[0][1])
    writer.close()


def test_another_policy_or_reference_is_refused(written, person):
    log = read_log(written)
    with pytest.raises(RecordError, match="reference motions differ"):
        check_person(log, replace(person, references=("other",)), written)
    with pytest.raises(RecordError, match="the policy"):
        check_person(replace(log, policy="other"), person, written)


def test_a_log_that_is_there_is_not_overwritten(written, person, walk):
    with pytest.raises(FileExistsError):
        LogWriter(written, person, walk)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{}", "step is None"),
        ('{"step": -1, "do": "restart"}', "step is -1"),
        ('{"step": true, "do": "restart"}', "step is True"),
        ('{"step": 1e3, "do": "restart"}', "step is 1000.0"),
        ('{"step": 1, "do": "fly"}', "does nothing"),
        ('{"step": 1, "digest": 5}', "digest"),
        ('{"step": 1, "digest": "a", "do": "restart"}', "digest"),
        ("[1]", "no JSON object"),
        ("[" * 100_000, "no JSON object"),
        ('{"step": 5, "do": "restart"}\n{"step": 4, "do": "restart"}', "comes after"),
    ],
)
def test_a_damaged_line_is_named(written, tmp_path, line, message):
    path = tmp_path / "damaged.jsonl"
    path.write_text(written.read_text().split("\n")[0] + f"\n{line}\n")
    with pytest.raises(RecordError, match=f"damaged.jsonl, line [23].*{message}"):
        read_log(path)


@pytest.mark.parametrize("text", ["", "\n", "hello\n", "[]\n", '{"format": "other"}\n'])
def test_what_is_no_log_is_refused(tmp_path, text):
    path = tmp_path / "none.jsonl"
    path.write_text(text)
    with pytest.raises(RecordError, match=r"none.jsonl"):
        read_log(path)


@pytest.mark.parametrize("name", ["subject", "policy", "references", "speed"])
def test_a_log_without_its_beginning_is_refused(written, tmp_path, name):
    values = json.loads(written.read_text().split("\n")[0])
    del values[name]
    path = tmp_path / "headless.jsonl"
    path.write_text(json.dumps(values) + "\n")
    with pytest.raises(RecordError, match=name):
        read_log(path)


def test_devices_are_in_the_log_and_walk_again(person, tmp_path):
    fitted = tables(["hip_exo"])
    walk = LiveWalk(person, person.speeds[1], fitted)
    writer = LogWriter(tmp_path / "one.jsonl", person, walk)
    for on in (False, True):
        for _ in range(50):
            walk.act()
        writer.did(walk.step, Wear(on))
        walk.do(Wear(on))
    for _ in range(50):
        walk.act()
    writer.at(walk)
    writer.close()
    log = read_log(writer.path)
    assert [each["name"] for each in log.devices] == ["hip_exo"]
    assert walk_again(log, LiveWalk(person, log.speed, log.devices)).differs is None
    assert walk_again(log, LiveWalk(person, log.speed)).differs is not None
    text = writer.path.read_text().replace('"devices": [', '"devices": [1, ')
    writer.path.write_text(text)
    with pytest.raises(RecordError, match="devices is no list of tables"):
        read_log(writer.path)


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), -1.0])
def test_a_speed_that_is_none_is_refused(written, tmp_path, speed):
    rows = written.read_text().split("\n")
    rows[0] = json.dumps({**json.loads(rows[0]), "speed": speed})
    path = tmp_path / "speed.jsonl"
    path.write_text("\n".join(rows))
    with pytest.raises(RecordError, match="speed is"):
        read_log(path)
