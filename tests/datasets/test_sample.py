"""The line that imports a recording."""

import shlex
from pathlib import Path

from gaitval.subjects.sample import import_line, patients_line


def test_the_line_names_both_files_of_the_folder_and_who_was_recorded():
    about = {"mass_kg": 61.25, "height_m": 1.7, "sex": "F", "belt_m_s": 1.20004, "mu": {}}
    words = shlex.split(import_line(Path("some") / "where", about))
    words.remove("--consistent")
    given = dict(zip(words[2::2], words[3::2], strict=True))
    assert words[:2] == ["gaitval", "import"]
    assert Path(given["--static"]) == Path("some/where/standing.c3d")
    assert Path(given["--trial"]) == Path("some/where/walking.c3d")
    assert (given["--mass"], given["--height"], given["--sex"]) == ("61.25", "1.7", "F")
    assert given["--belt"] == "1.2000"
    assert Path(given["--out"]) == Path("reports/where")  # another folder is another person


def test_a_folder_with_blanks_is_one_word_of_the_line():
    about = {"mass_kg": 61.25, "height_m": 1.7, "sex": "F", "belt_m_s": 1.2}
    words = shlex.split(import_line(Path("Prüfung Müller"), about))
    assert Path(words[words.index("--trial") + 1]) == Path("Prüfung Müller/walking.c3d")
    assert Path(words[words.index("--out") + 1]) == Path("reports/Prüfung Müller")
    words = shlex.split(patients_line(Path("Prüfung Müller")))
    assert Path(words[2]) == Path("Prüfung Müller/strides.csv")
