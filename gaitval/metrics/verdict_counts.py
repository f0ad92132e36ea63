"""How many verdicts a study has, by what became of them.

Apart from the rest of `results`, which loads all that is computed of a walk: a cohort's workers
read no more than this of a study.
"""

from gaitval.metrics.typed import Count, Result


class Summary(Result):
    """Of the rows of role acceptance: passed, not passed, with a goal, with the goal reached."""

    accepted: Count
    refused: Count
    not_shown: Count = 0
    """Of those refused: not nearer than the best guess, but by no more than walks differ."""
    guess_judged: Count = 0
    """Rows on which the best guess without a model could be judged in the place of the walk."""
    guess_passes: Count = 0
    """Of those, rows that it would pass."""
    guess_within: Count = 0
    """Of those, rows whose limit alone it would keep."""
    goals: Count
    goals_reached: Count
