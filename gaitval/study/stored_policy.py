"""A stored policy with all that it needs to walk."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from gaitval._internal.io.artefacts import copy_files, read_json, there_below
from gaitval._internal.numba.one_thread import one_thread
from gaitval._internal.text.display import Displayed
from gaitval.arrays import Array
from gaitval.configuration import Configuration, EnvironmentSettings, load_configuration
from gaitval.errors import ConfigurationError, PolicyError
from gaitval.gait.record import GaitRecord
from gaitval.metrics.identified_body import identified_model
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.model.urdf import model_hash
from gaitval.policy.storage import Policy, load_policy, load_start
from gaitval.scaling.scaling import scale_subject
from gaitval.study.inputs import (
    CENTRING,
    POLICY_FILES,
    body_parameters,
    target_record,
    walked_files,
)
from gaitval.study.stage import Run
from gaitval.subjects.prediction.slopes import body_on
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_name, load_subject
from gaitval.walk.reference.adjustment import Adjustment, adjusted
from gaitval.walk.simulation.walker import WalkingTask

if TYPE_CHECKING:
    import pandas as pd

    from gaitval.subjects.prediction.known import KnownRecord
    from gaitval.walk.reference.motion import ReferenceMotion

GENERAL = "general"
"""Folder under `reports/`, and under `baselines/` in the package, of the general policy."""
SLOW: Final = "slow"
"""Folder in it of the policy for slow strides."""
DELAYED: Final = "delayed"
"""Folder in it of the policy that feels its body late."""
SLOW_STRIDE: Final = 6.5
"""√(leg length/g). Longer strides are walked by the policy that learned on them. Of the virtual
people of `experiments/slow_policy.py --try`, the general one walks all 20 up to 6.13 and falls with
6 of 10 from 6.72 on."""


def general_policy(
    record: "GaitRecord | None" = None,
    leg_length_m: float = 1.0,
    environment: EnvironmentSettings | None = None,
) -> Path | None:
    """The stored policy of several people, from which any training may start: for the strides of a
    `record` of legs of `leg_length_m` if it is given, else for usual ones; in an `environment` that
    tells a policy its own past actions, the one that learned to feel its body late.
    """
    from gaitval.gait.dimensionless import time_unit

    package = Path(__file__).parents[1]
    for candidate in (package.parent / "reports" / GENERAL, package / "baselines" / GENERAL):
        if (candidate / POLICY_FILES[0]).is_file():
            if environment is not None and environment.action_memory:
                return candidate / DELAYED
            slow = record and record.stride_time / time_unit(leg_length_m) > SLOW_STRIDE
            return candidate / SLOW if slow else candidate
    return None


@dataclass(frozen=True, repr=False)
class StoredPolicy(Displayed):
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
    network: Policy
    configuration: Configuration
    nominal: Array
    identified: Array
    correction: Adjustment
    folder: Path

    @cached_property
    def model(self) -> BodyModel:
        """The subject's scaled body model, on the ground and with the load that it walked with."""
        scaled = scale_subject(self.subject, symmetric=self.configuration.scaling.symmetric)
        return body_on(scaled.model, self.configuration.record)

    @cached_property
    def identified_model(self) -> BodyModel:
        """The same before mu, with legs that differ by what was found."""
        if self.predicted:
            return self.model
        return identified_model(self.model, read_json(self.folder / "identification.json"))

    @property
    def predicted(self) -> bool:
        """Whether it walks a prediction, for which nothing is identified: mu is nominal."""
        return (self.folder / CENTRING).is_file()

    @cached_property
    def task(self) -> WalkingTask:
        """What it was trained for. The reference motion takes seconds, once."""
        return self._task(self.model)

    @cached_property
    def _target(self) -> "KnownRecord":
        return target_record(Run(self.folder, self.subject, self.configuration), self.model)

    def _task(
        self, model: BodyModel, mu: Array | None = None, near: "ReferenceMotion | None" = None
    ) -> WalkingTask:
        record, accuracy = self._target
        with one_thread():
            task = WalkingTask.of(model, record, self.configuration, accuracy, mu=mu, near=near)
        known = Run(self.folder, self.subject, self.configuration).known_record().record
        return replace(task, record=known)

    @cached_property
    def corrected_task(self) -> WalkingTask:
        """The task of the identified body with the corrected reference, as it is validated."""
        task = self.task
        if not np.array_equal(self.identified[2:], self.nominal[2:]):  # another body
            task = self._task(self.identified_model, self.identified, task.reference)
        reference = adjusted(task.reference, task.reference_body, self.correction)
        return replace(task, reference=reference)

    def title(self) -> str:
        """Whose policy, from where."""
        return f"Policy of {self.subject.identifier}, {self.network.hidden_units} hidden units"

    def overview(self) -> "pd.DataFrame":
        """The identified body parameters."""
        return self.to_frame()[["quantity", "value", "unit"]]

    def to_frame(self) -> "pd.DataFrame":
        """Identified body parameters mu, one row each."""
        from gaitval._internal.text.frames import value_frame

        units = {"damping": "Nms/rad", "friction": "1"}
        return value_frame(
            ("", name, float(value), units.get(name, "1" if name.endswith("_length") else "m"))
            for name, value in zip(PARAMETERS, self.identified, strict=True)
        )

    def save(self, path: str | Path) -> None:
        """Copy the files of the policy into a folder, each whole or not at all."""
        copy_files(self.folder, Path(path), walked_files(self.folder))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote, the folder of a run or a prediction, or a baseline. Raises
        PolicyError.
        """
        folder = Path(path).resolve()
        missing = [name for name in walked_files(folder) if not (folder / name).is_file()]
        if missing:
            raise PolicyError(
                f"{folder}: {', '.join(missing)} missing, so there is no policy to walk here. Give "
                "a finished run folder, a baseline, or a built-in subject."
                f"{there_below(folder, f'policy/{POLICY_FILES[0]}')}"
            )
        subject = load_subject(folder / "subject.toml")
        configuration = load_configuration(folder / "configuration.toml")
        scaled = scale_subject(subject, symmetric=configuration.scaling.symmetric).model
        network = load_policy(
            folder / "policy",
            model_hash=model_hash(body_on(scaled, configuration.record)),
            environment=configuration.environment,
        )
        if (folder / CENTRING).is_file():
            share = read_json(folder / CENTRING)["centring"]
            environment = configuration.environment.model_copy(update={"centring": share})
            configuration = configuration.model_copy(update={"environment": environment})
            nominal = identified = nominal_parameters()
        else:
            nominal, identified = (
                body_parameters(folder / "identification.json", which)
                for which in ("nominal", "identified")
            )
        path = folder / "correction.json"
        return cls(
            subject=subject,
            network=network,
            configuration=configuration,
            nominal=nominal,
            identified=identified,
            correction=Adjustment.from_dict(read_json(path), str(path)),
            folder=folder,
        )


def page_folder(walker: str, identifier: str, of: str) -> Path:
    """Where a page `of` something goes by default: beside the run that was given as a `walker`, so
    that runs of one person keep one each; of another walker, by its `identifier` in reports/.
    """
    given = Path(walker)
    if builtin_name(walker) is None and given.is_dir():
        run = given.parent if given.name == "baseline" else given
        return run.parent / f"{run.resolve().name}-{of}"
    return Path("reports") / f"{identifier}-{of}"


def stored_baseline(folder: Path, identifier: str) -> Path | None:
    """Stored policy, mu and metrics for a run `folder` of the subject `identifier`: its own, the
    checkout's, else the package's.
    """
    package = Path(__file__).parents[1]
    for candidate in (
        folder / "baseline",
        package.parent / "reports" / identifier / "baseline",
        package / "baselines" / identifier,
    ):
        if (candidate / "metrics.json").is_file():
            return candidate
    return None


def general_walker(
    environment: EnvironmentSettings, record: GaitRecord | None = None, leg_length_m: float = 1.0
) -> Policy:
    """The general policy for an `environment`, and a `record` of legs of
    `leg_length_m` as `general_policy` takes them. Raises
    ConfigurationError if there is none.
    """
    folder = general_policy(record, leg_length_m, environment)
    if folder is None:
        raise ConfigurationError(
            "there is no general policy, which walks here. Run this in a checkout of gaitval, "
            "which has one in reports/general."
        )
    return load_start(folder, environment)
