"""Servos and ground contact of many walkers, as kernels of NVIDIA Warp.

They are `simulation.physics_steps.forces` and `contact.forces.contact_forces` once more, in single
precision and with a thread for each joint or foot of each walker (tests/accelerator compares them).
Warp compiles them from their source, for the processor or for a GPU.
"""

import warp as wp

from gaitval.cache_home import own_cache
from gaitval.contact.hunt_crossley import (
    FADED,
    PENETRATION_SLOPE,
    RATE_SLOPE,
    SMOOTHING,
    HuntCrossley,
)

# What Warp compiles is kept, and taken from there, where this user alone can write.
wp.config.kernel_cache_dir = str(own_cache() / "warp")

_K, _DISSIPATION, _STATIC, _DYNAMIC, _VISCOUS, _TRANSITION = (
    wp.constant(HuntCrossley._fields.index(name))
    for name in (
        *("k", "dissipation", "static_friction", "dynamic_friction"),
        *("viscous_friction", "transition_velocity"),
    )
)
_SMOOTHING, _FADED = wp.constant(SMOOTHING), wp.constant(FADED)
_PENETRATION_SLOPE, _RATE_SLOPE = wp.constant(PENETRATION_SLOPE), wp.constant(RATE_SLOPE)


@wp.func
def _read(table: wp.array3d[float], which: int, row: int, part: float, joint: int) -> float:
    return (1.0 - part) * table[which, row, joint] + part * table[which, row + 1, joint]


@wp.kernel
def slopes_of(
    commanded: wp.array2d[float], target: wp.array2d[float], share: float, slope: wp.array2d[float]
):
    """How much the joint targets' offsets (N, 25) rad change in a step, a share of an action;
    a thread for each walker and joint.
    """
    w, j = wp.tid()
    slope[w, j] = share * (commanded[w, j] - target[w, j])


@wp.kernel
def command_servos(
    positions: wp.array3d[float],
    velocities: wp.array3d[float],
    moments: wp.array3d[float],
    which: wp.array1d[int],
    phase: wp.array1d[wp.float64],
    pace: wp.array1d[float],
    slope: wp.array2d[float],
    stiffness: wp.array2d[float],
    damping: wp.array2d[float],
    rates: wp.array1d[int],
    target: wp.array2d[float],
    command: wp.array2d[float],
    applied: wp.array2d[float],
):
    """What a servo asks for that does not depend on the state: k (q̂ + a) + d p q̂̇ + τ_ff.

    A thread for each of N walkers and 25 joints.

    Parameters
    ----------
    positions, velocities, moments : (tasks, rows + 1, 25), as `servo.ReferenceTables`.
    which : (N,) the task of each walker.
    phase, pace : (N,), as `Walker.phase` and `physics_steps.Action.pace`.
    slope : (N, 25) rad, change of the joint targets' offsets in a step.
    stiffness, damping : (N, 25) Nm/rad, Nms/rad.
    rates : (25,) where MuJoCo has each joint's velocity.
    target : (N, 25) rad, in and out, the offsets.
    command, applied : (N, 25) and (N, 31) Nm, out.
    """
    w, j = wp.tid()
    place = (phase[w] - wp.floor(phase[w])) * wp.float64(positions.shape[1] - 1)
    row = int(place)
    part = float(place - wp.float64(row))
    target[w, j] = target[w, j] + slope[w, j]
    commanded = (
        stiffness[w, j] * (_read(positions, which[w], row, part, j) + target[w, j])
        + damping[w, j] * pace[w] * _read(velocities, which[w], row, part, j)
        + _read(moments, which[w], row, part, j)
    )
    command[w, j] = commanded
    applied[w, rates[j]] = commanded


