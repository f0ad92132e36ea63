"""Muscle forces and joint contact forces, from Python."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from gaitval.apps.muscles.sharing import MuscleSettings, shared_motions
from gaitval.apps.muscles.sources import motions_in
from gaitval.configuration import Configuration
from gaitval.coordinates import Side
from gaitval.errors import ConfigurationError
from gaitval.interface.arguments import expect
from gaitval.kinetics.musculature.gait import DEFAULT, LoadedMotion, MuscleGait
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.walk_muscles import lost_joints, person_and_laden, walk_motion
from gaitval.session.importing.stored import Session
from gaitval.study.stored_policy import StoredPolicy
from gaitval.walk.simulation.simulated_walk import SimulatedWalk


def muscles(
    of: Session | SimulatedWalk | str | Path,
    *,
    policy: StoredPolicy | None = None,
    criterion: str = DEFAULT,
    strength: float | Mapping[str, float] = 1.0,
    side: Side | None = None,
    bands: bool = False,
    activation_dynamics: bool = True,
    emg: str | Path | Sequence[str | Path] = (),
    emg_side: Side | None = None,
    emg_weight: float = 0.0,
    configuration: Configuration | None = None,
) -> MuscleGait:
    """Muscle activations and forces, and what joints carry, as `gaitval muscles` finds them.

    Parameters
    ----------
    of : of `import_session`, a walk of `rollout`, or the folder of an import or a run.
    policy : whose walk it is, if it is one.
    criterion : what is kept small: "contact", "contact by volume", "squares", "cubes", "volume",
        "spared knee".
    strength : factor on the strength of all muscles, or of some by name, such as {"soleus": 0.5}.
    side : one leg only.
    bands : of 90 %, by 200 draws.
    activation_dynamics : activations rise and fall no faster than muscles can.
    emg : C3D or STO files with electromyograms, called as the trials are.
    emg_side : leg of channels whose names do not say it.
    emg_weight : how much activations are kept near the electromyograms.
    configuration : that the walk was made with; the defaults when not given.

    Returns
    -------
    MuscleGait
        `legs` has, by side, means over the cycles (101 points): `activation` (40, 101) of 0 to 1,
        `force` (40, 101) and `contact` in body weights.

    Raises
    ------
    ConfigurationError
        An argument of another kind, or a walk without its policy.
    RecordError
        The moments of no leg are known, or an angle is beyond the muscles' paths.
    ModelError
        No such criterion or muscle.
    ArtefactError
        The folder has neither an import nor a walk.

    References
    ----------
    Rajagopal et al. (2016), IEEE Trans Biomed Eng 63:2068: the muscles. Crowninshield and Brand
    (1981), J Biomech 14:793: sharing by a cost.

    Examples
    --------
    >>> import gaitval as gv
    >>> policy = gv.load_policy(5)
    >>> found = gv.muscles(gv.rollout(policy, cycles=8), policy=policy)
    >>> leg = found.legs["right"]
    >>> bool(2.0 < leg.contact["hip"].max() < 6.0)  # body weights
    True
    """
    files = (emg,) if isinstance(emg, str | Path) else emg
    settings = MuscleSettings(
        criterion=criterion,
        side=side,
        strength=strength,
        bands=bands,
        activation_dynamics=activation_dynamics,
        emg=tuple(Path(each) for each in files),
        emg_side=emg_side,
        emg_weight=emg_weight,
    )
    return shared_motions(motions_of(of, policy, configuration), settings).muscles


def motions_of(
    of: Session | SimulatedWalk | str | Path,
    policy: StoredPolicy | None,
    configuration: Configuration | None,
) -> list[LoadedMotion]:
    """The motions with moments that `of` has, as `muscles` takes it. Raises ConfigurationError,
    ArtefactError or RecordError.
    """
    if isinstance(of, str | Path):
        return motions_in(Path(of))
    expect("of", of, (Session, SimulatedWalk), "a session, a walk, or a folder")
    if isinstance(of, Session):
        return motions_in(of.folder)
    return [_of(of, policy, configuration)]


def _of(
    walk: SimulatedWalk, policy: StoredPolicy | None, configuration: Configuration | None
) -> LoadedMotion:
    if policy is None:
        raise ConfigurationError(
            "A walk does not say of which body it is. Give its policy, too, by policy=policy."
        )
    expect("policy", policy, StoredPolicy, "what load_policy(5) returns")
    body, laden = person_and_laden(policy.model, walk.mu, policy.configuration.record)
    return walk_motion(
        walk,
        find_cycles(walk, Configuration() if configuration is None else configuration),
        body,
        height=policy.subject.height_m,
        name=walk.walker,
        lost=lost_joints(policy.subject),
        laden=laden,
    )
