"""One documented configuration, overridden by a file and by settings; bad values are explained."""

import os
import tomllib
from pathlib import Path

import pytest
import tomli_w
from pydantic import BaseModel, ValidationError

from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import ConfigurationError


def test_settings_override_the_file_and_the_file_the_defaults(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_text("seed = 4\n[training]\nsamples = 1000\nepochs = 2\n")
    configuration = load_configuration(file, settings=["training.samples=500000"])
    assert configuration.seed == 4
    assert configuration.training.samples == 500_000
    assert load_configuration(settings=["training.samples=1e6"]).training.samples == 1_000_000
    assert configuration.training.epochs == 2
    assert configuration.training.batch_size == Configuration().training.batch_size


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("environment.observation=paper", "paper"),
        ('environment.observation="paper"', "paper"),
        ("environment.push_probability = 0.5", 0.5),
        ("validation.start_phases=[0.0, 0.5]", (0.0, 0.5)),
        ("randomisation.friction=[0.7, 0.9]", (0.7, 0.9)),
    ],
)
def test_a_setting_is_written_as_in_toml_or_as_bare_text(setting: str, value: object) -> None:
    section, key = setting.split("=")[0].strip().split(".")
    assert getattr(getattr(load_configuration(settings=[setting]), section), key) == value


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("training.sample=5", r"training\.sample: unknown; the known ones are samples, "),
        ("trainin.samples=5", r"trainin: unknown; the known ones are seed, record, contact, "),
        ("training.samples=0", r"training\.samples: .*from 1 to 1e\+12, auto or full, but it is 0"),
        ("training.samples=many", r"training\.samples: .*auto or full, but it is 'many'"),
        ("environment.observation=all", r"'paper' or 'extended', but it is 'all'"),
        (
            "environment.pace_scale=0.25",
            r"environment: pace_scale 0\.25 x action_limit 4 must be ",
        ),
        ("contact.stiffness=-1", r"contact\.stiffness: .*greater than 0, but it is -1"),
        ("training.samples", r"not of the form section\.key=value, for example --set "),
        ("=5", r"not of the form section\.key=value"),
        ("training=5", r"training: .*but it is 5"),
    ],
)
def test_a_bad_setting_is_named_with_the_value_seen(setting: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message) as raised:
        load_configuration(settings=[setting])
    assert f"--set {setting}" in str(raised.value)
    assert raised.value.exit_code == 2


@pytest.mark.parametrize(
    ("setting", "why", "fix"),
    [
        ("validation.start_phases=[]", "at least 1 item", "The default is [0.0, 0.125"),
        ("validation.start_phases=[nan]", "finite number, but it is nan", "The default is [0.0"),
        ("validation.start_phases=[0.5, 0.5]", "has a phase twice", "give each once"),
        ("pushes.phases=[7.0]", "less than 1, but it is 7.0", "The default is [0.0, 0.25"),
        ("randomisation.damping=[2.0, 0.0]", "[2.0, 0.0] goes down", "lower one first: [0.0, 2.0]"),
        ("randomisation.friction=[0.6, inf]", "finite number, but it is inf", "is [0.6, 1.0]"),
        ("randomisation.friction=[-1.0, 0.5]", "greater than 0, but it is -1.0", "is [0.6, 1.0]"),
        ("environment.push_interval=[2.5, 1.5]", "goes down", "lower one first: [1.5, 2.5]"),
        ("training.difficulty_ramp=[0.7, 0.2]", "goes down", "lower one first: [0.2, 0.7]"),
        ("training.learning_rate=inf", "finite number, but it is inf", "The default is 0.0003"),
        ("training.hidden_units=1000000000", "less than or equal to 4096", "The default is 128"),
        ("training.initial_log_std=1000", "less than or equal to 2", "The default is -1.0"),
        ("training.environments=100000", "12,800,000 samples between updates", "smaller"),
        (f"training.samples={'9' * 400}", "more than 300 digits", "Correct that line"),
        (f"seed={'9' * 5000}", "more than 300 digits", "Correct that line"),
        ("seed=18446744073709551616", "less than or equal to 4294967294", "The default is 0"),
        ("seed=true", "true is for settings that are on or off", "like the default, 0"),
        (f"seed={'[' * 100_000}", "too deep in each other", "Correct that line"),
        ("a.b.c=1", "3 names with dots", "training.samples=500000"),
        ("noise.angle=1e300", "less than or equal to 1000000000", "The default is 0.014"),
        ("noise.angle=1e-300", "all but zero", "give at least 1e-09"),
        ("pushes.step=1e-9", "greater than or equal to 0.1", "The default is 100.0"),
        ("validation.consecutive_cycles=3", "fewer than the 24", "give at least"),
        ("validation.filter_frequency=300", "not below half the 500 Hz", "give a lower one"),
    ],
)
def test_a_setting_that_cannot_work_is_refused_before_any_work(
    setting: str, why: str, fix: str
) -> None:
    """Seen, where, why, and how to fix it; each of these once ended a finished training."""
    with pytest.raises(ConfigurationError) as raised:
        load_configuration(settings=[setting])
    message = str(raised.value)
    assert setting.split("=")[0] in message
    assert why in message
    assert fix in message
    assert len(message) < 6000
    if "phases=[nan]" in setting:
        assert "at least 1 item" not in message  # there is one item; it is another one's fault


