"""``motion-cueing paper``: the paper's six cases and figures, with a pass or a fail for each number."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..envs.storage import check_folder, check_own_json
from .arguments import OutFolder


@dataclass(frozen=True, kw_only=True)
class PaperCommand:
    """Drive the six cases of the paper, draw its figures, and check each of its numbers.

    Writes paper.json, paper.html, the figures and the trajectories. The exit status is 1 if a number fails.
    """

    out: OutFolder = Path("paper")


def run(command: PaperCommand) -> int:
    """Reproduce the paper; the exit status is 1 if a number fails.

    Raises:
        MotionCueingError: an argument is wrong.
    """
    check_folder("--out", command.out)
    check_own_json("--out", command.out / "paper.json", frozenset({"schema", "checks"}))
    from ..evaluation.paper.cases import run as run_paper

    return run_paper(command.out)
