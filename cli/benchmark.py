"""``motion-cueing benchmark``: every controller, from no motion to the optimum, on every maneuver."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .arguments import ALL, BENCHMARK, CarName, ManeuverNames, OutFolder, PlatformName, PolicyNames
from .evaluate import EvaluateCommand, make_plan, report


@dataclass(frozen=True, kw_only=True)
class BenchmarkCommand:
    """Evaluate every controller of the benchmark, and rank them over all maneuvers.

    Writes what `motion-cueing evaluate` writes. A controller that cannot drive the motion base is left out.
    The optimum takes minutes a drive. Policies of your own are driven beside the benchmark with
    `--policies benchmark mine.yaml`.
    """

    policies: PolicyNames = (BENCHMARK,)
    maneuvers: ManeuverNames = (ALL,)
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    out: OutFolder = Path("benchmark")


def run(command: BenchmarkCommand) -> int:
    """Evaluate; the exit status is 1 if a drive failed.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    from ..evaluation.reporting.text import words_of

    plan = make_plan(EvaluateCommand(**vars(command)), words_of("benchmark", command))
    return report(plan, ranked=True)
