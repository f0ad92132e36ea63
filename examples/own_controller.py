"""A controller of one's own: a hip exoskeleton that pushes with the thigh's own motion.

python examples/own_controller.py
"""

from gaitval.apps.devices.study import wearer
from gaitval.apps.devices.walking import DeviceEnvironment, walk_with, with_devices
from gaitval.model.devices.device import load_devices


class Energiser:
    """Torque along the joint's speed, as delayed self-feedback gives it (Lim et al. 2019)."""

    def torque(self, measured):
        """Nm, at most 6; nothing until the first heel strike has been seen."""
        if measured.phase != measured.phase:
            return 0.0
        return max(-6.0, min(6.0, 2.0 * measured.speed))


person = wearer("5")
task = with_devices(person.task, load_devices("hip_exo"), own=Energiser)
walk = walk_with(DeviceEnvironment(task), person.policy, mu=person.mu, cycles=10.0)
print(
    f"walked {walk.rollout.phase[-1]:.0f} cycles; mean power {walk.power.mean(axis=0).round(1)} W"
)
