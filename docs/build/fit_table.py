"""Write the table in docs/learning.md of how far the fit to Newton's laws is from each record.

It shows the deviations of the fitted reference from the record, RMS over the cycle; moments are
about the hip centres of the record that the fit found. No walker with this body and contact could
improve on all of them at once.
"""

from pathlib import Path

from evidence.marked_table import with_table
from gaitval.datasets.subject_file import BUILTIN, load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.reference_curves import reference_curves
from gaitval.reference.dynamic_fit import consistent_reference
from gaitval.scaling.scaling import scale_subject

PAGE = Path(__file__).parents[2] / "docs" / "learning.md"
SAGITTAL = ("hip_flexion", "knee_angle", "ankle_angle")


def row(name: str) -> str:
    """One line of the table: right / left."""
    subject = load_subject(name)
    model, record = scale_subject(subject).model, subject.record()
    reference = consistent_reference(record, model)
    fitted = by_kind(reference_curves(reference, model.mass, record.left_phase))
    recorded = by_kind(recorded_curves(record))

    def error(kind: str, curve: str) -> float:
        return rms(fitted[kind][curve] - recorded[kind][curve])

    def sides(values: list[float]) -> str:
        return f"{values[0]:.1f} / {values[1]:.1f}"

    moments = [
        " ".join(f"{error('moments', f'{joint}_{side}'):.3f}" for joint in SAGITTAL)
        for side in "rl"
    ]
    cells = [
        name,
        sides([max(error("angles", f"{joint}_{side}") for joint in SAGITTAL) for side in "rl"]),
        sides([error("angles", f"hip_rotation_{side}") for side in "rl"]),
        sides([error("angles", f"pelvis_rotation_{side}") for side in "rl"]),
        " / ".join(moments),
        sides([error("forces", f"vertical_{side}") for side in "rl"]),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the table."""
    lines = [
        "| subject | largest of hip, knee, ankle, ° | hip rotation, ° | pelvis rotation, ° | "
        "moments of hip, knee, ankle, Nm/kg | vertical force, % BW |",
        "|---|---|---|---|---|---|",
        *(row(name) for name in BUILTIN),
    ]
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_table(text, "fit", "\n".join(lines)), encoding="utf-8")


if __name__ == "__main__":
    main()
