"""Search for weights and forecasts of predictive control, on the random drives that agents are trained on.

    python -m benchmarks.mpc_weights --start mpc --out mpc-tuned.yaml
    python -m benchmarks.mpc_weights --start mpc-preview --hours 20 --out mpc-preview-tuned.yaml

CMA-ES in the logarithms of the numbers, each within a factor of 30 of where it starts. Every set drives the
same drives, with a plan each 50 ms; at the end the start and the set found drive others, with a plan each
10 ms. The set that is best so far is in the file after every generation.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import cma
import numpy as np
import yaml

from motion_cueing.baselines.mpc.parameters import MpcParameters, load_mpc
from motion_cueing.baselines.mpc.policy import make_mpc
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.maneuvers import random_drives
from motion_cueing.envs.maneuvers.sampling import load_drives
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import from_dict, to_dict
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.rollout import rollout

_DURATION: Final = 30.0
_TRAINING_SEED, _VALIDATION_SEED = 0, 10_000
_SPREAD: Final = 30.0
"""Largest factor between a number and where it starts."""
_FROM_ZERO: Final = 1e-4
"""Where a weight starts that is zero in the set."""
_NUMBERS: Final = (
    "forecast.memory",
    "forecast.force_decay.0",
    "forecast.force_decay.1",
    "forecast.force_decay.2",
    "forecast.rate_decay",
    "forecast.lasting_decay",
    *(
        f"weights.{part}.{field}"
        for part in ("carriage", "translation", "tilt", "yaw")
        for field in ("position", "rate", "acceleration", "end_position", "end_rate")
    ),
    "weights.turntable.acceleration",
)


class Space:
    """The numbers of a parameter set that a search changes, as logarithms from where it starts."""

    def __init__(self, start: MpcParameters) -> None:
        self._values = to_dict(start)
        self._start = np.array([self._place(path)[0][self._place(path)[1]] for path in _NUMBERS])
        self._start = np.where(self._start > 0.0, self._start, _FROM_ZERO)

    def __len__(self) -> int:
        return len(_NUMBERS)

    def decode(self, logarithms: np.ndarray) -> MpcParameters:
        """The parameter set at (n,) logarithms."""
        for path, value in zip(_NUMBERS, self._start * np.exp(logarithms), strict=True):
            parent, last = self._place(path)
            parent[last] = float(f"{value:.4g}")
        return from_dict(MpcParameters, self._values, "search")

    def _place(self, path: str) -> tuple[Any, Any]:
        *parents, last = (int(part) if part.isdigit() else part for part in path.split("."))
        parent = self._values
        for name in parents:
            if isinstance(parent[name], tuple):
                parent[name] = list(parent[name])
            parent = parent[name]
        return parent, last


def mean_error(parameters: MpcParameters, drives: Sequence[CueTrace]) -> float:
    """Mean J over drives on the paper's machine."""
    platform = get_platform("paper")
    policy = make_mpc(platform, parameters)
    return float(np.mean([measure(rollout(policy, drive, platform)).cue_error for drive in drives]))


def main() -> None:
    """Search, and print J of the start and of what was found on other drives."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--start", default="mpc", help="parameter set to begin with, by name or file")
    parser.add_argument("--hours", type=float, default=40.0, help="time to simulate")
    parser.add_argument("--drives", type=int, default=16, help="random drives of half a minute")
    parser.add_argument("--seed", type=int, default=0, help="of the search")
    parser.add_argument("--out", type=Path, required=True, help="YAML file of the best set")
    given = parser.parse_args()

    roads = load_drives("broad")
    drives = random_drives(given.drives, _DURATION, _TRAINING_SEED, drives=roads)
    start = load_mpc(given.start)
    quick = replace(start, every=5)
    space = Space(quick)
    search = cma.CMAEvolutionStrategy(
        np.zeros(len(space)),
        0.3,
        {"seed": given.seed + 1, "bounds": [-math.log(_SPREAD), math.log(_SPREAD)], "verbose": -9},
    )
    best, least = quick, mean_error(quick, drives)
    print(f"0 h: J {least:.3f} (start)", flush=True)
    simulated, began = 0.0, time.monotonic()
    while simulated < given.hours:
        places = search.ask()
        sets = [space.decode(np.asarray(place)) for place in places]
        costs = [mean_error(one, drives) for one in sets]
        search.tell(places, costs)
        simulated += len(sets) * len(drives) * _DURATION / 3600.0
        if min(costs) < least:
            best, least = sets[int(np.argmin(costs))], min(costs)
            values = to_dict(replace(best, every=start.every))
            given.out.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
        print(f"{simulated:.1f} h, {(time.monotonic() - began) / 60:.1f} min: J {least:.3f}", flush=True)
    others = random_drives(2 * given.drives, _DURATION, _VALIDATION_SEED, drives=roads)
    before, after = (mean_error(replace(one, every=start.every), others) for one in (start, best))
    print(f"on {len(others)} other drives: J {before:.3f} at the start, {after:.3f} as found")


if __name__ == "__main__":
    main()