@wp.kernel
def push(
    root_force: wp.array2d[float],
    rotation: wp.array2d[wp.mat33],
    pelvis: int,
    applied: wp.array2d[float],
):
    """The external moment and force on the pelvis; a thread for each walker. `root_force` (N, 6) Nm
    and N, world, is as `physics_steps.Action.root_force`, `rotation` (N, bodies) from a body's axes
    to the world's, `pelvis` its body. `applied` (N, 31) is out: MuJoCo's free joint has the force
    first, then the moment in the pelvis's axes.
    """
    w = wp.tid()
    moment = wp.transpose(rotation[w, pelvis]) * wp.vec3(
        root_force[w, 0], root_force[w, 1], root_force[w, 2]
    )
    for i in range(3):
        applied[w, i] = root_force[w, 3 + i]
        applied[w, 3 + i] = moment[i]


@wp.func
def _sphere(
    law: wp.array2d[float], w: int, radius: float, height: float, velocity: wp.vec3
) -> tuple[wp.vec3, float, float]:
    """`HuntCrossley.force`: the force N, and its slopes Ns/m in the normal direction and across."""
    x = radius - height
    k, c, transition = law[w, _K], law[w, _DISSIPATION], law[w, _TRANSITION]
    root = wp.sqrt(x * x + _SMOOTHING)
    fh = 4.0 / 3.0 * k * wp.sqrt(radius * k) * root * wp.sqrt(root)
    fh = wp.where(x < _FADED, 0.0, fh / (1.0 + wp.exp(-2.0 * _PENETRATION_SLOPE * x)))
    v = -velocity[2]
    fn = fh * (1.0 + 1.5 * c * v)
    fn = fn / (1.0 + wp.exp(-2.0 * _RATE_SLOPE * (v + 2.0 / (3.0 * c))))
    square = velocity[0] * velocity[0] + velocity[1] * velocity[1] + _SMOOTHING
    whole = transition * transition + square
    dynamic = law[w, _DYNAMIC]
    falling = dynamic * whole + 2.0 * (law[w, _STATIC] - dynamic) * transition * transition
    along = fn * (falling / (whole * wp.max(wp.sqrt(square), transition)) + law[w, _VISCOUS])
    return wp.vec3(-along * velocity[0], -along * velocity[1], fn), 1.5 * c * fh, along


@wp.func
def _middle_of_overlap(origin: wp.vec3, arm: wp.vec3, radius: float) -> wp.vec3:
    """Where the ground's force acts on a sphere, m, world."""
    return wp.vec3(origin[0] + arm[0], origin[1] + arm[1], 0.5 * (origin[2] + arm[2] - radius))


@wp.kernel
def touch_ground(
    origin: wp.array2d[wp.vec3],
    rotation: wp.array2d[wp.mat33],
    centre: wp.array2d[wp.vec3],
    motion: wp.array2d[wp.spatial_vector],
    whole_centre: wp.array2d[wp.vec3],
    pelvis: int,
    body: wp.array1d[int],
    place: wp.array2d[wp.vec3],
    radius: wp.array2d[float],
    law: wp.array2d[float],
    lag: wp.array2d[float],
    share: float,
    plain: wp.array2d[wp.vec3],
    memory: wp.array2d[wp.vec3],
    mean: wp.array2d[wp.vec3],
    wrench: wp.array2d[wp.spatial_vector],
):
    """The ground's forces on the spheres of a foot; a thread for each walker and side.

    Parameters
    ----------
    origin, rotation, centre : (N, bodies) m, joint and centre of mass of each body, world, and its
        axes.
    motion : (N, bodies) rad/s and m/s, angular velocity and velocity of the point that moves with
        the body and is at the whole body's centre of mass, `whole_centre` (N, bodies) m.
    pelvis : the root's body.
    body : (K,) of each sphere; the right foot's come first.
    place, radius : (N, K) m, of each sphere in its body.
    law : (N, 7) the numbers of `HuntCrossley`.
    lag : (N, 2) as in `contact.forces.contact_forces`.
    share : of a step in what `mean` is taken of.
    plain : (N, K) N, to work in.
    memory : (N, K) N, in and out, the spheres' forces.
    mean : (N, 2) N, in and out, right and left foot.
    wrench : (N, bodies) N and Nm about the centre of mass of each body, out for those with spheres.
    """
    w, side = wp.tid()
    half = body.shape[0] // 2
    normal, across = wp.float32(0.0), wp.float32(0.0)  # variables, which a literal is not
    for i in range(half):
        n = side * half + i
        b = body[n]
        wrench[w, b] = wp.spatial_vector()
        arm = rotation[w, b] * place[w, n]
        at = _middle_of_overlap(origin[w, b], arm, radius[w, n])
        turning, moving = wp.spatial_top(motion[w, b]), wp.spatial_bottom(motion[w, b])
        velocity = moving + wp.cross(turning, at - whole_centre[w, pelvis])
        force, slope, slip = _sphere(law, w, radius[w, n], origin[w, b][2] + arm[2], velocity)
        plain[w, n] = force
        normal += slope
        across += slip
    # f = (f(v) + a f') / (1 + a), with a = h κ / m: contact/forces.py says why.
    normal, across = lag[w, side] * normal, lag[w, side] * across
    normal, across = normal / (1.0 + normal), across / (1.0 + across)
    for i in range(half):
        n = side * half + i
        b = body[n]
        now, was = plain[w, n], memory[w, n]
        f = wp.vec3(
            now[0] + across * (was[0] - now[0]),
            now[1] + across * (was[1] - now[1]),
            now[2] + normal * (was[2] - now[2]),
        )
        memory[w, n] = f
        mean[w, side] = mean[w, side] + share * f
        arm = rotation[w, b] * place[w, n]
        at = _middle_of_overlap(origin[w, b], arm, radius[w, n])
        wrench[w, b] = wrench[w, b] + wp.spatial_vector(f, wp.cross(at - centre[w, b], f))


