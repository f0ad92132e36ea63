"""The stages of a study, in the order of `docs/commands.md`."""

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
