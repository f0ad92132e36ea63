"""The mass that the plates measure, against the one that was given."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_session import made_up_session

from gaitval.configuration import Configuration
from gaitval.errors import ConfigurationError, RecordError
from gaitval.session.average import check_mass
from gaitval.session.importing.importing import import_files, work_out
from gaitval.session.importing.summary import verdicts


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    session = made_up_session(tmp_path_factory.mktemp("lab"), noise=0.0)
    return work_out(session.request, Configuration().processing)


@pytest.mark.slow
def test_a_foot_of_a_light_person_lands_when_a_heavy_one_s_does(found, tmp_path):
    """20 N are 14 % of 15 kg: stance was 4 to 5 % of the cycle short."""
    share = 15.0 / found.request.mass_kg
    lines = found.request.forces[0].read_text().splitlines()
    (start,) = (row for row, line in enumerate(lines) if line.startswith("time"))
    loads = ["_p" not in name and name != "time" for name in lines[start].split()]
    for row in range(start + 1, len(lines)):
        values = zip(lines[row].split(), loads, strict=True)
        lines[row] = "\t".join(str(share * float(v)) if load else v for v, load in values)
    path = tmp_path / "light.mot"
    path.write_text("\n".join(lines))
    request = found.request.model_copy(update={"forces": (path,), "mass": 15.0})
    light = work_out(request, Configuration().processing)
    assert light.processing.force_threshold_n == pytest.approx(0.05 * 15.0 * 9.80665)
    for side in ("right", "left"):
        stance = [each.trials[0].gait[side].stance_fraction for each in (light, found)]
        assert stance[0] == pytest.approx(stance[1], abs=0.008), stance


def ending_beside_the_plates(walk, samples):
    """The trial with one cycle, without forces in its last samples."""
    cycle = walk.cycles["right"][1]
    last = np.searchsorted(walk.forces.time, cycle.end)
    valid, force = walk.forces.valid.copy(), walk.forces.force.copy()
    valid[last - samples : last, 1], force[last - samples : last, 1] = False, 0.0
    forces = replace(walk.forces, valid=valid, force=force)
    return replace(walk, forces=forces, cycles={"right": (cycle,), "left": ()})


def test_a_foot_that_lands_beside_the_plates_at_the_end_of_a_cycle_hides_no_mass(found):
    walk = ending_beside_the_plates(found.trials[0], 5)
    assert check_mass(found.request, [walk]) == pytest.approx(1.0, abs=0.02)
    other = found.request.model_copy(update={"mass": found.request.mass_kg * 1.2})
    with pytest.raises(RecordError, match="over 1 whole gait cycles, but the mass given is"):
        check_mass(other, [walk])


def test_a_cycle_half_of_whose_forces_are_missing_shows_no_mass(found):
    walk = ending_beside_the_plates(found.trials[0], 200)
    assert check_mass(found.request, [walk]) is None


@pytest.mark.slow
def test_what_an_aid_carries_is_no_fault_of_motion_or_mass(found, tmp_path):
    """Residuals and weight hold it; --consistent took it from the masses, a third of the torso's.

    Who forgot the aid is told of it.
    """
    half = [
        replace(walk, forces=replace(walk.forces, force=0.6 * walk.forces.force))
        for walk in found.trials
    ]
    with pytest.raises(RecordError, match=r"say so with aid in a session file\."):
        check_mass(found.request, half)
    aided = found.request.model_copy(update={"aid": "crutches"})
    assert check_mass(aided, half) == pytest.approx(0.6, abs=0.02)
    judged = {row.id for row in verdicts(found)}
    without = {row.id for row in verdicts(replace(found, request=aided))}
    assert {each for each in judged - without if not each.startswith("residual-")} == {
        "model-weight"
    }
    assert without == {each for each in judged if each.startswith(("ik-", "scaling-"))}
    for wanted in ({"consistent": True}, {"correct": ("plates",)}):
        request = aided.model_copy(update=wanted)
        with pytest.raises(ConfigurationError, match="is not measured, and would be taken for"):
            import_files(request, tmp_path / "out", configuration=Configuration())
    assert not (tmp_path / "out").exists()
