"""Tables of no, one or two rows, through the commands and readers that take them: each is refused
with a sentence that says which file, whatever its format.
"""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from readable_files import _PERSON, Kind, _curves, command, kinds

from gaitval.apps.patients.people import read_people
from gaitval.errors import GaitvalError
from gaitval.gait.electromyograms import read_electromyograms
from gaitval.gait.insoles import read_insoles
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.mot import read_device_torques
from gaitval.mocap.recording import Recording

pytestmark = pytest.mark.slow
SAMPLES = Path(__file__).parents[2] / "gaitval" / "samples"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan", re.IGNORECASE)


def is_row(line: str) -> bool:
    """Whether a line of a text is a row of numbers: two at least."""
    cells = [cell.strip() for cell in re.split(r"[\t,; ]+", line.strip())]
    return len(cells) > 1 and all(_NUMBER.fullmatch(cell) for cell in cells if cell)


def shortened(text: str, rows: int) -> str:
    """A table as text with the first of its rows only; where a format has several tables, of each.
    A header that counts rows says so many.
    """
    kept, count = [], 0
    for line in text.splitlines():
        count = count + 1 if is_row(line) else 0
        if count <= rows:
            kept.append(line)
    found = "\n".join(re.sub(r"^(nRows|datarows)([= ])\d+", rf"\g<1>\g<2>{rows}", k) for k in kept)
    return re.sub(r"(?m)^(NO_OF_FRAMES|NO_OF_SAMPLES)\t\d+", rf"\1\t{rows}", found) + "\n"


def trc_counted(text: str, rows: int) -> str:
    """The third line of TRC counts the frames, in two cells."""
    lines = text.split("\n")
    cells = lines[2].split("\t")
    cells[2] = cells[7] = str(rows)
    return "\n".join([*lines[:2], "\t".join(cells), *lines[3:]])


def by_line(text: str, rows: int) -> str:
    """A table whose rows have text in them, below one line of a header."""
    return "\n".join(text.splitlines()[: rows + 1]) + "\n"


def cut(path: Path, rows: int, how: Callable[[str, int], str] = shortened) -> None:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".trc":
        # its header has rows of numbers, too
        head = text.split("\n")[:6]
        body = [line for line in text.split("\n")[6:] if line.strip()][:rows]
        path.write_text(trc_counted("\n".join([*head, *body, ""]), rows), encoding="utf-8")
        return
    path.write_text(how(text, rows), encoding="utf-8")


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Kind]:
    return kinds(tmp_path_factory.mktemp("files"))


TABLES = {
    **{"trc": "walk.trc", "mot": "walk_forces.mot", "vicon_csv": "v.csv"},
    **{"qualisys_tsv": "walk.tsv", "qualisys_forces": "walk_f_2.tsv"},
    **{"motion_analysis": "v.forces", "kistler_text": "k.txt", "wbds": "walkmkr.txt"},
    **{"opencap": "OC/MarkerData/walk1.trc", "curves_csv": "curves.csv"},
    **{"judged_motion": "ik.mot", "judged_moments": "id.sto", "judged_forces": "grf.mot"},
    **{"judged_markers": "walk.trc", "training_log": "training.csv"},
}
"""The table that is cut, by the kind of `tests/robustness`, which says how it is read."""
READ_ALONE = ("opencap", "training_log")
"""Kinds that are read for other things than their rows."""


@pytest.mark.parametrize("rows", [0, 1, 2])
@pytest.mark.parametrize("kind", TABLES)
def test_a_table_of_few_rows_is_refused_or_taken_in_words(
    tmp_path: Path, sources: dict[str, Kind], kind: str, rows: int
) -> None:
    made = sources[kind]
    for name, content in made.seeds.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    file = tmp_path / TABLES[kind]
    cut(file, rows)
    if kind in READ_ALONE:
        made.run(tmp_path)
        return
    with pytest.raises(GaitvalError) as refused:
        made.run(tmp_path)
    message = " ".join(str(refused.value).split())
    assert message.endswith(".")
    assert file.stem in message or "cycle" in message or f" {rows} and 720 samples" in message


