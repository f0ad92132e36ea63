"""A study whose process is long in loading, as where all has to be compiled, and lets no other
thread of it run meanwhile.
"""

import quick_study


def ready():
    """Ten minutes of one call of C."""
    sum(range(60_000_000_000))


work = quick_study.work
