"""The commands that are loaded when they are called, so that `gaitval` starts at once."""

from collections.abc import Callable
from typing import Final

from gaitval.terminal.app import Added


def _body() -> Added:
    from gaitval.cli.body import body

    return body


def _change() -> Added:
    from gaitval.apps.changes.command import change

    return change


def _check() -> Added:
    from gaitval.cli.check import check

    return check


def _cohort() -> Added:
    from gaitval.apps.cohort.command import cohort

    return cohort


def _compare() -> Added:
    from gaitval.cli.compare import compare

    return compare


def _curves() -> Added:
    from gaitval.cli.curves import curves

    return curves


def _data() -> Added:
    from gaitval.cli.data import data

    return data


def _device() -> Added:
    from gaitval.apps.devices.command import device

    return device


def _estimate() -> Added:
    from gaitval.cli.estimate import estimate

    return estimate


def _events() -> Added:
    from gaitval.cli.events import events

    return events


def _export() -> Added:
    from gaitval.apps.export.command import export

    return export


def _history() -> Added:
    from gaitval.apps.regression.history_command import history

    return history


def _imports() -> Added:
    from gaitval.cli.imports import imports

    return imports


def _judge() -> Added:
    from gaitval.apps.judge.command import judge

    return judge


def _live() -> Added:
    from gaitval.apps.live.command import live

    return live


def _locohub() -> Added:
    from gaitval.cli.locohub import locohub

    return locohub


def _markers() -> Added:
    from gaitval.cli.markers import markers

    return markers


def _muscles() -> Added:
    from gaitval.apps.muscles.command import muscles

    return muscles


def _patients() -> Added:
    from gaitval.apps.patients.command import patients

    return patients


def _perturb() -> Added:
    from gaitval.apps.balance.command import perturb

    return perturb


def _predict() -> Added:
    from gaitval.cli.predict import predict

    return predict


def _screen() -> Added:
    from gaitval.apps.virtual.screen_command import screen

    return screen


def _virtual() -> Added:
    from gaitval.apps.virtual.command import virtual

    return virtual


TABLE: Final[dict[str, Callable[[], Added]]] = {
    "body": _body,
    "change": _change,
    "check": _check,
    "cohort": _cohort,
    "compare": _compare,
    "curves": _curves,
    "data": _data,
    "device": _device,
    "estimate": _estimate,
    "events": _events,
    "export": _export,
    "history": _history,
    "imports": _imports,
    "judge": _judge,
    "live": _live,
    "locohub": _locohub,
    "markers": _markers,
    "muscles": _muscles,
    "patients": _patients,
    "perturb": _perturb,
    "predict": _predict,
    "screen": _screen,
    "virtual": _virtual,
}
"""By the name of the command."""