def storage(path: Path, rows: int, names: tuple[str, ...]) -> Path:
    """A table over time, at 100 Hz."""
    lines = [path.stem, f"nRows={rows}", f"nColumns={len(names) + 1}", "inDegrees=no", "endheader"]
    lines += ["\t".join(("time", *names))]
    lines += [
        "\t".join(f"{x:g}" for x in (0.01 * i, *range(1, len(names) + 1))) for i in range(rows)
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def insoles(suffix: str, folder: Path, rows: int) -> None:
    path = storage(folder / "few.mot", rows, ("right", "left"))
    if suffix == ".csv":
        path = folder / "few.csv"
        lines = ["time,right,left", *(f"{0.01 * i:g},300,400" for i in range(rows))]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    read_insoles(path, mass=60.0, stride_time=1.1, error=0.02, columns=("right", "left"))


def devices(folder: Path, rows: int) -> None:
    names = tuple(f"knee_r_device_{kind}{x}" for kind in "mv" for x in "xyz")
    read_device_torques(storage(folder / "few.mot", rows, names))


def c3d(option: str, folder: Path, rows: int) -> None:
    """A C3D with so many frames; without any its header promises one."""
    seen = Recording("few", "laboratory", ("RASI", "LASI"), np.ones((max(rows, 1), 2, 3)), 100.0)
    path = folder / "few.c3d"
    write_c3d(path, seen)
    if rows == 0:
        path.write_bytes(path.read_bytes()[:-512])
    given = {"--static": folder / "stand.c3d", "--trial": folder / "walk.trc", option: path}
    words = [word for name, file in given.items() for word in (name, file)]
    command("import", *words, *_PERSON, "--out", folder / "out")


def strides(folder: Path, rows: int) -> None:
    text = (SAMPLES / "strides.csv").read_text(encoding="utf-8")
    (folder / "few.csv").write_text(by_line(text, rows), encoding="utf-8")
    command("patients", folder / "few.csv", "--out", folder / "out")


def people(folder: Path, rows: int) -> None:
    text = (SAMPLES / "people.csv").read_text(encoding="utf-8")
    (folder / "few.csv").write_text(by_line(text, rows), encoding="utf-8")
    assert len(read_people(folder / "few.csv")) == rows


def wbds(name: str, folder: Path, rows: int) -> None:
    (folder / name).write_text(
        "%Cycle\tRHipAngleX\n" + "".join(f"{i}\t1\n" for i in range(rows)), encoding="utf-8"
    )
    _curves(folder, name)


def session(folder: Path, rows: int) -> None:
    person = '[[people]]\nname = "P{}"\nsex = "F"\ntrials = ["none.c3d"]\n'
    text = "".join(person.format(i) for i in range(rows)) or "people = []\n"
    (folder / "few.toml").write_text(text, encoding="utf-8")
    command("import", folder / "few.toml", "--out", folder / "out")


def cohort(folder: Path, rows: int) -> None:
    text = "name,subject\n" + "".join(f"a{i},few-nobody\n" for i in range(rows))
    (folder / "few.csv").write_text(text, encoding="utf-8")
    command("cohort", folder / "few.csv", "--out", folder / "out")


def electromyograms(folder: Path, rows: int) -> None:
    read_electromyograms(storage(folder / "few.sto", rows, ("soleus_r",)))


MORE: dict[str, Callable[[Path, int], None]] = {
    "insoles, MOT": partial(insoles, ".mot"),
    "insoles, CSV": partial(insoles, ".csv"),
    "devices": devices,
    "standing C3D": partial(c3d, "--static"),
    "walking C3D": partial(c3d, "--trial"),
    "strides": strides,
    "people, CSV": people,
    "WBDS angles": partial(wbds, "fewang.txt"),
    "WBDS moments": partial(wbds, "fewknt.txt"),
    "session": session,
    "cohort": cohort,
    "electromyograms": electromyograms,
}  # fmt: skip
READ = {
    *(("people, CSV", rows) for rows in (0, 1, 2)),
    *(("devices", rows) for rows in (1, 2)),
}
"""What may have so few rows: people, a standing pose, and torques beside forces that may not."""


@pytest.fixture(scope="module")
def files(sources: dict[str, Kind]) -> dict[str, bytes]:
    return {
        name: content
        for kind in ("trc", "judged_motion")
        for name, content in sources[kind].seeds.items()
        if kind == "trc" or name != "walk.trc"
    }


@pytest.mark.parametrize("rows", [0, 1, 2])
@pytest.mark.parametrize("name", MORE)
def test_a_table_of_another_kind_with_few_rows(
    tmp_path: Path, files: dict[str, bytes], name: str, rows: int
) -> None:
    for each, content in files.items():
        (tmp_path / each).write_bytes(content)
    if (name, rows) in READ:
        MORE[name](tmp_path, rows)
        return
    with pytest.raises(GaitvalError) as refused:
        MORE[name](tmp_path, rows)
    message = " ".join(str(refused.value).split())
    assert re.search("few|cycle|none.c3d: no such file|WBDS09|hip_flexion_r", message), message
