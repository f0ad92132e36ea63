"""The commands that are loaded when they are called, so that `gaitval` starts at once."""

from functools import partial
from typing import Final

from gaitval.cli.terminal.app import Added

_NAMES: Final = (
    *("body", "change", "check", "cohort", "compare", "curves", "data", "device", "estimate"),
    *("export", "judge", "markers", "muscles", "patients", "perturb", "predict"),
)


def _load(name: str) -> Added:
    match name:
        case "body":
            from gaitval.cli.body import body as found
        case "change":
            from gaitval.cli.change import change as found
        case "check":
            from gaitval.cli.check import check as found
        case "cohort":
            from gaitval.cli.cohort import cohort as found
        case "compare":
            from gaitval.cli.compare import compare as found
        case "curves":
            from gaitval.cli.curves import curves as found
        case "data":
            from gaitval.cli.data import data as found
        case "device":
            from gaitval.cli.device import device as found
        case "estimate":
            from gaitval.cli.estimate import estimate as found
        case "export":
            from gaitval.cli.export import export as found
        case "judge":
            from gaitval.cli.judge import judge as found
        case "markers":
            from gaitval.cli.markers import markers as found
        case "muscles":
            from gaitval.cli.muscles import muscles as found
        case "patients":
            from gaitval.cli.patients import patients as found
        case "perturb":
            from gaitval.cli.perturb import perturb as found
        case "predict":
            from gaitval.cli.predict import predict as found
        case _:
            raise KeyError(name)
    return found


TABLE: Final = {name: partial(_load, name) for name in _NAMES}
"""What loads a command, by its name."""
