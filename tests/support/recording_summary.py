"""Summary of a made-up import, whose curves look like gait."""

from dataclasses import replace

import numpy as np

from gaitval.reporting import recording_report as page
from gaitval.scaling.segments import ScaledSegment

NAN = float("nan")
CHECKLIST = "OpenSim evaluation checklist"

# Amplitude and phase of the first three harmonics (rad, Nm/kg, body weights): shapes that look
# like gait, so that the page can be judged by eye.
ANGLES = {
    "hip_flexion": (0.15, (0.42, 0.1), (0.06, 1.9)),
    "hip_adduction": (0.0, (0.10, -1.2), (0.05, 0.4)),
    "hip_rotation": (0.02, (0.05, 0.8), (0.04, 2.0)),
    "knee_angle": (0.42, (0.33, 2.5), (0.26, -0.6)),
    "ankle_angle": (0.05, (0.10, -1.9), (0.14, 1.1)),
    "subtalar_angle": (-0.02, (0.06, 2.2), (0.03, 0.3)),
    "pelvis_tilt": (0.17, (0.005, 0.3), (0.02, 1.0)),
    "pelvis_list": (0.0, (0.06, -1.4), (0.02, 0.2)),
    "pelvis_rotation": (0.0, (0.07, 0.2), (0.01, 1.3)),
}
MOMENTS = {
    "hip_flexion": (0.0, (0.6, 2.6), (0.2, 1.0)),
    "hip_adduction": (-0.4, (0.4, 2.2), (0.15, -1.0)),
    "knee_angle": (0.05, (0.2, -0.4), (0.25, -2.2)),
    "ankle_angle": (-0.45, (0.6, 0.9), (0.3, -1.3)),
}
FORCES = {
    "forward": (0.0, (0.1, 1.6), (0.12, 1.0)),
    "medial": (0.03, (0.04, -1.5), (0.01, 0.0)),
    "vertical": (0.5, (0.6, -1.8), (0.1, 0.5)),
}


def curves(shapes: dict, spread: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    phase = np.linspace(0, 2 * np.pi, 101)
    made = {}
    for name, (offset, *harmonics) in shapes.items():
        for side, shift in (("r", 0.0), ("l", 0.08)):
            mean = offset + sum(
                size * np.cos((order + 1) * phase + at + shift)
                for order, (size, at) in enumerate(harmonics)
            )
            made[f"{name}_{side}"] = (mean, spread * (1 + 0.4 * np.sin(phase)))
    return made


def sample(**changes: object) -> page.RecordingSummary:
    random = np.random.default_rng(0)
    legs = "GTR Knee Knee.Medial Ankle Ankle.Medial Heel MT1 MT5"
    names = [
        f"{side}.{place}" for side in "RL" for place in f"ASIS PSIS Iliac.Crest {legs}".split()
    ]
    errors = random.gamma(8.0, 0.0014, len(names))
    markers = [
        page.MarkerError(name, rms, rms * 2.1, 1 - 0.01 * (index % 3))
        for index, (name, rms) in enumerate(zip(names, errors, strict=True))
    ]
    time = np.arange(4500) / 150
    strides = np.sin(2 * np.pi * time[:, None] / 1.3 + np.array([0.0, 1.0, 2.0]))
    noise = random.normal(size=(4500, 6))
    made = page.RecordingSummary(
        identifier="WBDS01",
        sex="M",
        mass=74.3,
        height=1.725,
        trial="WBDS01walkT01",
        duration=30.0,
        marker_rate=150.0,
        force_rate=300.0,
        walking_speed=0.49,
        cycles={"right": 21, "left": 20},
        stance_fraction={"right": 0.67, "left": 0.66},
        inputs=[
            page.InputFile("standing trial", "WBDS01static1.c3d", "9f" * 32, 213504),
            page.InputFile("walking trial", "WBDS01walkT01.c3d", "1b" * 32, 4325376),
        ],
        decisions=[
            page.Decision("axes", "x forward, y up, from head over feet and toes before heels"),
            page.Decision("markers", "marker set WBDS: 28 of its 28 markers were found"),
            page.Decision("forces", "plate 1 is the left foot's, plate 2 the right one's"),
        ],
        gates=[
            page.GateRow("Marker error, RMS", 1.21, 2.0, "cm", True, CHECKLIST),
            page.GateRow("Marker error, largest", 3.02, 4.0, "cm", True, CHECKLIST),
            page.GateRow("Residual force, largest", 38.4, 25.0, "N", False, CHECKLIST),
            page.GateRow("Residual moment, RMS", 18.9, 50.0, "Nm", True, CHECKLIST),
        ],
        marker_errors=markers,
        marker_rms_limit=0.02,
        marker_largest_limit=0.04,
        segments=[
            ScaledSegment("pelvis", None, None, 0.1712, 8.71, 1.021,
                          "hip joint centres (Harrington 2007)"),
            ScaledSegment("thigh", 0.4021, None, 0.4021, 10.4, 0.984,
                          "hip to knee joint centre", "right"),
            ScaledSegment("thigh", None, 0.4033, 0.4033, 10.4, 0.987,
                          "hip to knee joint centre", "left"),
            ScaledSegment("trunk", None, None, 0.5210, 32.3, 1.002, "stature"),
        ],
        angles=curves(ANGLES, np.radians(1.8)),
        moments=curves(MOMENTS, 0.06),
        forces=curves(FORCES, 0.03),
        residuals=page.ResidualCurves(
            time, 9 * strides + 5 * noise[:, :3], 12 * strides + 5 * noise[:, 3:], 25.0, 75.0
        ),
        spatiotemporal=[
            page.SpatiotemporalRow("Cadence", "steps/min", (92.1, 1.4), (92.3, 1.2), digits=1),
            page.SpatiotemporalRow("Stride time", "s", (1.301, 0.02), (1.303, 0.021), digits=3),
            page.SpatiotemporalRow("Step length", "m", (0.32, 0.012), (0.318, 0.013), digits=3),
            page.SpatiotemporalRow("Stance", "1", (0.67, 0.01), None, digits=3),
        ],
        changes=[page.ConsistencyChange("residual force, RMS", 11.2, 4.1, "N")],
        repairs=["R.Knee: 2 gaps filled, the longest 0.08 s (rebuilt from its segment).",
                  "L.MT5: 1 spike of 14 mm at 12.35 s removed."],
        left_out=[page.LeftOut("walkT01.c3d", "right", 4.21, "both feet on one plate"),
                  page.LeftOut("walkT01.c3d", "left", 4.86, "both feet on one plate"),
                  page.LeftOut("walkT01.c3d", "left", 28.9,
                               "the trial ends before the next heel strike")],
        versions={"gaitval": "0.3.0", "numpy": "2.2.1"},
    )  # fmt: skip
    return replace(made, **changes)
