"""How the pages of a run folder look: as was last asked for, until something else is."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from gaitval.artefacts import read_toml
from gaitval.errors import ConfigurationError

if TYPE_CHECKING:
    from gaitval.configuration import Configuration

STORED = "configuration.toml"


def with_last_looks(
    configuration: "Configuration", folder: Path, say: Callable[[str], None]
) -> "Configuration":
    """The configuration with language and paper as the run folder was last asked for, where neither
    a file nor an option of this command sets them. No number depends on them, so that settings
    which cannot be read are not worth a refusal: they are written anew.

    Parameters
    ----------
    say : is told what is kept, if that is not what a new folder would have.
    """
    from gaitval.configuration import ReportSettings

    asked = configuration.report
    try:
        stored = read_toml(folder / STORED, ConfigurationError).get("report", {})
        last = ReportSettings.model_validate(stored)
    except (ConfigurationError, ValueError):  # none yet, damaged, or of another gaitval
        return configuration
    kept = {
        name: getattr(last, name)
        for name, field in ReportSettings.model_fields.items()
        if name not in asked.model_fields_set and getattr(last, name) != field.default
    }
    if not kept:
        return configuration
    say(f"report: {', '.join(f'{name} {each}' for name, each in kept.items())}, as last asked for")
    return configuration.model_copy(update={"report": asked.model_copy(update=kept)})
