"""`gaitval judge` on a walk whose faults are known, because the tests put them in."""

import json
import re
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner
from verdict_words import headline, rows_of, says

import gaitval.apps.judge
from gaitval import cli
from gaitval.apps.judge import gait
from gaitval.apps.judge.judge import SHOWN_ONLY, Judgement, judge
from gaitval.apps.judge.loads import read_loads
from gaitval.apps.judge.moments import bands
from gaitval.apps.judge.request import JudgeRequest
from gaitval.apps.judge.skeleton import skeleton
from gaitval.apps.judge.write import result_of, write_judgement
from gaitval.coordinates import RANGES
from gaitval.errors import ConfigurationError, GaitvalError, RecordError, RecordWarning
from gaitval.metrics.tolerances import JUDGED_UNITS, load_registry, measured
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.scaling.opensim.model_file import read_model

NOISE_M = 0.005
"""Of the markers, see conftest.py."""


def failed(found: Judgement) -> set[tuple[str, str]]:
    return {(verdict.id, verdict.target) for verdict in found.failed}


def value(found: Judgement, measure: str, target: str) -> float:
    (one,) = [m.value for m in found.measures if (m.measure, m.target) == (measure, target)]
    assert one is not None
    return one


def with_columns(path: Path, out: Path, change) -> Path:
    """A storage file with columns changed: `change(name, values)` gives the new values."""
    table = read_storage(path)
    values = np.column_stack([change(name, table.column(name)) for name in table.columns])
    write_storage(out, StorageTable(table.columns, table.time, values, table.in_degrees))
    return out


def edited(path: Path, out: Path, pattern: str, to) -> Path:
    text, count = re.subn(pattern, to, path.read_text(), flags=re.DOTALL)
    assert count
    out.write_text(text)
    return out


@pytest.fixture(scope="module")
def sound(everything) -> Judgement:
    """Of what has no fault."""
    return judge(everything)


LIMITS = [row for row in load_registry().tolerance if row.measure in JUDGED_UNITS]


@pytest.mark.parametrize("row", LIMITS, ids=[row.id for row in LIMITS])
def test_a_value_beyond_a_limit_fails_it_and_at_the_limit_does_not(sound, row):
    beyond = row.value + (0.01 if row.limit == "at_most" else -0.01)
    target = f"{row.applies_to[0]}_l" if row.applies_to else "left"
    for value, kept in ((row.value, True), (beyond, False)):
        found = replace(sound, measures=[measured(row.measure, target, value)])
        missed = {(v.id, v.target) for v in found.verdicts() if not v.passed}
        assert ((row.id, target) not in missed) == kept
        assert ((row.id, target) not in failed(found)) == (kept or row.id in SHOWN_ONLY)


# ---- Without a fault. ----


def test_a_sound_walk_keeps_every_limit(sound):
    assert failed(sound) == set()
    assert not [one for one in sound.findings if one.startswith(("Sign", "Axis", "Markers"))]


def test_marker_errors_are_the_noise_that_was_added(sound):
    assert sound.marker_errors.whole_rms == pytest.approx(np.sqrt(3) * NOISE_M, rel=0.02)


def test_the_walk_balances_its_forces(sound):
    """Its ground reaction is what its motion needs; the files round."""
    assert value(sound, "residual_force_share", "root") < 0.1
    assert value(sound, "weight_error", "model") < 1.0


def test_speed_and_cycles_are_those_of_the_walk(sound):
    assert sound.gait.speed == pytest.approx(1.12, rel=0.03)
    assert all(sum(c.kinetics_valid for c in cycles) >= 1 for cycles in sound.gait.cycles.values())


def test_right_and_left_signs_are_read_from_the_model(sound):
    assert set(sound.skeleton.senses) == {
        f"{name}_{side}"
        for side in "rl"
        for name in (
            "hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle",
            "subtalar_angle",
        )
    }  # fmt: skip
    assert set(sound.skeleton.senses.values()) == {1}


# ---- Faults. ----


