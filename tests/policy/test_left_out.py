"""Who is left out of which general policy, and which studies are done from it."""

from experiments import left_out, own_training
from experiments.own_training import FINISHED, MOST, place
from gaitval.artefacts import write_json
from gaitval.datasets.subject_file import BUILTIN


def test_everybody_is_left_out_once():
    found = left_out.groups()
    assert sorted(name for group in found for name in group) == sorted(BUILTIN)
    assert len(found) == left_out.GROUPS


def test_a_body_is_studied_before_what_has_it():
    found = list(left_out.jobs())
    assert len(found) == len(set(found))
    for name in BUILTIN:
        mine = [job for job in found if job[0] == name]
        assert mine[0] == (name, 0, 0)
        assert [seed for _, seed, samples in mine if samples == MOST] == [*range(left_out.SEEDS)]


def test_nobody_is_studied_from_a_policy_that_has_seen_them(tmp_path, monkeypatch):
    trained, studied = [], []

    def train(command, **_):
        out = command[command.index("--out") + 1]
        trained.append(command)
        write_json(left_out.Path(out) / "about.json", {})

    monkeypatch.setattr(left_out.subprocess, "run", train)
    monkeypatch.setattr(own_training, "study", lambda *given: studied.append(given))
    finished = place(tmp_path, "S05", 0, 0)
    for name in ("0", str(MOST)):
        write_json(finished / name / FINISHED, {})
    arguments = type("", (), {"seeds": left_out.SEEDS, "work": tmp_path})
    left_out.run(arguments)
    learners = {left_out.Path(c[c.index("--out") + 1]).name: set(c) & set(BUILTIN) for c in trained}
    assert len(trained) == 2 * left_out.GROUPS
    for name, _, _, _, _, policy in studied:
        assert name not in learners[policy.name]
        assert policy.name.startswith("without-")
    for step in trained:
        if "--start" in step:  # the second step goes on from a policy of the same people
            assert learners[left_out.Path(step[step.index("--start") + 1]).name] == (
                set(step) & set(BUILTIN)
            )
    done = {(name, seed, samples) for name, _, seed, samples, *_ in studied}
    assert ("S05", 0, 0) not in done
    assert ("S05", 1, MOST) in done  # its body is there
    assert ("S04", 1, MOST) not in done  # whose body is not
