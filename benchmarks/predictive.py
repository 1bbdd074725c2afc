"""What a step of each predictive controller takes, and what its parts take.

    python -m benchmarks.predictive

Times are processor time of one thread, so that other work on the machine does not count. The first step,
in which libraries wake, counts.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from motion_cueing.baselines import make_policy
from motion_cueing.baselines.mpc import Margins, MpcParameters
from motion_cueing.baselines.mpc.prediction import MachineModel
from motion_cueing.baselines.registry import DESCRIPTIONS
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation import rollout

MANEUVERS = ("slalom", "roundabout", "braking")


class Timed:
    """A policy whose steps are timed."""

    def __init__(self, policy: Any) -> None:
        self._policy, self.seconds = policy, []

    def predict(self, *arguments: Any, **options: Any) -> Any:
        began = time.thread_time()
        answer = self._policy.predict(*arguments, **options)
        self.seconds.append(time.thread_time() - began)
        return answer


def steps(name: str) -> np.ndarray:
    """Seconds of every step of a controller in the maneuvers."""
    platform = get_platform("paper")
    policy: Any = make_policy(name, platform)
    seconds = []
    for maneuver in MANEUVERS:
        cues = get_maneuver(maneuver).drive()
        timed = Timed(policy.for_drive(cues) if hasattr(policy, "for_drive") else policy)
        rollout(timed, cues, platform)
        seconds += timed.seconds
    return np.array(seconds)


def derivatives(compile: bool) -> float:
    """Seconds of one evaluation of the machine's derivatives at all nodes."""
    n = len(MpcParameters().nodes)
    linearized = MachineModel(get_platform("paper"), n, Margins(), compile=compile)
    motion = 0.1 * np.random.default_rng(0).normal(size=(3, n, 9))
    began = time.thread_time()
    for _ in range(200):
        linearized(*motion)
    return (time.thread_time() - began) / 200


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--policy", nargs="+", default=list(DESCRIPTIONS))
    out = Table("policy", "mean ms", "p99 ms", "longest ms")
    for name in parser.parse_args().policy:
        ms = 1e3 * steps(name)
        out.add_row(name, f"{ms.mean():.2f}", f"{np.percentile(ms, 99):.2f}", f"{ms.max():.2f}")
    plain, fast = (1e3 * derivatives(compile) for compile in (False, True))
    Console().print(out, f"derivatives: {plain:.2f} ms, as machine code {fast:.3f} ms")


if __name__ == "__main__":
    main()