def test_a_knee_that_bends_negatively_is_understood(everything, judged_files, tmp_path):
    """As in Gait2392: model, motion and moment all have the other sign, and nothing is wrong."""

    def negated(match):
        numbers = " ".join(str(-float(word)) for word in match[2].split())
        return match[1] + numbers + match[3]

    def turned(name, values):
        return -values if name.startswith("knee_angle_r") else values

    model = edited(everything.model, tmp_path / "model.osim",
                   r'(<coordinates>knee_angle_r</coordinates>\s*<axis>)([^<]*)(</axis>)',
                   negated)  # fmt: skip
    found = judge(
        replace(
            everything,
            model=model,
            ik=with_columns(everything.ik, tmp_path / "ik.mot", turned),
            id=with_columns(everything.id, tmp_path / "id.sto", turned),
        )
    )
    assert found.skeleton.senses["knee_angle_r"] == -1
    assert found.skeleton.senses["knee_angle_l"] == 1
    assert failed(found) == set()
    np.testing.assert_allclose(
        found.moments["knee_angle_r"][0], judge(everything).moments["knee_angle_r"][0], atol=1e-9
    )


@pytest.mark.parametrize("name", ["hip_flexion_r", "knee_angle_l", "ankle_angle_r"])
def test_a_moment_of_the_wrong_sign_is_noticed(everything, tmp_path, name):
    def negated(column, values):
        return -values if column == f"{name}_moment" else values

    found = judge(replace(everything, id=with_columns(everything.id, tmp_path / "id.sto", negated)))
    assert ("moment-band", name) in failed(found)
    # Of a knee alone, whose moment differs most between people, the limits are all that is said.
    named = any(f"moment_{name} has the other sign" in one for one in found.undecided)
    assert named or name == "knee_angle_l"
    assert ("moment-sides", f"{name[:-2]} moment") in failed(found)


def test_a_model_of_ten_times_the_mass_is_noticed(everything, tmp_path):
    def tenfold(match):
        return f"<mass>{10 * float(match[1])}</mass>"

    model = edited(everything.model, tmp_path / "model.osim", r"<mass>([^<]*)</mass>", tenfold)
    found = judge(replace(everything, model=model))
    assert {("model-mass", "model"), ("model-weight", "model"),
            ("body-mass-index-high", "model")} <= failed(found)  # fmt: skip
    # Also without knowing the person, from the model's own legs.
    assert failed(judge(JudgeRequest(model=model))) >= {("body-mass-index-high", "model")}


def test_a_heavy_shank_and_an_impossible_inertia_are_noticed(everything, tmp_path):
    shank = r'(<Body name="tibia_r">.*?<mass>)[^<]*(</mass>)'
    toes = r'(<Body name="toes_l">.*?<inertia>)[^<]*(</inertia>)'
    model = edited(everything.model, tmp_path / "heavy.osim", shank, r"\g<1>12\g<2>")
    model = edited(model, tmp_path / "model.osim", toes, r"\g<1>1e-4 2e-4 1e-3 0 0 0\g<2>")
    found = judge(JudgeRequest(model=model))
    assert {("mass-share", "shank_r"), ("inertia", "toes_l")} <= failed(found)
    assert value(found, "inertia_triangle", "toes_l") == pytest.approx(10 / 3)
    negative = edited(model, tmp_path / "negative.osim", toes, r"\g<1>-1 1 1 0 0 0\g<2>")
    found = judge(JudgeRequest(model=negative))
    assert ("inertia", "toes_l") in failed(found)


def test_a_marker_that_moved_is_noticed_and_named(everything, tmp_path):
    moved = re.compile(r'(<Marker name="shank_l.1">.*?<location>)([^<]*)(</location>)', re.DOTALL)

    def shifted(match):
        x, y, z = map(float, match[2].split())
        return f"{match[1]}{x} {y + 0.1} {z}{match[3]}"

    model = edited(everything.model, tmp_path / "model.osim", moved.pattern, shifted)
    found = judge(replace(everything, model=model))
    assert ("ik-marker-largest", "trial") in failed(found)
    worst = max(result_of(found).marker_errors.by_marker.items(), key=lambda one: one[1]["rms_m"])
    assert worst[0] == "shank_l.1"
    assert worst[1]["rms_m"] == pytest.approx(0.1, abs=0.01)


