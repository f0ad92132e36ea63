"""A subject as its title, a small table and a tidy one (`display.Displayed`)."""

from dataclasses import replace
from typing import Literal

import pandas as pd

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import Subject
from gaitval.frames import curve_frame, value_frame
from gaitval.gait.cycle_curves import recorded_curves


def title(subject: Subject) -> str:
    """Name, person and trial of a `subject`, and what was said of a prosthesis or an aid."""
    said = "" if subject.prosthesis is None else f", prosthesis: {subject.prosthesis}"
    said += "" if subject.aid is None else f", aid: {subject.aid}"
    return f"Subject {subject.identifier} ({subject.source}){said}"


def overview(subject: Subject) -> pd.DataFrame:
    """Build and gait of a `subject`, in SI units."""
    stance = {
        side: subject.stance_fraction.of(side)
        if subject.origin(side, "stance") == "recorded"
        else None
        for side in SIDES
    }
    return value_frame(
        [
            ("", "mass", subject.mass_kg, "kg"),
            ("", "height", subject.height_m, "m"),
            ("", "leg length", subject.leg_length_m, "m"),
            ("", "walking speed", subject.walking_speed_m_s, "m/s"),
            ("", "stride time", subject.stride_time_s, "s"),
            *((side, "stance fraction", value, "1") for side, value in stance.items()),
        ]
    ).drop(columns="percent")


def to_frame(subject: Subject) -> pd.DataFrame:
    """Joint angles (deg), joint moments (Nm/kg) and ground reaction (% of body weight) recorded of
    a `subject` at 0, 1, … 100 % of each side's gait cycle. An angle has its coordinate's name
    (`knee_angle`), the moment about it "moment" after that (`knee_angle moment`). A side that
    was not recorded (`origin`) has no rows.
    """
    curves = recorded_curves(subject.record())

    def recorded(values: dict[str, Array], kind: Literal["angles", "kinetics"]) -> dict[str, Array]:
        origin = {side[0]: subject.origin(side, kind) for side in SIDES}
        return {n: v for n, v in values.items() if origin[n[-1]] == "recorded"}

    return curve_frame(
        replace(
            curves,
            angles=recorded(curves.angles, "angles"),
            moments=recorded(curves.moments, "kinetics"),
            forces=recorded(curves.forces, "kinetics"),
        ).named()
    )
