"""Stored policies, their walks, and how these compare with a record, from Python."""

from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from gaitval.arrays import Array
from gaitval.artefacts import read_json
from gaitval.configuration import Configuration, RecordSettings, load_configuration
from gaitval.coordinates import ACTUATED, SIDES, split_side
from gaitval.errors import PolicyError, RecordError
from gaitval.gait.record import LowPass, Origin
from gaitval.interface.result import (
    Result,
    angle_curves,
    curve_frame,
    of_kind,
    same_fields,
    sourced_frame,
    value_frame,
)
from gaitval.interface.subjects import MOMENT, Subject, load_subject, named_curves
from gaitval.metrics.comparison import (
    compare_curve,
    low_pass_of,
    recorded_curves,
    simulated_curves,
)
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.origin import curve_origin, is_judged, record_origins
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS
from gaitval.model.urdf import model_hash
from gaitval.policy import storage
from gaitval.policy.rollouts import roll_out
from gaitval.reference.adjustment import Adjustment, adjusted
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation import rollout as simulation
from gaitval.simulation.walker import WalkingTask
from gaitval.study.baseline import STORED_FILES
from gaitval.study.inputs import body_parameters, copy_files
from gaitval.study.run import stored_baseline

Body = Literal["nominal", "identified"]


@dataclass(frozen=True, repr=False)
class Policy(Result):
    """A stored policy with all that it needs to walk.

    Attributes
    ----------
    subject : whom it walks as.
    network : the policy itself.
    configuration : that it was trained and validated with.
    nominal, identified : (14,) body parameters mu, see `gaitval.model.parameters`.
    correction : of the reference, for the identified body.
    folder : that it was read from.
    """

    subject: Subject
    network: storage.Policy
    configuration: Configuration
    nominal: Array
    identified: Array
    correction: Adjustment
    folder: Path

    @cached_property
    def model(self) -> BodyModel:
        """The subject's scaled body model."""
        return scale_subject(self.subject).model

    @cached_property
    def task(self) -> WalkingTask:
        """What it was trained for. The reference motion takes seconds, once."""
        return WalkingTask.of(self.model, self.subject.record(), self.configuration)

    @cached_property
    def corrected_task(self) -> WalkingTask:
        """The task of the identified body with the corrected reference, as it is validated."""
        task = self.task
        if not np.array_equal(self.identified[2:], self.nominal[2:]):  # another body
            record = self.subject.record()
            task = WalkingTask.of(self.model, record, self.configuration, mu=self.identified)
        reference = adjusted(task.reference, task.reference_body, self.correction)
        return replace(task, reference=reference)

    def title(self) -> str:
        """Whose policy, from where."""
        return f"Policy of {self.subject.identifier}, {self.network.hidden_units} hidden units"

    def summary(self) -> pd.DataFrame:
        """The identified body parameters."""
        return self.to_frame()[["quantity", "value", "unit"]]

    def to_frame(self) -> pd.DataFrame:
        """Identified body parameters mu, one row each."""
        units = {"damping": "Nms/rad", "friction": "1"}
        return value_frame(
            ("", name, float(value), units.get(name, "1" if name.endswith("_length") else "m"))
            for name, value in zip(PARAMETERS, self.identified, strict=True)
        )

    def save(self, path: str | Path) -> None:
        """Copy the files of the policy into a folder, each whole or not at all."""
        copy_files(self.folder, Path(path), STORED_FILES[:-1])

    @classmethod
    def load(cls, path: str | Path) -> "Policy":
        """Read what `save` wrote, a run folder or a baseline. Raises PolicyError."""
        folder = Path(path).resolve()
        missing = [name for name in STORED_FILES[:-1] if not (folder / name).is_file()]
        if missing:
            raise PolicyError(
                f"{folder}: {', '.join(missing)} missing, so there is no policy to walk here. Give "
                "a finished run folder, a baseline, or a built-in subject."
            )
        subject = load_subject(folder / "subject.toml")
        configuration = load_configuration(folder / "configuration.toml")
        path = folder / "correction.json"
        return cls(
            subject=subject,
            network=storage.load_policy(
                folder / "policy",
                model_hash=model_hash(scale_subject(subject).model),
                environment=configuration.environment,
            ),
            configuration=configuration,
            nominal=body_parameters(folder / "identification.json", "nominal"),
            identified=body_parameters(folder / "identification.json"),
            correction=Adjustment.from_dict(read_json(path), str(path)),
            folder=folder,
        )