def test_residuals_are_found_in_newtons_and_as_a_share(everything, tmp_path):
    def pushed(name, values):
        return values + 80.0 if name == "pelvis_tx_force" else values

    found = judge(replace(everything, id=with_columns(everything.id, tmp_path / "id.sto", pushed)))
    assert found.residuals.force_peak == pytest.approx(80.0, abs=1.0)
    assert ("residual-force-share", "root") in failed(found)
    share = found.residuals.force_peak / found.gait.peak_force
    assert found.residuals.force_share == pytest.approx(share, rel=0.02)
    assert ("residual-force-peak", "root") not in failed(found)
    found = judge(replace(found.request, reduced=True))
    assert ("residual-force-peak", "root") in failed(found)


def test_a_residual_moment_is_a_vector_whatever_the_pelvis_does(everything, judged_files):
    """Generalised forces of tilted axes; the moment was put in about fixed ones."""
    from opensim_motion import from_opensim

    from gaitval.apps.judge.residuals import residual_wrench
    from gaitval.scaling.opensim.model_file import read_model
    from gaitval.session.opensim.coordinates import OPENSIM_COORDINATES, forces_to_opensim

    model = read_model(everything.model)
    random = np.random.default_rng(2)
    coordinates = random.uniform(-0.6, 0.6, (5, 31))
    wrench = random.normal(0.0, 50.0, (5, 6))
    project = np.hstack([wrench, np.zeros((5, 25))])
    paired = forces_to_opensim(from_opensim(coordinates), project)
    force, moment = residual_wrench(
        model,
        dict(zip(OPENSIM_COORDINATES, coordinates.T, strict=True)),
        dict(zip(OPENSIM_COORDINATES, paired.T, strict=True)),
    )
    turned = wrench.reshape(5, 2, 3)[:, :, [0, 2, 1]] * [1.0, 1.0, -1.0]
    np.testing.assert_allclose(moment, turned[:, 0], atol=1e-6)
    np.testing.assert_allclose(force, turned[:, 1], atol=1e-6)


def test_feet_exchanged_in_the_external_loads_are_noticed(everything, judged_files, tmp_path):
    text = everything.external_loads.read_text()
    swapped = text.replace("calcn_r", "calcn_x").replace("calcn_l", "calcn_r")
    loads = tmp_path / "loads.xml"
    loads.write_text(swapped.replace("calcn_x", "calcn_l"))
    found = judge(replace(everything, external_loads=loads, grf=judged_files / "grf.mot"))
    assert sum("Right and left are exchanged" in one for one in found.findings) == 2


@pytest.mark.parametrize(
    "words", ["<appliesForce>false</appliesForce>", "<isDisabled>true</isDisabled>"]
)
def test_an_external_force_that_does_not_act_is_none(everything, judged_files, tmp_path, words):
    """In the words of OpenSim 4 and 3; OpenSim 4.6 reads both as a force that does not act."""
    loads = tmp_path / "loads.xml"
    first = "<applied_to_body>calcn_r"
    loads.write_text(everything.external_loads.read_text().replace(first, words + first))
    feet = skeleton(read_model(everything.model))
    found = read_loads(judged_files / "grf.mot", loads, feet)
    assert found.sides == ("left",)
    assert len(found.plates) == 1


def test_an_angle_is_beyond_its_range_by_as_much_as_it_is(everything, tmp_path):
    """In degrees, on either side; of a knee, healthy people's, and at its edge by nothing."""
    low, high = np.degrees(RANGES["knee_angle_r"])
    for extreme, beyond in ((high + 7.0, 7.0), (low - 4.0, 4.0), (high, 0.0), (low, 0.0)):

        def reaching(name, values, extreme=extreme):
            if name != "knee_angle_r":
                return values
            middle = np.full_like(values, (low + high) / 2)
            middle[5] = extreme
            return middle

        path = with_columns(everything.ik, tmp_path / "ik.mot", reaching)
        found = judge(JudgeRequest(model=everything.model, ik=path))
        seen = value(found, "angle_beyond_range", "knee_angle_r")
        assert seen == pytest.approx(beyond, abs=1e-6)


