"""The log of a training: means since the last row, in a CSV file and for TensorBoard."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray
from torch.utils.tensorboard import SummaryWriter

from ..envs.errors import DataError
from ..envs.storage import write_text
from ..envs.task.kernels.reward import TERMS


class Monitor:
    """Sums reward and its terms over steps, and returns and lengths over episodes that ended."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}
        self._steps, self._episodes = 0, 0

    def step(
        self, reward: NDArray[Any], terms: NDArray[Any], infos: Sequence[Mapping[str, Any]] = ()
    ) -> None:
        """Add a step.

        Args:
            reward: (n,) of each environment.
            terms: (n, N_TERMS) terms of the reward.
            infos: Of each environment; ``episode`` where one has ended, as ``Monitor`` of
                Stable-Baselines3 writes it.
        """
        self._steps += 1
        self._add("rollout/reward", float(reward.mean()))
        for name, value in zip(TERMS, terms.mean(axis=0).tolist(), strict=True):
            self._add(f"terms/{name}", value)
        for info in infos:
            if "episode" in info:
                self._episodes += 1
                self._add("rollout/episode_return", info["episode"]["r"])
                self._add("rollout/episode_steps", info["episode"]["l"])

    def _add(self, name: str, value: float) -> None:
        self._sums[name] = self._sums.get(name, 0.0) + float(value)

    def take(self) -> dict[str, float]:
        """The means, and begin anew; empty where nothing was played."""
        counts = {name: self._episodes if "episode" in name else self._steps for name in self._sums}
        means = {name: total / counts[name] for name, total in self._sums.items()}
        self._sums, self._steps, self._episodes = {}, 0, 0
        return means

    def state(self) -> dict[str, Any]:
        """The sums, for :meth:`restore`."""
        return {"sums": dict(self._sums), "steps": self._steps, "episodes": self._episodes}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self._sums = dict(state["sums"])
        self._steps, self._episodes = state["steps"], state["episodes"]


STEPS: Final = "steps"
"""Column of the actions so far."""

LOG: Final = "log.csv"
"""Its name in the folder of a training."""

_EVENTS: Final = "tensorboard"


class TrainingLog:
    """Scalars by name over steps.

    A scalar that appears later adds a column. Rows are kept in memory, a few hundred a training.

    Args:
        folder: Of the training.
        steps: Actions so far; later rows, of a training that was broken off, are dropped.
    """

    def __init__(self, folder: Path, steps: int = 0) -> None:
        self._path = folder / LOG
        self.rows = [row for row in read_log(folder) if row[STEPS] <= steps]
        self._events: Any = SummaryWriter(str(folder / _EVENTS), purge_step=steps + 1)

    def last(self, name: str) -> float | None:
        """The latest value of a scalar; None where there is none yet."""
        return next((row[name] for row in reversed(self.rows) if name in row), None)

    def write(self, steps: int, scalars: Mapping[str, float]) -> None:
        """Add a row; scalars of the same steps join the row there is."""
        if not scalars:
            return
        if not self.rows or self.rows[-1][STEPS] != steps:
            self.rows.append({STEPS: float(steps)})
        self.rows[-1].update(scalars)
        for name, value in scalars.items():
            self._events.add_scalar(name, value, steps)
        self._events.flush()
        self._save()

    def _save(self) -> None:
        names = list(dict.fromkeys(name for row in self.rows for name in row))
        text = io.StringIO()
        table = csv.DictWriter(text, names, lineterminator="\n")
        table.writeheader()
        for row in self.rows:
            table.writerow({name: f"{value:.9g}" for name, value in row.items()})
        write_text(self._path, text.getvalue())

    def close(self) -> None:
        """Close TensorBoard's file."""
        self._events.close()


def read_log(folder: Path) -> list[dict[str, float]]:
    """The rows of a training's log; a row has only its own scalars.

    Raises:
        DataError: the file is broken.
    """
    path = folder / LOG
    if not path.exists():
        return []
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
            scalars = [{name: float(text) for name, text in row.items() if text} for row in rows]
    except (OSError, ValueError, TypeError) as error:
        raise DataError(f"{path}: not the log of a training ({error})") from None
    if any(STEPS not in row for row in scalars):
        raise DataError(f"{path}: not the log of a training (column {STEPS} is missing)")
    return scalars
