"""Tables of no, one or two rows: each is refused with a sentence that says which file. Those that
an import or a judgement reads are shortened in `tests/robustness`.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from readable_files import command

from gaitval.apps.patients.people import read_people
from gaitval.errors import GaitvalError
from gaitval.gait.electromyograms import read_electromyograms
from gaitval.gait.insoles import read_insoles
from gaitval.mocap.mot import read_device_torques

SAMPLES = Path(__file__).parents[2] / "gaitval" / "samples"


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


def sample(name: str, folder: Path, rows: int) -> Path:
    """A sample whose rows have text in them, below one line of a header."""
    lines = (SAMPLES / name).read_text(encoding="utf-8").splitlines()
    (folder / "few.csv").write_text("\n".join(lines[: rows + 1]) + "\n", encoding="utf-8")
    return folder / "few.csv"


def strides(folder: Path, rows: int) -> None:
    command("patients", sample("strides.csv", folder, rows), "--out", folder / "out")


def people(folder: Path, rows: int) -> None:
    assert len(read_people(sample("people.csv", folder, rows))) == rows


def electromyograms(folder: Path, rows: int) -> None:
    read_electromyograms(storage(folder / "few.sto", rows, ("soleus_r",)))


TABLES: dict[str, Callable[[Path, int], None]] = {
    "insoles, MOT": partial(insoles, ".mot"),
    "insoles, CSV": partial(insoles, ".csv"),
    "devices": devices,
    "strides": strides,
    "people, CSV": people,
    "electromyograms": electromyograms,
}
READ = {*(("people, CSV", rows) for rows in (0, 1, 2)), *(("devices", rows) for rows in (1, 2))}
"""What may have so few rows: people, and torques beside forces that may not."""


@pytest.mark.slow
@pytest.mark.parametrize("rows", [0, 1, 2])
@pytest.mark.parametrize("name", TABLES)
def test_a_table_of_few_rows_is_refused_or_taken_in_words(tmp_path, name, rows):
    if (name, rows) in READ:
        TABLES[name](tmp_path, rows)
        return
    with pytest.raises(GaitvalError, match=r"few|hip_flexion_r"):
        TABLES[name](tmp_path, rows)
