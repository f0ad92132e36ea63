"""The stages of a study, in the order of the README."""

STAGES = (
    "scale",
    "reference",
    "train",
    "identify",
    "correct",
    "simulate",
    "push",
    "validate",
    "report",
)
