"""Settings of a main job that takes seconds."""

QUICK = (
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
