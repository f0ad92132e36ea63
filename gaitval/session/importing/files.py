"""Names of the files of an import, for whoever looks into its folder."""

from typing import Final

FOLDER: Final = "recording"
"""Folder, beside `subject.toml`, for everything else."""
SUBJECT: Final = "subject.toml"
RECORD: Final = "import.json"
CYCLES: Final = "cycles.npz"
"""Every cycle of every curve; see `write.cycle_curves`."""
CURVES: Final = "curves.csv"
"""Mean and standard deviation of each curve over the cycles."""
REFUSED: Final = "refused"