@wp.kernel
def implicit_equations(
    applied: wp.array2d[float],
    passive: wp.array2d[float],
    bias: wp.array2d[float],
    damping: wp.array2d[float],
    step: float,
    counts: wp.array1d[int],
    starts: wp.array1d[int],
    force: wp.array2d[float],
    inertia: wp.array2d[float],
):
    """The equations of the step, (M + h D) q̈ = f; a thread for each walker and coordinate.

    Parameters
    ----------
    applied, passive, bias : (N, 31), as MuJoCo's `qfrc_…`.
    damping : (N, 31) D.
    step : h, s.
    counts, starts : (31,) of the elements in each row of MuJoCo's M; the diagonal's is the last.
    force : (N, 31) out, without what acts on the bodies.
    inertia : (N, elements) M, in and out.
    """
    w, i = wp.tid()
    force[w, i] = applied[w, i] + passive[w, i] - bias[w, i]
    diagonal = starts[i] + counts[i] - 1
    inertia[w, diagonal] = inertia[w, diagonal] + step * damping[w, i]


@wp.kernel
def enter(
    command: wp.array2d[float],
    stiffness: wp.array2d[float],
    total_damping: wp.array2d[float],
    places: wp.array1d[int],
    rates: wp.array1d[int],
    qpos: wp.array2d[float],
    qvel: wp.array2d[float],
    pace: wp.array1d[float],
    phase_step: wp.array1d[wp.float64],
    share: float,
    phase: wp.array1d[wp.float64],
    moments: wp.array2d[float],
    squares: wp.array2d[float],
):
    """What acted in a step; a thread for each walker and joint.

    Parameters
    ----------
    command, stiffness, total_damping : (N, 25), as `physics_steps.enter` has them.
    places, rates : (25,) where MuJoCo has each joint's angle and velocity.
    qpos, qvel : (N, 32) and (N, 31) after the step.
    pace, phase_step : (N,), the latter the fraction of a gait cycle in a step.
    share : of a step in what the means are taken of.
    phase : (N,) in and out.
    moments, squares : (N, 25) Nm, Nm², in and out, means.
    """
    w, j = wp.tid()
    if j == 0:
        phase[w] = phase[w] + wp.float64(pace[w]) * phase_step[w]
    moment = (
        command[w, j]
        - stiffness[w, j] * qpos[w, places[j]]
        - total_damping[w, j] * qvel[w, rates[j]]
    )
    moments[w, j] = moments[w, j] + share * moment
    squares[w, j] = squares[w, j] + share * moment * moment
