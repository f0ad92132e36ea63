"""Scale a humanoid to a person, learn to walk as they do, and report how accurate the walk is.

`import gaitval as gv` loads nothing but this file. The names below are those of the commands. They
are imported from `gaitval.interface` when they are first used (PEP 562); a stub beside this file
tells type checkers and editors what they are.
"""

from importlib import import_module

__version__ = "0.1.0"

_HOMES = {
    "compare": "walks",
    "import_session": "sessions",
    "inverse_dynamics": "motions",
    "inverse_kinematics": "motions",
    "limits": "limits",
    "load_policy": "walks",
    "load_subject": "subjects",
    "read_recording": "recordings",
    "reference_motion": "references",
    "rollout": "walks",
    "run_study": "studies",
    "scale": "bodies",
    "write_report": "studies",
}
"""Module of `gaitval.interface` that each public name is in."""

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'gaitval' has no attribute {name!r}; it has {__all__}")
    # By a string, not by an import statement: the ground imports from no folder.
    value = getattr(import_module(f"gaitval.interface.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
