"""How the pages of a run folder look: kept until another look is asked for."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from gaitval._internal.io.artefacts import read_toml
from gaitval.errors import ConfigurationError

if TYPE_CHECKING:
    from gaitval.configuration import Configuration

STORED = "configuration.toml"


def with_last_looks(
    configuration: "Configuration", folder: Path, say: Callable[[str], None]
) -> "Configuration":
    """`configuration` with the looks of pages as last used in the run `folder`, where neither a
    file nor an option sets them now. `say` gets a message about what is kept, if it is not the
    default.

    No number depends on them, so unreadable settings are replaced without an error.
    """
    from gaitval.configuration import ReportSettings

    wanted = configuration.report
    try:
        stored = read_toml(folder / STORED, ConfigurationError).get("report", {})
        last = ReportSettings.model_validate(stored)
    except (ConfigurationError, ValueError):  # none yet, damaged, or of another gaitval
        return configuration
    # what is asked for now takes precedence, and a default needs no keeping
    kept = {
        name: getattr(last, name)
        for name, field in ReportSettings.model_fields.items()
        if name not in wanted.model_fields_set and getattr(last, name) != field.default
    }
    if not kept:
        return configuration
    say(f"report: {', '.join(f'{name} {each}' for name, each in kept.items())}, as last asked for")
    return configuration.model_copy(update={"report": wanted.model_copy(update=kept)})
