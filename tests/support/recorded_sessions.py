"""The two recorded sessions of the raw data, as a laboratory would import them."""

from pathlib import Path

from gaitval.session.request import Request


def wbds01_t01(gait_data: Path) -> Request:
    """WBDS01 on the treadmill at 0.49 m/s; mass and height of the metadata."""
    raw = gait_data / "wbds" / "raw"
    return Request(
        static=raw / "WBDS01static1.c3d",
        trials=(raw / "WBDS01walkT01.c3d",),
        identifier="WBDS01",
        mass=74.3,
        height=1.725,
        sex="M",
        consistent=True,
    )


def wbds01_overground(gait_data: Path) -> Request:
    """WBDS01 over ground at 1.26 m/s, markers only, with gaps."""
    trials = (gait_data / "wbds" / "raw" / "WBDS01walkO01Cmkr.txt",)
    return wbds01_t01(gait_data).model_copy(
        update={"trials": trials, "kinematics_only": True, "consistent": False}
    )


def rajagopal_walk(gait_data: Path) -> Request:
    """The walk over plates of OpenSim's full-body model; mass and height of its scale set-up."""
    data = gait_data / "opensim_rajagopal" / "ExpData"
    return Request(
        static=data / "static_walk_1.trc",
        trials=(data / "motion_capture_walk.trc",),
        forces=(data / "grf_walk.mot",),
        identifier="Rajagopal",
        mass=85.0668,
        height=1.829,
        sex="M",
        consistent=True,
    )