def test_coordinates_that_are_not_in_the_motion_are_named(everything, tmp_path):
    lost = {"elbow_flex_r", "elbow_flex_l", "lumbar_bending"}
    table = read_storage(everything.ik)
    kept = [i for i, name in enumerate(table.columns) if name not in lost]
    columns = tuple(table.columns[i] for i in kept)
    path = tmp_path / "ik.mot"
    write_storage(path, StorageTable(columns, table.time, table.values[:, kept], table.in_degrees))
    found = judge(JudgeRequest(model=everything.model, ik=path))
    (message,) = [one for one in found.findings if "nor in the file" in one]
    assert "(3)" in message
    assert all(name in message for name in lost)


# ---- What is given, and what can be judged of it. ----


def test_a_model_alone_is_judged_as_far_as_it_goes(everything):
    found = judge(JudgeRequest(model=everything.model))
    assert failed(found) == set()
    assert any("--ik" in one for one in found.not_judged)
    assert {m.measure for m in found.measures} >= {"inertia_triangle", "mass_share_factor"}
    (message,) = judge(JudgeRequest(model=everything.model, id=everything.id)).not_judged
    assert message.endswith(f"Without it these files are not read: --id {everything.id}.")


def test_without_forces_the_residuals_have_no_share(everything):
    found = judge(replace(everything, external_loads=None))
    assert found.residuals.force_peak < 1.0
    assert any("--grf" in one for one in found.not_judged)
    assert result_of(found).residuals.force_share is None


