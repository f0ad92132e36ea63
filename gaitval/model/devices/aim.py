"""What a device's torque is searched for."""

from typing import Annotated, Literal

from pydantic import Field

from gaitval.model.devices.tables import Table


class Aim(Table):
    """What the torque of a device's motor is searched for, one person at a time (`search`).

    Attributes
    ----------
    joint : at which the motor is; and whose muscles, for `work` and `moment`.
    quantity : what is to be small, of the sides together. `work`: positive work of the muscles of
        the joint; `moment`: their largest moment; `legs`: positive work of the muscles of hips,
        knees and ankles; `cost`: gross metabolic rate, by the model of the joints; `asymmetry`: the
        mean symmetry index of both sides' stance, largest vertical force and positive work;
        `pushes`: how much of the strides after pushes is lost to falls.
    torque_rate : Nm/s, most that is comfortable.
    range_rad : rad, by which the joint may leave the range of the walk without this device.
    generations, seed : of the search.
    """

    joint: Literal["hip_flexion", "knee_angle", "ankle_angle"]
    quantity: Literal["work", "moment", "legs", "cost", "asymmetry", "pushes"] = "work"
    torque_rate: Annotated[float, Field(gt=0, le=1e6)] = 300.0
    range_rad: Annotated[float, Field(ge=0, le=3.2)] = 0.17
    generations: Annotated[int, Field(ge=1, le=1000)] = 25
    seed: Annotated[int, Field(ge=0, le=2**31)] = 0

    @property
    def unit(self) -> str:
        """Of what is to be small."""
        others = {
            **{"moment": "Nm/kg", "asymmetry": "1"},
            **{"pushes": "of the strides", "cost": "W/kg"},
        }
        return others.get(self.quantity, "J/kg a stride")

    def in_words(self) -> str:
        """What is to be small."""
        of = self.joint.partition("_")[0]
        return {
            "work": f"positive work of the muscles of both {of}s",
            "moment": f"largest moments of the muscles of both {of}s, their sum",
            "legs": "positive work of the muscles of both legs",
            "cost": "gross metabolic rate, from joints",
            "asymmetry": "asymmetry: mean symmetry index of stance, force and work",
            "pushes": "strides lost to falls after pushes",
        }[self.quantity]
