"""A controller of your own: it tilts the cab for lasting accelerations, and moves it for short ones.

Run it with ``python examples/own_controller.py``, with names of maneuvers if you like;
docs/guides/add-a-controller.md explains it.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.simulator.kernels.observation import read
from motion_cueing.evaluation import Metrics, measure, rollout

GRAVITY = 9.81
TIME_STEP = 0.01


@dataclass
class TiltAndShove:
    """Splits the reference force by frequency: below it tilts the cab, above it moves the carriage.

    Args:
        crossover: Frequency of the split, rad/s.
        tilt: Bandwidth of the tilt, rad/s.
        spring: Frequency at which the carriage goes home, rad/s.
    """

    crossover: float = 0.5
    tilt: float = 2.0
    spring: float = 0.4
    name: str = "tilt-and-shove"

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Accelerations (n, 9), and the low-passed forces (n, 2) as the state."""
        force = read(observation, "reference_force")[:, :2]
        slow = np.zeros_like(force) if state is None else state
        slow = slow + TIME_STEP * self.crossover * (force - slow)

        action = np.zeros((len(observation), 9))
        action[:, :2] = self._home(force - slow, observation)
        # Nose up, gravity pushes the driver into the seat back: f_x = g sin(pitch), f_y = -g sin(roll).
        target = np.stack([-slow[:, 1], slow[:, 0]], axis=1) / GRAVITY
        angle, rate = read(observation, "beta")[:, :2], read(observation, "beta_rate")[:, :2]
        action[:, 5:7] = self.tilt**2 * (target - angle) - 2.0 * self.tilt * rate
        return action, slow

    def _home(self, fast: NDArray[Any], observation: NDArray[Any]) -> NDArray[Any]:
        """Acceleration of the carriage: the fast part, on a spring and a damper."""
        position, rate = read(observation, "carriage"), read(observation, "carriage_rate")
        return fast - self.spring**2 * position - 1.4 * self.spring * rate


def scores(maneuver: str) -> dict[str, Metrics]:
    """The metrics of each policy, by name."""
    cues = get_maneuver(maneuver).drive()
    policies = (NoMotion(), ClassicalWashout(), TiltAndShove())
    return {policy.name: measure(rollout(policy, cues)) for policy in policies}


def main(*maneuvers: str) -> None:
    """Print what matters of each drive."""
    print(f"{'maneuver':<20}{'policy':<18}{'J':>6}{'perceived':>11}{'tilt deg/s':>12}{'at a limit':>12}")
    for maneuver in maneuvers or ("braking", "lane-change"):
        for name, found in sorted(scores(maneuver).items(), key=lambda item: item[1].cue_error):
            tilt_rate = np.degrees(found.tilt_rate_peak)
            print(
                f"{maneuver:<20}{name:<18}{found.cue_error:6.2f}{found.perceived_cue_error:11.2f}"
                f"{tilt_rate:12.1f}{found.at_limit:12.1%}"
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
