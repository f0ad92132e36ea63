"""How a stored policy recovers from pushes, slips, trips and steps down, from Python."""

from collections.abc import Sequence

from gaitval._internal.numba.one_thread import one_thread
from gaitval.apps.balance.disturb import Disturbance, Slip, StepDown, Trip, checked, usual_grounds
from gaitval.apps.balance.stored import walker_of
from gaitval.apps.balance.study import Recoveries, recoveries
from gaitval.errors import ConfigurationError
from gaitval.interface.arguments import expect, number
from gaitval.study.stored_policy import StoredPolicy


@one_thread()
def perturb(
    policy: StoredPolicy,
    *,
    pushes: bool = True,
    grounds: Sequence[Disturbance] | None = None,
    delay: float | tuple[float, float, float] = 0.0,
) -> Recoveries:
    """Push a stored policy, let it slip, trip and step down, and compare that with people.

    Parameters
    ----------
    policy : of `load_policy`; it walks with the identified body, as it is validated.
    pushes : whether it is pushed.
    grounds : `Slip`, `Trip` and `StepDown` of `gaitval.apps.balance.disturb`; usual ones if None.
    delay : s, by which it feels its body late; or three, of joints and feet, the balance organ and
        vision.

    Returns
    -------
    Recoveries
        Its `result` is `perturb.json`: steps after each push, m, x forward and y left, changes from
        the undisturbed walk; which starts survive each ground; published quantities beside the
        walker's.

    Raises
    ------
    ConfigurationError
        A ground that cannot be walked on, such as a slip of more than 5 m.
    ArtefactError
        The walker takes no steps on level ground.

    References
    ----------
    Hof et al. (2010), J Exp Biol 213:2655.

    Examples
    --------
    >>> import gaitval as gv
    >>> from gaitval.apps.balance.disturb import Slip
    >>> found = gv.perturb(gv.load_policy(5), pushes=False, grounds=[Slip("right", 0.2, 0.1)])
    >>> found.result.grounds[0].kind, len(found.result.grounds[0].survived)
    ('slip', 5)
    """
    expect("policy", policy, StoredPolicy, "what load_policy(5) returns")
    delays = delay if isinstance(delay, tuple) else (delay,) * 3
    if len(delays) != 3:
        raise ConfigurationError(f"delay is {delay!r:.60}. Give one number or three, s.")
    for each in delays:
        number("delay", each, 0.0, 1.0, "s, 0 to 1")
    for ground in grounds or ():
        expect("grounds", ground, (Slip, Trip, StepDown), "Slip, Trip and StepDown")
    given = usual_grounds() if grounds is None else [checked(each) for each in grounds]
    kinds = ("push", "slip", "trip", "step") if pushes else ("slip", "trip", "step")
    return recoveries(
        policy.subject.identifier,
        walker_of(policy, delays=delays if any(delays) else None),
        kinds=kinds,
        grounds=given,
    )
