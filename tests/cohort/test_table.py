"""The table of a cohort: what a row becomes, and what is refused."""

import pytest

from gaitval.apps.cohort.table import MOST, read_table
from gaitval.errors import ConfigurationError


@pytest.fixture
def table(tmp_path):
    def written(text):
        path = tmp_path / "table.csv"
        path.write_text(text, encoding="utf-8")
        return read_table(path)

    return written


def test_a_row_is_a_study(table, tmp_path):
    first, second, third, fourth = table(
        "name,subject,trial,seed,start,training.samples\n"
        "young,S01,T03,,scratch,1000000\n"
        ",5,,,,\n"
        ",,,,,\n"
        ",2,T01,3,,\n"
        ",lab/P01/subject.toml,,,,\n"
    )
    assert first.model_dump() == {
        "name": "young",
        "subject": "S01",
        "trial": "T03",
        "start": "scratch",
        "settings": ("training.samples=1000000",),
    }
    assert (second.name, second.start, second.settings) == ("S05", "general", ())
    assert (third.name, third.settings) == ("S02-T01-s3", ("seed=3",))
    assert (fourth.name, fourth.subject) == ("P01", str(tmp_path / "lab/P01/subject.toml"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no study"),
        ("subject\n", "no study"),
        ("subject\n" + "5\n" * (MOST + 1), f"more than {MOST}"),
        ("subject,seed\n5\n", "line 2: not as many cells"),
        ("subject\n5\n5\n", "two studies are called S05"),
        ("name,trial\na,T01\n", "line 2: no subject"),
        ("subject,store\n5,s3://a\n", "line 2: store"),
        ("subject,start\n5,middle\n", "line 2: start.*general"),
        ("subject,name\n5,../out\n", "line 2: name"),
    ],
)
def test_what_cannot_be_run_is_refused_with_its_line(table, text, said):
    with pytest.raises(ConfigurationError, match=said):
        table(text)
