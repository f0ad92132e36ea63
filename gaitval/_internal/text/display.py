"""What the results of the stages can do: print themselves, become a table, be saved and loaded."""

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

if TYPE_CHECKING:  # it takes long to load, and most commands print no table
    import pandas as pd


class Displayed:
    """A result that prints itself as a title and a small table.

    Its class has the methods `title` and `to_frame`, and `overview` if ranges will not do.
    """

    def title(self) -> str:
        """One line on what this is."""
        raise NotImplementedError

    def overview(self) -> "pd.DataFrame":
        """The small table that is printed: the range of each quantity."""
        from gaitval._internal.text.frames import ranges

        return ranges(self.to_frame())

    def to_frame(self) -> "pd.DataFrame":
        """The values as a tidy table, one row a value (`gaitval._internal.text.frames`)."""
        raise NotImplementedError

    def __repr__(self) -> str:
        shown = self.overview().to_string(index=False, float_format="{:.4g}".format, na_rep="")
        return f"{self.title()}\n{shown}"

    def __str__(self) -> str:
        return repr(self)


class Saved(Displayed):
    """A frozen dataclass of arrays, numbers and names, saved as one npz without pickle."""

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all; what is not an array is JSON in it."""
        from gaitval._internal.io.saved_records import write_record

        values = {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
        arrays = {name: each for name, each in values.items() if isinstance(each, np.ndarray)}
        others = {name: each for name, each in values.items() if name not in arrays}
        write_record(Path(path), type(self).__name__, arrays, others)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError for a missing or damaged file, or one of
        another kind of result.
        """
        from gaitval._internal.io.saved_records import edited, read_record

        arrays, others = read_record(Path(path), cls.__name__)
        try:
            return cls(**arrays, **others)
        except (TypeError, ValueError) as error:
            raise edited(Path(path), error) from None
