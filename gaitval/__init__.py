"""Scale a humanoid to a person, learn to walk as they do, and report how accurate the walk is.

`import gaitval as gv` loads only this file and `current_folder`. The names below match the
commands. They are imported from `gaitval.interface` on first use (PEP 562); a stub beside this file
describes them to type checkers and editors.
"""

import sys

# `python -m` takes modules, Python's own among them, from the current folder first. This is seen
# while Python looks for the module that it shall run, before gaitval loads anything else.
if sys.argv[:1] == ["-m"] and not sys.flags.safe_path:
    sys.stderr.write(
        "gaitval: python -m takes modules from the current folder first, so a file there could run "
        "as a part of gaitval. Use the command gaitval, or python -P -m gaitval.\n"
    )
    raise SystemExit(2)

from importlib import import_module

from gaitval._internal.io.current_folder import ignore as _ignore_current_folder

__version__ = "0.10.0"

_HOMES = {
    "against_healthy": "changes",
    "change": "changes",
    "compare": "walks",
    "import_session": "sessions",
    "inverse_dynamics": "motions",
    "inverse_kinematics": "motions",
    "limits": "limits",
    "load_policy": "walks",
    "load_subject": "subjects",
    "metabolic_cost": "metabolic",
    "muscles": "muscle_forces",
    "perturb": "balance",
    "read_recording": "recordings",
    "reference_motion": "references",
    "rollout": "walks",
    "run_study": "studies",
    "scale": "bodies",
    "write_report": "studies",
}
"""The module of `gaitval.interface` that contains each public name."""

__all__ = sorted(_HOMES)

_ignore_current_folder()


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'gaitval' has no attribute {name!r}; it has {__all__}")
    # By a string, not an import statement: modules at this level import from no folder.
    value = getattr(import_module(f"gaitval.interface.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
