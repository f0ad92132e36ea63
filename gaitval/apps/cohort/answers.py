"""What a worker says of a study, and what a study leaves for the tables: read like user input.

A worker's answer is JSON, and so are the files of a store: nothing of them is unpickled. Whatever
is not of these types is no answer, and the study counts as one that failed, or runs again.
"""

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from gaitval.metrics.verdict_counts import Summary

Short = Annotated[str, Field(max_length=1000)]
_Number = Annotated[int | float, Field(allow_inf_nan=False)] | None
_Count = Annotated[int, Field(ge=0)]


class _Read(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class StudyOutcome(_Read):
    """What became of a study; see `task.run_order`."""

    name: Short
    fingerprint: Short
    status: Literal["finished", "refused", "fault", "lost"]
    reason: Annotated[str, Field(max_length=100_000)]
    seconds: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    peak_memory: _Count
    worker: Short


class _Subject(_Read):
    identifier: Short
    laboratory: Short | None
    person: Short
    trial: Short
    source: Short
    sex: Short
    age: _Number
    mass: _Number
    height: _Number
    leg_length: _Number
    speed: _Number


class _Verdicts(Summary):
    """The counts of the metrics, what failed, and what could not be judged."""

    model_config = _Read.model_config

    failed: list[Short]
    not_judged: Short = ""


class _Measure(_Read):
    measure: Short
    target: Short
    unit: Short
    value: _Number


class _Group(_Read):
    group: Short
    unit: Short
    rmse: _Number
    skill: _Number


class _Parameter(_Read):
    parameter: Short
    nominal: _Number
    prior_sd: _Number
    mean: _Number
    sd: _Number
    identified: bool | _Number
    verdict: Short
    unit: Short = ""  # of studies before it was written


class _Limit(_Read):
    quantity: Short
    target: Short
    value: _Number
    limit: _Number
    unit: Short
    verdict: Short


class _Device(_Read):
    quantity: Short
    of: Short
    unit: Short
    value: _Number


class StudySummary(_Read):
    """What the tables hold of a study; see `apps.cohort.study.summary_of`."""

    subject: _Subject
    verdicts: _Verdicts
    measures: list[_Measure]
    groups: list[_Group]
    parameters: list[_Parameter]
    epsilon: _Number
    limits: list[_Limit] = []
    devices: list[_Device] = []
    record: Short = ""
    settings: Short = ""


LONGEST: Final = 1_000_000
"""Characters of a worker's answer."""


def outcome_of(answer: Any, name: str, fingerprint: str) -> dict[str, Any]:
    """The outcome that a worker has sent of the study `name` with its `fingerprint`, as JSON.
    Raises ValueError if `answer` is none, or of another study.
    """
    if not isinstance(answer, str) or len(answer) > LONGEST:
        raise ValueError("the worker's answer is no text, or too long")
    found = StudyOutcome.model_validate_json(answer)
    if (found.name, found.fingerprint) != (name, fingerprint):
        raise ValueError("the worker's answer is of another study")
    return found.model_dump()
