"""The table of a cohort: what it may say, and what is refused."""

import time

import pytest

from gaitval.apps.cohort.table import MOST, Study, read_table, with_settings, write_table
from gaitval.errors import ConfigurationError


def written(folder, text, name="table.csv"):
    path = folder / name
    path.write_text(text)
    return path


def test_csv_columns_with_a_dot_are_settings(tmp_path):
    studies = read_table(
        written(
            tmp_path,
            "name,subject,trial,seed,start,training.samples\nyoung,S01,,3,,\n,1,T03,,general,5000\n",
        )
    )
    assert studies == (
        Study(name="young", subject="S01", settings=("seed=3",)),
        Study(name="S01-T03", subject="1", trial="T03", start="general",
              settings=("training.samples=5000",)),
    )  # fmt: skip


def test_toml_has_a_study_for_each_seed(tmp_path):
    studies = read_table(
        written(
            tmp_path,
            "[settings]\ntraining.samples = 5000\n[[studies]]\nsubject = 'S01'\nseeds = [0, 1]\n"
            "settings.identification.method = 'none'\n",
            "t.toml",
        )
    )
    assert [study.name for study in studies] == ["S01", "S01-s1"]
    assert studies[1].settings == (
        "training.samples=5000", 'identification.method="none"', "seed=1",
    )  # fmt: skip


def test_paths_are_relative_to_the_table(tmp_path):
    studies = read_table(
        written(
            tmp_path,
            "name,subject,static,trials,sex,mass\na,me.toml,,,,\nb,,s.c3d,w1.c3d;w2.c3d,F,63.2\n",
        )
    )
    assert studies[0].subject == str(tmp_path / "me.toml")
    assert studies[1].recording == {
        "static": str(tmp_path / "s.c3d"),
        "trials": [str(tmp_path / "w1.c3d"), str(tmp_path / "w2.c3d")],
        "sex": "F",
        "mass": 63.2,
    }


def test_what_is_written_is_read_again(tmp_path):
    studies = read_table(
        written(
            tmp_path,
            "name,subject,static,trials,sex,mass,virtual,around,trial,seed\n"
            "a,5,,,,,,,T03,2\nb,,s.c3d,w.c3d,F,63.2,,,,\nc,,,,,,4,8,,\n",
        )
    )
    write_table(tmp_path / "again.toml", studies)
    assert read_table(tmp_path / "again.toml") == studies


def test_a_policy_is_relative_to_the_table(tmp_path):
    (study,) = read_table(written(tmp_path, "subject,policy\n5,walkers\n"))
    assert study.policy == str(tmp_path / "walkers")


def test_settings_of_the_command_give_way_to_those_of_a_row(tmp_path):
    (study,) = with_settings([Study(name="a", subject="5", settings=("seed=1",))], ["seed=9"], "c")
    assert study.settings == ("seed=9", "seed=1")
    assert study.config == "c"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,seed\na,1\n", "give one of subject, recording .* this one has none"),
        ("subject,virtual\n5,1\n", "this one has subject and virtual"),
        ("subject\n5\n5\n", "S05: more than one study of this name"),
        ("subject,start\n5,cold\n", "line 2: start: input should be 'general' or 'scratch'"),
        ("subject,colour\n5,red\n", "colour: extra inputs are not permitted"),
        ("subject,name\n5,../up\n", "name: string should match"),
        ("subject,seed\n5\n", "not as many cells"),
        ("subject\n", "no study in this table"),
        (
            "static,trials,sex,mass\ns.c3d,w.c3d,F,heavy\n",
            "mass = 'heavy': input should be a valid number",
        ),
    ],
)
def test_a_wrong_table_is_refused(tmp_path, text, message):
    with pytest.raises(ConfigurationError, match=message):
        read_table(written(tmp_path, text))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("t.xlsx", "", "a .csv or a .toml file, not .xlsx"),
        ("t.toml", "a = 1", "this one has a"),
        ("t.toml", "studies = [1]", "study 1: not a table"),
        ("t.toml", "[[studies]]\nrecording = 3", "recording: not a table"),
        ("t.toml", "[[studies]]\nvirtual = 3", "virtual: not a table"),
        ("t.toml", "[[studies]]\nvirtual.number = 'x'", "virtual.number: input should be a valid"),
        ("t.csv", None, "no such file"),
        ("t.csv", "name,subject\na," + "x" * 200_000, "cannot be read as CSV"),
    ],
)
def test_a_wrong_file_is_refused(tmp_path, name, text, message):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(ConfigurationError, match=message):
        read_table(path)


def test_devices_and_a_search_are_columns_and_tables(tmp_path):
    exo = {"name": "hip_exo", "search": {"joint": "hip_flexion", "quantity": "pushes"}}
    text = "subject,device,search\n1,hip_exo,hip_flexion pushes\n2,afo;mine.toml,\n3,,\n"
    first, second, third = read_table(written(tmp_path, text))
    assert first.devices == (exo,)
    assert second.devices == ("afo", str(tmp_path / "mine.toml"))
    assert third.devices == ()
    rows = "[[studies]]\nsubject = '1'\ndevices = [{ name = 'hip_exo', search = "
    rows += "{ joint = 'hip_flexion', quantity = 'pushes' } }, 'mine.toml']\n"
    (study,) = read_table(written(tmp_path, rows, "t.toml"))
    assert study.devices == (exo, str(tmp_path / "mine.toml"))
    write_table(tmp_path / "again.toml", [study])
    assert read_table(tmp_path / "again.toml")[0].devices == study.devices


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("subject,search\n1,hip_flexion work\n", "line 2: a search without a device.*hip_exo"),
        ("subject,device,search\n1,hip_exo,the best of all\n", "no joint and quantity"),
    ],
)
def test_a_search_that_cannot_be_is_refused(tmp_path, text, says):
    with pytest.raises(ConfigurationError, match=says):
        read_table(written(tmp_path, text))


@pytest.mark.parametrize("kind", ["toml", "csv"])
def test_more_studies_than_a_report_holds_are_refused_at_once(tmp_path, kind):
    path = tmp_path / f"table.{kind}"

    def write(count):
        rows = "".join(f"S05,{seed}\n" for seed in range(count))
        listed = f'[[studies]]\nsubject = "S05"\nseeds = {list(range(count))}\n'
        path.write_text(listed if kind == "toml" else f"subject,seed\n{rows}")

    write(300_000)
    began = time.process_time()
    with pytest.raises(ConfigurationError, match=rf"{kind}: more than {MOST} studies.*--out"):
        read_table(path)
    assert time.process_time() - began < 15.0
    write(30)
    assert len(read_table(path)) == 30