@dataclass(frozen=True, repr=False)
class Rollout(Result, simulation.Rollout):
    """`gaitval.simulation.rollout.Rollout` that prints itself.

    Attributes
    ----------
    walker : name of the subject.
    mass_kg : of the body that walked.
    """

    walker: str
    mass_kg: float

    def title(self) -> str:
        """Who walked, how far."""
        ended = "fell" if self.fell[0] else "did not fall"
        distance = self.centre_of_mass[-1, 0] - self.centre_of_mass[0, 0]
        return f"Walk of {self.walker}: {self.time[-1]:.2f} s, {distance:.2f} m, {ended}"

    def to_frame(self) -> pd.DataFrame:
        """Joint angles (deg) and joint moments (Nm) by time (s)."""
        moments = zip(ACTUATED, self.moments.T, strict=True)
        return curve_frame(
            [
                *angle_curves(self.positions),
                *((of_kind(name, MOMENT), "Nm", values) for name, values in moments),
            ],
            axis="time",
            at=self.time,
        )


@dataclass(frozen=True, repr=False)
class Comparison(Result):
    """Mean curves of a walk and of what it is compared with.

    Attributes
    ----------
    names : of the curves, with the suffix of their side: n.
    units : of each: deg, Nm/kg, % BW.
    walk, other : (n, 101) over each side's gait cycle.
    of, against : who walked, and what that is compared with.
    origins : where the other curve comes from, one a name: "recorded", "mirrored" or "expected";
        None where it is another walk. A difference from what was not recorded is a distance, not
        an error.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    walk: Array
    other: Array
    of: str
    against: str
    origins: tuple[Origin | None, ...] = ()

    def title(self) -> str:
        """What is compared, and what of it is no error because it was not recorded."""
        other = sorted({str(each) for each in self.origins if not is_judged(each)})
        said = f"; {', '.join(other)} curves: distance, not an error" if other else ""
        return f"Walk of {self.of} against {self.against}: RMSE{said}"

    def summary(self) -> pd.DataFrame:
        """RMSE of each quantity, by side."""
        frame = curve_frame(
            (name, unit, np.array([self.rmse(name)]))
            for name, unit in zip(self.names, self.units, strict=True)
        )
        table = frame.pivot_table("value", ["quantity", "unit"], "side", sort=False)
        found = table.reset_index()[["quantity", "right", "left", "unit"]]
        if all(map(is_judged, self.origins)):
            return found
        sides: dict[str, dict[str, str]] = {}
        for name, origin in zip(self.names, self.origins, strict=True):
            if not is_judged(origin):
                side, quantity = split_side(name)
                sides.setdefault(quantity, {})[side] = str(origin)
        said = [sides.get(name, {}) for name in found["quantity"]]
        return found.assign(
            not_recorded=[", ".join(f"{side}: {why}" for side, why in e.items()) for e in said]
        )

    def rmse(self, name: str) -> float:
        """Root mean square difference of one curve over the cycle, in its unit."""
        i = self.names.index(name)
        error = compare_curve(self.walk[i : i + 1], self.other[i])
        assert error is not None
        return error.rmse

    def to_frame(self) -> pd.DataFrame:
        """Both curves, tidy, with a column `source` that says whose each row is."""
        sources = {f"walk of {self.of}": self.walk, self.against: self.other}
        return sourced_frame(
            {
                source: zip(self.names, self.units, curves, strict=True)
                for source, curves in sources.items()
            }
        )


def load_policy(subject_or_folder: str | int | Path) -> Policy:
    """A stored policy with its subject, body parameters and correction.

    Parameters
    ----------
    subject_or_folder : a subject with a stored policy (5, "S05"), a finished run folder, or a
        baseline.

    Returns
    -------
    Policy
        Its body parameters mu are (14,), in the units of `gaitval.model.parameters`.

    Raises
    ------
    PolicyError
        There is no such policy, or it is damaged or for another body.
    SubjectError
        There is no such subject.

    References
    ----------
    V. Kumar, Modelling Human Kinetics and Kinematics during Walking using Reinforcement Learning.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> policy.subject.identifier, policy.identified.shape
    ('S05', (14,))
    """
    if Path(str(subject_or_folder)).is_dir():
        return Policy.load(Path(str(subject_or_folder)))
    identifier = load_subject(subject_or_folder).identifier
    stored = stored_baseline(Path("reports") / identifier, identifier)
    if stored is None:
        raise PolicyError(
            f"{identifier}: no policy is stored for this subject. Run `gaitval subject "
            f"{subject_or_folder}`, and give the run folder."
        )
    return Policy.load(stored)


def rollout(
    policy: Policy,
    *,
    cycles: float = 6.0,
    start_phase: float = 0.0,
    body: Body = "identified",
    push: tuple[float, float, float] | None = None,
) -> Rollout:
    """Let a stored policy walk in DART, without noise.

    Parameters
    ----------
    policy : of `load_policy`. Its reference motion is built by the first rollout and kept with it.
    cycles : planned length, gait cycles.
    start_phase : 0 to 1, of the right gait cycle at the start.
    body : "identified" walks with the identified mu and the corrected reference, as it is
        validated; "nominal" with neither.
    push : see `gaitval.policy.environment.WalkingEnvironment`.

    Returns
    -------
    Rollout
        T samples, SI units, radians, axes x forward, y left, z up.

    Raises
    ------
    PolicyError
        The policy does not fit the body.

    References
    ----------
    Lee et al. (2018), DART, JOSS 3:500; Hunt and Crossley (1975), J. Appl. Mech. 42:440.

    Examples
    --------
    >>> import gaitval as gv
    >>> walk = gv.rollout(gv.load_policy(5), cycles=1)
    >>> bool(walk.fell[0]), walk.positions.shape[1]
    (False, 31)
    """
    found = roll_out(
        policy.corrected_task if body == "identified" else policy.task,
        policy.network,
        mu=getattr(policy, body),
        start_phase=start_phase,
        cycles=cycles,
        push=push,
    )
    shown: Rollout = same_fields(
        Rollout, found, walker=policy.subject.identifier, mass_kg=policy.model.mass
    )
    return shown


def compare(
    walk: Rollout, against: Subject | Rollout, *, configuration: Configuration | None = None
) -> Comparison:
    """Mean curves of a walk against a record, or against another walk.

    Parameters
    ----------
    walk : of `rollout`, with more cycles than settle (`validation.settling_cycles`).
    against : the subject whose record it is compared with, or another walk. Moments and forces
        pass the record's own low-pass filter, or `validation.filter_frequency`.
    configuration : that the policy was validated with; the defaults when not given.

    Returns
    -------
    Comparison
        Mean curves over each side's gait cycle, 101 points: angles in deg, moments in Nm/kg,
        ground reaction in % of body weight.

    Raises
    ------
    RecordError
        A walk has no complete gait cycle after settling.

    References
    ----------
    Winter (2009), Biomechanics and Motor Control of Human Movement, section 3.4.4.2: the filter.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> comparison = gv.compare(gv.rollout(policy, cycles=6), policy.subject)
    >>> comparison.rmse("knee_angle_r") < 4.0  # deg, the limit
    True
    """
    settings = configuration or Configuration()
    frequency = settings.validation.filter_frequency
    filters = LowPass(frequency, frequency)
    origins: tuple[Origin | None, ...]
    if isinstance(against, Subject):
        filters = low_pass_of(against.record(), frequency)
        other = named_curves(recorded_curves(against.record()))
        title = f"the record of {against.identifier}"
        found = record_origins(against, RecordSettings())
        kinds = asdict(recorded_curves(against.record()))
        origins = tuple(curve_origin(kind, name, found) for kind in kinds for name in kinds[kind])
    else:
        other = _mean_curves(against, settings, filters)
        title = f"the walk of {against.walker}"
        origins = (None,) * len(other)
    mine = _mean_curves(walk, settings, filters)
    return Comparison(
        names=tuple(name for name, _, _ in mine),
        units=tuple(unit for _, unit, _ in mine),
        walk=np.stack([values for _, _, values in mine]),
        other=np.stack([values for _, _, values in other]),
        of=walk.walker,
        against=title,
        origins=origins,
    )


def _mean_curves(
    walk: Rollout, settings: Configuration, filters: LowPass
) -> list[tuple[str, str, Array]]:
    cycles = find_cycles(walk, settings)
    if not all(cycles.count(side) for side in SIDES):
        raise RecordError(
            f"The walk of {walk.walker} has no complete gait cycle of both feet after the "
            f"{settings.validation.settling_cycles} that settle. Ask for more cycles."
        )
    curves = simulated_curves(walk, cycles, mass=walk.mass_kg, filters=filters)
    return [(name, unit, values.mean(axis=0)) for name, unit, values in named_curves(curves)]
