"""The line that imports a recording."""

import shlex
from pathlib import Path

from gaitval.datasets.sample import import_line


def test_the_line_names_both_files_of_the_folder_and_who_was_recorded():
    words = shlex.split(import_line(Path("some") / "where", 61.25, 1.7, "F"))
    given = dict(zip(words[2::2], words[3::2], strict=True))
    assert words[:2] == ["gaitval", "import"]
    assert Path(given["--static"]) == Path("some/where/standing.c3d")
    assert Path(given["--trial"]) == Path("some/where/walking.c3d")
    assert (given["--mass"], given["--height"], given["--sex"]) == ("61.25", "1.7", "F")