@pytest.mark.parametrize("setting", ["randomisation.damping=[1.0, 1.0]", "seed=4294967294"])
def test_the_ends_of_a_range_are_within_it(setting: str) -> None:
    load_configuration(settings=[setting])


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_bytes(b"\xef\xbb\xbfseed = 4\n")
    assert load_configuration(file).seed == 4


def test_a_folder_or_a_pipe_is_not_read_as_a_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"is a folder, but a file is read.*Give the file"):
        load_configuration(tmp_path)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        with pytest.raises(ConfigurationError, match="is a pipe or a device"):
            load_configuration(tmp_path / "pipe")


def test_all_problems_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_text("seeds = 1\n[contact]\nstiffness = 0\n")
    with pytest.raises(ConfigurationError, match=r"(?s)run\.toml.*stiffness.*seeds: unknown"):
        load_configuration(file)


def test_the_stored_form_gives_the_same_configuration(tmp_path: Path) -> None:
    configuration = load_configuration(settings=["seed=9", "validation.start_phases=[0.1]"])
    file = tmp_path / "configuration.toml"
    file.write_text(tomli_w.dumps(configuration.model_dump(mode="json")))
    assert load_configuration(file) == configuration
    assert tomllib.loads(file.read_text())["seed"] == 9


def test_a_configuration_does_not_change() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Configuration().seed = 1


def test_every_section_says_what_it_is_for() -> None:
    for name, field in Configuration.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            assert field.annotation.__doc__, name


def test_the_papers_configuration_is_given_by_its_name():
    """71 numbers; of the reward terms the paper's four with its weights."""
    paper = load_configuration(Path("paper"))
    assert paper.environment.observation == "paper"
    weights = {
        name: value
        for name, value in paper.reward.model_dump().items()
        if not name.endswith("sharpness") and value > 0
    }
    assert weights == {
        "joint_positions": 5.0,
        "centre_of_mass": 2.0,
        "end_effectors": 0.5,
        "torque": 0.005,
    }
    changed = load_configuration(Path("paper"), settings=["reward.torque=0.1"])
    assert (changed.reward.torque, changed.environment.observation) == (0.1, "paper")


def test_an_unknown_name_is_refused_with_the_known_ones(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigurationError, match=r"papr: no such .* built-in one \(paper\)"):
        load_configuration(Path("papr"))
    (tmp_path / "paper").write_text("seed = 3\n")  # a file goes before a name
    assert load_configuration(Path("paper")).seed == 3


def test_one_setting_need_not_be_a_list():
    assert load_configuration(settings="seed=7").seed == 7
