"""`gaitval/Walker-v0` for Gymnasium: learn to walk as a person walks.

Gymnasium 1 finds no environments of other packages by itself. Import this module, which registers
it, or give the module in the name; both do the same:

    import gaitval.apps.export.environment
    gymnasium.make("gaitval/Walker-v0", walker="5")
    gymnasium.make("gaitval.apps.export.environment:gaitval/Walker-v0", walker="5")
"""

from functools import cache
from typing import Any, Final

import gymnasium
import numpy as np
from numpy.typing import NDArray

from gaitval.apps.export.walked import ExportedWalk
from gaitval.policy.environment import WalkingEnvironment

NAME: Final = "gaitval/Walker-v0"

_Seen = NDArray[np.float32]
_Info = dict[str, Any]


@cache
def _walked(walker: str) -> ExportedWalk:
    """The reference of a person takes seconds, so environments of one process share it."""
    return ExportedWalk.of(walker)


class WalkerEnvironment(WalkingEnvironment):
    """The task that a stored walker was validated on, with the identified body.

    Observation, action, reward and the options of `reset` are those of `WalkingEnvironment`. An
    action of zeros follows the reference with the joints' servos alone, and falls within seconds.

    Parameters
    ----------
    walker : subject with a stored policy ("5", "S05"), run folder, or folder of `gaitval export
        --to gymnasium`.
    pushes : whether the pelvis is pushed at random.
    vary_body : whether every episode has another body, drawn as in gaitval's own training; else all
        have the identified one.
    render_mode : None; there is no other.

    Raises
    ------
    PolicyError, SubjectError : there is no such walker.
    """

    def __init__(
        self,
        walker: str = "5",
        *,
        pushes: bool = False,
        vary_body: bool = False,
        render_mode: str | None = None,
    ) -> None:
        found = _walked(walker)
        super().__init__(found.stored.corrected_task)
        self.render_mode = render_mode
        self._defaults: _Info = {} if pushes else {"push": None}
        if not vary_body:
            self._defaults["mu"] = found.mu

    def reset(
        self, *, seed: int | None = None, options: _Info | None = None
    ) -> tuple[_Seen, _Info]:
        """As `WalkingEnvironment.reset`, without push and with the identified body by default."""
        return super().reset(seed=seed, options=self._defaults | (options or {}))


if NAME not in gymnasium.registry:
    gymnasium.register(
        NAME,
        entry_point=f"{__name__}:{WalkerEnvironment.__name__}",
    )
