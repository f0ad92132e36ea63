"""The replay of a walk with devices, which are drawn on it, beside the walk without them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gaitval.apps.devices.curves import CUTOFF
from gaitval.apps.devices.study import DeviceOutcome, Wearer
from gaitval.constants import GRAVITY
from gaitval.metrics.results import Method
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.devices.drawn import drawn
from gaitval.reporting.replay import FRAMES, scene, shown_walk
from gaitval.simulation.rollout import Rollout


def shown_method(person: Wearer, outcome: DeviceOutcome) -> Method:
    """How a walk is shown: after as many strides as everywhere, or from the first if it falls."""
    settings, mass = person.task.configuration.validation, person.task.model.mass
    return Method(
        model_mass_kg=mass,
        gravity_m_s2=GRAVITY,
        body_weight_n=mass * GRAVITY,
        event_threshold_n=person.task.configuration.contact.event_threshold,
        filter_frequency_hz=CUTOFF,
        settling_cycles=0 if outcome.fell else settings.settling_cycles,
        cycles=settings.cycles,
        consecutive_cycles=settings.consecutive_cycles,
        epsilon="",
        external_load="",
    )


def replayed(
    folder: Path, person: Wearer, outcomes: Sequence[DeviceOutcome]
) -> dict[str, Any] | None:
    """What the page's replay shows: the last assumption with a whole stride, with the devices that
    the run `folder` has, and seen through the mean stride without; None without a whole stride.
    """
    without, *others = outcomes
    model: BodyModel = person.task.model

    def walk(outcome: DeviceOutcome, beside: Any) -> Any:
        rollout: Rollout = outcome.walk.rollout
        return shown_walk(model, rollout, shown_method(person, outcome), beside)

    plain = walk(without, np.zeros((FRAMES, without.walk.rollout.positions.shape[1])))
    for outcome in reversed(others):
        beside = None if plain is None else plain.positions.mean(axis=0)
        found = None if beside is None else walk(outcome, beside)
        if found is not None:
            found = replace(found, recorded_body=found.body, known=SEGMENTS)
            return {"scene": scene(found, drawn(folder)), "assumption": outcome.assumption}
    return None
