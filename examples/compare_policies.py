"""Hold a policy of your own against the paper's washout, on one maneuver.

Run it with ``python examples/compare_policies.py``; ``motion-cueing list`` shows the maneuvers.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motion_cueing.baselines import ClassicalWashout, NoMotion
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.simulator.kernels.observation import read
from motion_cueing.evaluation import measure, rollout


class CarriageOnSprings:
    """Accelerates the carriage with the car, on a soft spring and a damper back to the middle."""

    name = "carriage-on-springs"

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], Any]:
        """Accelerations (n, 9): carriage x, y; hexapod x, y, z, roll, pitch, yaw; turntable."""
        action = np.zeros((len(observation), 9))
        action[:, :2] = (
            read(observation, "reference_force")[:, :2]
            - 0.04 * read(observation, "carriage")
            - 0.28 * read(observation, "carriage_rate")
        )
        return action, state


def cue_errors(maneuver: str) -> dict[str, float]:
    """The cue error J of each policy, by name."""
    cues = get_maneuver(maneuver).drive()
    policies: tuple[Any, ...] = (NoMotion(), ClassicalWashout(), CarriageOnSprings())
    return {policy.name: measure(rollout(policy, cues)).cue_error for policy in policies}


def main(maneuver: str = "lane-change") -> None:
    """Print J of each policy: 0 is perfect, 1 is at the edge of what a driver minds."""
    for name, error in sorted(cue_errors(maneuver).items(), key=lambda item: item[1]):
        print(f"{name:<20} J = {error:6.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:2])
