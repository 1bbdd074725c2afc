"""Root mean square of every row of the observation: what ``observation.scaling: typical`` divides by.

    python -m benchmarks.typical_rows

Random drives of the task `cueing-preview`, under its base policy with actions drawn with a deviation of 1.
Prints a table with one line a row: its unit, the measured values, and the rounded ones in the declaration.
"""

from __future__ import annotations

import numpy as np

from motion_cueing.envs.task.options import load_task
from motion_cueing.train.vec_env import DrivingSimulatorVecEnv

ENVIRONMENTS, ACTIONS = 64, 500


def main() -> None:
    """Drive, and print the table."""
    task = load_task("cueing-preview", observation={"scaling": "physical"}, reward={"against_base": False})
    envs = DrivingSimulatorVecEnv(ENVIRONMENTS, task)
    envs.seed(0)
    envs.reset()
    rng, seen = np.random.default_rng(0), []
    for _ in range(ACTIONS):
        observation, *_ = envs.step(rng.standard_normal((ENVIRONMENTS, task.action.size)))
        seen.append(np.asarray(observation))
    measured = np.sqrt(np.mean(np.square(np.concatenate(seen)), axis=0))
    print("| Row | Unit | Measured | Declared |\n|---|---|---|---|")
    for row in envs.batch.layout.rows:
        values = measured[envs.batch.layout.slices[row.name]] * row.scale
        declared = row.typical or (row.scale,)
        shown = (", ".join(f"{value:.2g}" for value in some[: len(declared)]) for some in (values, declared))
        print(f"| `{row.name}` | {row.unit} | {' | '.join(shown)} |")


if __name__ == "__main__":
    main()
