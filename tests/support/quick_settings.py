"""Settings of a main job that takes seconds, and of pages."""

WORDS = ("report.pdf=false", "report.figures=false")
"""Pages of words and tables, without what most of their time goes to."""
WITH_WORDS = tuple(word for each in WORDS for word in ("--set", each))
"""The same for a command."""
QUICK = (
    *WORDS,
    *("training.samples=1024", "training.environments=8", "training.rollout_steps=64"),
    *("training.workers=1", "identification.rounds=1", "identification.method=none"),
    *("correction.steps=0", "validation.start_phases=[0.0]"),
    *("validation.cycles=2", "validation.settling_cycles=1", "validation.consecutive_cycles=3"),
    *(
        "pushes.phases=[0.0]",
        "pushes.directions=1",
        "pushes.required_directions=1",
        "pushes.cycles=1",
    ),
    *("pushes.step=600", "pushes.resolution=600"),
)
"""Every stage of the main job, none of it long enough for a good walk."""
PAGES = ("report.pdf=true", "report.figures=true")
"""After those of `QUICK`: the report is as usual."""
