"""Compile what a study runs, in a process of its own, before the study begins.

A process that compiles keeps 200 to 300 MB of its compiler. Where nothing is compiled yet, all
processes of a study would compile the same functions at once; here one does, which then ends.
"""

import subprocess
import sys
from contextlib import suppress

import numpy as np

from gaitval.compiled import is_empty


def compile_ahead() -> None:
    """Compile if nothing was compiled before, and wait. If that fails, the study compiles."""
    if is_empty():
        command = [sys.executable, "-P", "-m", "gaitval.study.compile_ahead"]
        # A group of its own: the Ctrl-C of a terminal reaches this process alone, which ends it.
        subprocess.run(command, stdin=subprocess.DEVNULL, check=False, process_group=0)


def walk() -> None:
    """Once through every compiled function of a study: the equations of a step of the fit of a
    reference, walks in each engine, and a push.
    """
    from gaitval.configuration import Configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.inverse.motion_rates import root_states
    from gaitval.metrics.cycles import find_cycles
    from gaitval.metrics.push_recovery import Push, survive_together, trials, without_drift
    from gaitval.metrics.torques import ground_rows, mechanical_energy
    from gaitval.metrics.walk_muscles import walk_motion
    from gaitval.model.parameters import nominal_parameters
    from gaitval.musculature.gait import muscles_of
    from gaitval.policy.environment import WalkingEnvironment
    from gaitval.policy.rollouts import record_rollout, record_together
    from gaitval.policy.walking_group import WalkingGroup
    from gaitval.reference.dynamic_fit import Accuracy, fit_problem, linearised, normal_equations
    from gaitval.reference.motion import build_reference
    from gaitval.scaling.scaling import scale_subject
    from gaitval.simulation.walker import WalkingTask
    from gaitval.study.stored_policy import general_walker

    subject, configuration, mu = load_subject("S04"), Configuration(), nominal_parameters()
    model, record, nothing = scale_subject(subject).model, subject.record(), np.zeros((1, 3))
    built = build_reference(record, model, configuration.contact)
    problem = fit_problem(built, record, model, configuration.contact, Accuracy(), 0.0)
    begun = problem, built.change, np.zeros(len(problem.prior))
    normal_equations(*begun, linearised(*begun, 1.0))
    root_states(nothing, nothing, nothing, np.empty((1, 3, 3)))  # of the fit's motion
    task = WalkingTask(model, record, built, configuration)
    policy, group = general_walker(configuration.environment), WalkingGroup([task] * 8)
    list(record_together(group, policy, mu=mu, start_phases=[0.0], cycles=0.1))
    for engine in ("dart", "mujoco", "compiled"):
        environment = WalkingEnvironment(task, engine=engine)
        record_rollout(environment, policy, mu=mu, start_phase=0.0, cycles=0.1)
    free = without_drift(task)
    survive_together(WalkingGroup([free] * 8), trials(free, policy, mu, [Push(0.0, 0.0, 1.0)]))
    # Whole cycles, whose feet and muscles are looked at. This person walks them from here on the
    # motion as built, which spares a fit.
    environment = WalkingEnvironment(task, engine="compiled")
    walked = record_rollout(environment, policy, mu=mu, start_phase=0.6, cycles=4.0)
    all_cycles = {"validation": configuration.validation.model_copy(update={"settling_cycles": 0})}
    cycles = find_cycles(walked, configuration.model_copy(update=all_cycles))
    ground_rows(walked, model)
    mechanical_energy(walked, model, 0)
    muscles_of([walk_motion(walked, cycles, model, height=subject.height_m)])


def main() -> None:
    """`walk`; what goes wrong here will go wrong in the study, and is said there."""
    with suppress(Exception, KeyboardInterrupt):
        walk()


if __name__ == "__main__":
    main()