@pytest.mark.parametrize(
    ("field", "text", "message"),
    [
        ("ik", "Coordinates\nendheader\ntime\tfish\n0\t1\n", "none of the model's coordinates"),
        ("id", "x\nendheader\ntime\tfish\n0\t1\n", "no moment of the model's coordinates"),
        (
            "id",
            "x\nendheader\ntime\tknee_angle_r_moment\n90.00\t1\n90.01\t1\n90.02\t1\n",
            "same trial",
        ),
        ("external_loads", "<OpenSimDocument/>", "no <ExternalLoads>"),
        ("model", "<OpenSimDocument/>", "another version"),
        ("grf", "nothing", "endheader"),
        ("markers", "nothing", "not a TRC file"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(everything, tmp_path, field, text, message):
    path = tmp_path / {"markers": "bad.trc"}.get(field, "bad.xml")
    path.write_text(text)
    with pytest.raises(GaitvalError, match=message) as refused:
        judge(replace(everything, **{field: path}))
    assert refused.value.exit_code == 2


# ---- Bands. ----


def test_the_bands_have_the_signs_of_this_project():
    """A heel strike is followed by hip extension; an ankle pushes off; a knee extends in stance."""
    free = {name: bands()["free", name].middle for name in ("hip_flexion", "ankle_angle")}
    assert free["hip_flexion"][5] < -0.3
    assert free["ankle_angle"].min() < -1.2
    assert 40 < free["ankle_angle"].argmin() < 55
    assert bands()["free", "knee_angle"].middle[10:20].min() < 0.0


def test_a_band_is_one_sd_away_at_its_edge_of_constant_width():
    band = bands()["free", "hip_flexion"]
    assert band.distance(band.middle) == 0.0
    assert band.distance(band.high) == pytest.approx(1.0)


def test_the_shipped_bands_are_those_of_the_raw_data(gait_data):
    from experiments import moment_bands

    source = json.loads((gait_data / "normative/Schwartz2008.json").read_text())
    assert moment_bands.OUT.read_text() == moment_bands.table(source)


# ---- Files, page and command. ----


def test_the_files_follow_the_schema_and_the_page_says_the_verdict(sound, tmp_path):
    result = write_judgement(sound, tmp_path)
    assert result.passed
    stored = json.loads((tmp_path / "judge.json").read_text())
    schema = json.loads(
        (Path(gaitval.apps.judge.__file__).parent / "judge.schema.json").read_text()
    )
    jsonschema.validate(stored, schema)
    page = (tmp_path / "judge.html").read_text()
    assert re.search(r"All \d+ limits kept", page)
    assert re.search(r"<dt>File format</dt><dd>OpenSim \d\.\d+</dd>", page)  # not 40000
    assert (tmp_path / "judge.pdf").read_bytes().startswith(b"%PDF")
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_each_limit_is_said_to_be_what_it_is(sound, tmp_path):
    """Kept, failed, not judged and only shown: on the page, in its headline and in the file."""
    names = {"model-mass", "model-weight", "gyration", "side-angle", "residual-force-peak"}
    names |= {"residual-force-share"}
    chosen = [row for row in load_registry().tolerance if row.id in names]
    for beyond in (False, True):
        measures = [
            measured(
                row.measure, f"{row.applies_to[0]}_l" if row.applies_to else "model",
                row.value + (0.01 if row.limit == "at_most" else -0.01) * beyond,
            )
            for row in chosen
        ]  # fmt: skip
        found = replace(sound, measures=measures, residual_curves=None)
        result = write_judgement(found, tmp_path)
        page = (tmp_path / "judge.html").read_text(encoding="utf-8")
        rows = [each for each in rows_of(page) if len(each.cells) == 6]
        words = {
            "passed": "passed", "FAILED": "FAILED", "not judged": "not judged",
            "shown only": f"{'beyond' if beyond else 'within'}, shown only",
        }  # fmt: skip
        states = {}
        for limit in result.limits:
            mine = [row for row in rows if row.cells[0] == limit.title]
            states.setdefault(limit.verdict, []).append(limit)
            assert {row.cells[-1] for row in mine} <= {words[limit.verdict]}
            for row in mine:
                fails = limit.verdict == "FAILED"
                marks = {"passed": ["pass"], "FAILED": ["fail"]}.get(limit.verdict, [])
                assert (row.failed, [mark for mark, _ in row.marked]) == (fails, marks)
        assert len(rows) == len(names)
        assert ("FAILED" in states, "passed" in states) == (beyond, not beyond)
        assert {"shown only", "not judged"} < set(states)
        marked, sentence = headline(page)
        assert (marked, says(sentence)) == (beyond, "failed" if beyond else "kept")
        assert result.passed is not beyond


def test_names_from_outside_are_escaped(everything, tmp_path):
    text = everything.model.read_text().replace('"shank_l.1"', '"&lt;script&gt;alert(1)"')
    model = tmp_path / "model.osim"
    model.write_text(text.replace('<Model name="', '<Model name="&lt;b&gt;'))
    write_judgement(judge(JudgeRequest(model=model)), tmp_path)
    page = (tmp_path / "judge.html").read_text()
    assert page.count("<script>") == 1  # what copies tables
    assert "&lt;b&gt;" in page


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(cli.app, ["judge", *map(str, arguments)])
    return result.exit_code, result.output


def test_exit_codes_say_fine_failed_and_unusable(everything, tmp_path):
    code, output = run(everything.model, "--out", tmp_path / "fine")
    assert code == 0, output
    assert "0 failed" in output
    code, output = run(everything.model, "--mass", 90, "--out", tmp_path / "failed")
    assert code == 0, "as that of an import whose page shows failed limits"
    strict = run(everything.model, "--mass", 90, "--strict", "--out", tmp_path / "failed")
    assert strict[0] == 1, strict[1]
    assert "FAILED" in output
    assert re.search(r"[\d.]+ %.*≤ 1 %", output)  # value and limit in one unit
    page = (tmp_path / "failed/judge.html").read_text(encoding="utf-8")
    verdict = page[page.index('class="verdict"') : page.index("</section>")]
    assert re.search(
        r"Mass of the model against that of the person \(model\): [\d.]+ %, limit ≤ 1 %", verdict
    )
    code, output = run(tmp_path / "none.osim", "--out", tmp_path / "none")
    assert code == 2
    assert not (tmp_path / "none").exists()
    code, output = run(everything.model, "--mass", 170, "--height", 70, "--out", tmp_path / "x")
    assert code == 2


@pytest.mark.parametrize(
    "wrong", [{"mass": 170.0, "height": 70.0}, {"mass": 7000.0}, {"height": 172.0}]
)
def test_a_person_in_other_units_is_refused_in_python_too(wrong):
    values = "|".join(f"{value:g}" for value in wrong.values())
    with pytest.raises(ConfigurationError, match=values):
        judge(JudgeRequest(Path("model.osim"), **wrong))


def test_half_of_the_moments_is_noticed_at_the_ankle(everything, tmp_path):
    """Their shape is right, and the band of the shape holds them."""

    def halved(column, values):
        return 0.5 * values if column.endswith("_moment") else values

    found = judge(replace(everything, id=with_columns(everything.id, tmp_path / "id.sto", halved)))
    assert {("moment-size", "ankle_angle_r"), ("moment-size", "ankle_angle_l")} <= failed(found)
    whole = judge(everything)
    for side in "rl":
        factor = value(whole, "moment_size_factor", f"ankle_angle_{side}")
        assert 1.0 <= factor < 1.5
        assert ("moment-size", f"ankle_angle_{side}") not in failed(whole)


def test_the_height_of_the_centre_of_mass_is_above_the_plates(sound, judged_files):
    """In a laboratory whose floor is 0.3 m above the origin of its axes."""
    loads = read_loads(None, judged_files / "loads.xml", sound.skeleton)
    up, values = 0.3 * sound.skeleton.model.up, dict(sound.motion.values)
    values["pelvis_ty"] = values["pelvis_ty"] + 0.3
    plates = tuple(
        replace(each, centre_of_pressure=each.centre_of_pressure + up, moment=None)
        for each in loads.plates
    )
    raised = gait.find_gait(
        sound.skeleton, replace(sound.motion, values=values), replace(loads, plates=plates)
    )
    assert raised.height == pytest.approx(sound.gait.height, abs=1e-3)


def test_the_speed_is_known_without_that_of_any_stride(everything, monkeypatch):
    """A foot that is not flat again at the end of the motion has gone no measured way."""
    speed = judge(everything).gait.speed
    measure = gait.spatiotemporal

    def lacking(*given, **named):
        found = measure(*given, **named)
        return replace(found, speed=np.full_like(found.speed, np.nan))

    monkeypatch.setattr(gait, "spatiotemporal", lacking)
    found = judge(everything)
    assert found.gait.speed == pytest.approx(speed, abs=0.03)
    assert not [one for one in found.not_judged if "walking speed" in one]
    assert found.band


# ---- The unit of angles, and verdicts on nothing. ----


@pytest.mark.parametrize(
    ("factor", "in_degrees", "message"),
    [
        (np.pi / 180, True, "inDegrees=no"),
        (1.0, False, "inDegrees=yes"),
        (180 / np.pi, True, "export it again"),
    ],
)
def test_angles_that_cannot_be_of_the_headers_unit_are_refused(
    everything, tmp_path, factor, in_degrees, message
):
    table = read_storage(everything.ik)
    lengths = np.isin(table.columns, ("pelvis_tx", "pelvis_ty", "pelvis_tz"))
    values = np.where(lengths, table.values, table.values * factor)
    write_storage(tmp_path / "ik.mot", replace(table, values=values, in_degrees=in_degrees))
    with pytest.raises(RecordError, match=message) as error:
        judge(JudgeRequest(model=everything.model, ik=tmp_path / "ik.mot"))
    assert "knee_angle" in str(error.value)
    assert str(tmp_path / "ik.mot") in str(error.value)


def test_nothing_judged_is_no_pass(everything, judged_files, tmp_path):
    table = read_storage(judged_files / "ik.mot")
    # One frame held: nobody walks, and no angle is beyond its range.
    still = np.repeat(table.values[:1], len(table.values), axis=0)
    write_storage(tmp_path / "ik.mot", replace(table, values=still))
    code, output = run(everything.model, "--ik", tmp_path / "ik.mot", "--out", tmp_path / "judged")
    assert code == 1, output
    assert "NOT JUDGED" in output
    result = json.loads((tmp_path / "judged/judge.json").read_text())
    assert (result["passed"], result["verdict"]) == (False, "not judged")
    assert "Not judged: what decides" in (tmp_path / "judged/judge.html").read_text()


def test_what_a_reader_passes_over_is_a_sentence(everything, judged_files, tmp_path, recwarn):
    text = (judged_files / "ik.mot").read_text().replace("nRows=", "nRows=9")
    (tmp_path / "ik.mot").write_text(text)
    found = judge(replace(everything, ik=tmp_path / "ik.mot"))
    assert any("count of rows" in one for one in found.findings)
    assert not [each for each in recwarn if issubclass(each.category, RecordWarning)]
