"""A study of a second that does nothing but wait and count, to try the engine of cohorts with.

Its settings are words in the name: `sleep5`, `refuse`, `crash`, `die` (once), `eat` (memory).
"""

import hashlib
import os
import re
import signal
import time

import numpy as np

from gaitval.errors import RecordError


def work(study, folder, threads, observer):
    """Ten steps, of which those done before a kill are not done again."""
    observer.say(f"{study.name} in {folder}")
    seconds = float((re.search(r"sleep([\d_]+)", study.name) or ["", "1"])[1].replace("_", "."))
    if "refuse" in study.name:
        raise RecordError("the record of this one is no record. Record it again.")
    if "crash" in study.name:
        raise ValueError("a fault")
    if "die" in study.name and not (folder / "died").exists():
        (folder / "died").write_text("")
        os.kill(os.getpid(), signal.SIGKILL)
    eaten = np.ones(25_000_000) if "eat" in study.name else np.ones(1)
    for step in range(10):
        path = folder / f"step{step}.txt"
        if not path.exists():
            time.sleep(seconds / 10)
            (folder / ".part").write_text(
                hashlib.sha256(f"{study.name} {step}".encode()).hexdigest()
            )
            (folder / ".part").replace(path)
    text = "".join((folder / f"step{step}.txt").read_text() for step in range(10))
    return summary(
        study.name, hashlib.sha256(text.encode()).hexdigest(), float(eaten.sum()), threads
    )


def summary(name, digest, eaten, threads):
    """As that of a real study, with numbers that follow from the name."""
    random = np.random.default_rng(int(digest[:8], 16))
    number = int(digest[:6], 16)
    error, speed = float(random.uniform(1, 3)), float(random.uniform(0.5, 1.5))
    return {
        "subject": {
            "identifier": name, "laboratory": "lab", "person": f"P{number % 7}", "trial": "T01",
            "source": name, "sex": "FM"[number % 2], "age": 20.0 + number % 60, "mass": 70.0,
            "height": 1.7, "leg_length": 0.85, "speed": speed,
        },
        "verdicts": {"accepted": 10, "refused": 0, "goals": 5, "goals_reached": 5, "failed": []},
        "measures": [{"measure": "angle_rmse", "target": "knee_angle_r", "unit": "deg",
                      "value": error}],
        "groups": [{"group": "sagittal angles", "unit": "deg", "rmse": error, "skill": 0.8}],
        "parameters": [{"parameter": "damping", "nominal": 1.0, "prior_sd": 0.3, "mean": 1.1,
                        "sd": 0.1, "identified": 1.1, "verdict": "identified"}],
        "epsilon": 0.25 + eaten * 0,
    }  # fmt: skip
