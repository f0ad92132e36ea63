"""The tables of OpenSim, and how they are written: MOT and STO, which `gaitval.mocap.mot` reads."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from gaitval._internal.io.artefacts import write_text
from gaitval.arrays import Array


@dataclass(frozen=True)
class StorageTable:
    """A table over time: what MOT and STO files contain.

    Attributes
    ----------
    columns : C names, without the time.
    time : (T,) s.
    values : (T, C) in the units of the file.
    in_degrees : whether angles are in degrees.
    name : first line of the file; OpenSim shows it.
    """

    columns: tuple[str, ...]
    time: Array
    values: Array
    in_degrees: bool = False
    name: str = "gaitval"

    def column(self, name: str) -> Array:
        """Values (T,) of one column."""
        return self.values[:, self.columns.index(name)]


def write_storage(path: Path, table: StorageTable) -> None:
    """Write `table`, with values in the units that the reader expects and 12 digits, as the MOT or
    STO file `path` that OpenSim reads, whole or not at all. Raises ArtefactError if it cannot be
    written.
    """
    lines = [
        table.name,
        "version=1",
        f"nRows={len(table.time)}",
        f"nColumns={len(table.columns) + 1}",
        f"inDegrees={'yes' if table.in_degrees else 'no'}",
        "endheader",
        "\t".join(["time", *table.columns]),
    ]
    rows = StringIO()
    np.savetxt(rows, np.column_stack([table.time, table.values]), fmt="%.12g", delimiter="\t")
    write_text(Path(path), "\n".join(lines) + "\n" + rows.getvalue())
