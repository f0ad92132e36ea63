"""What walking costs, from Python."""

from pathlib import Path

from gaitval.configuration import Configuration
from gaitval.errors import RecordError
from gaitval.interface.muscle_forces import motions_of
from gaitval.kinetics.musculature.gait import muscles_of
from gaitval.quantities.metabolic_cost import MetabolicCost
from gaitval.quantities.metabolic_cost import metabolic_cost as cost_of
from gaitval.session.importing.stored import Session
from gaitval.study.stored_policy import StoredPolicy
from gaitval.walk.simulation.simulated_walk import SimulatedWalk


def metabolic_cost(
    of: Session | SimulatedWalk | str | Path,
    *,
    policy: StoredPolicy | None = None,
    bands: bool = False,
    configuration: Configuration | None = None,
) -> MetabolicCost:
    """Metabolic rate of a walk, by models of the muscles and of the joints.

    Parameters
    ----------
    of : of `import_session`, a walk of `rollout`, or the folder of an import or a run.
    policy : whose walk it is, if it is one.
    bands : whether the band has what muscles are uncertain by, too, by 200 draws.
    configuration : that the walk was made with; the defaults when not given.

    Returns
    -------
    MetabolicCost
        `gross` W/kg by model, `net(model)`, `per_metre(model)` J/kg/m, `band()` of 90 %, which
        includes the choice of the model.

    Raises
    ------
    ConfigurationError
        An argument of another kind, or a walk without its policy.
    RecordError
        The moments of no leg are known over a gait cycle, or a leg is not whole.
    ArtefactError
        The folder has neither an import nor a walk.

    References
    ----------
    Bhargava et al. (2004), J Biomech 37:81. Umberger (2010), J R Soc Interface 7:1329. Uchida et
    al. (2016), PLoS ONE 11:e0150378.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> cost = gv.metabolic_cost(gv.rollout(policy, cycles=8), policy=policy)
    >>> bool(2.5 < cost.middle < 6.0)  # W/kg
    True
    """
    motions = motions_of(of, policy, configuration)
    found = cost_of(motions, muscles_of(motions, draws=200 if bands else 0))
    if found is None:
        raise RecordError(
            f"{motions[0].name}: no metabolic rate, for no gait cycle is whole, or a "
            "prosthesis has a part of a leg, which no muscle moves. Give a trial with a whole "
            "cycle of a person with two legs."
        )
    return found
