"""A plan for a whole drive, and an account of how it was found."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from ...envs.errors import DataError
from ...envs.simulator import N_AXES


@dataclass(frozen=True)
class Account:
    """How a plan was found.

    Args:
        objective: "J" or "perceived".
        claimed: What the program says the objective is over the drive.
        played: The same, of the plan played through the machine's step.
        windows: How many the drive was solved in.
        iterations: IPOPT's, of all windows and their repetitions.
        widened: Times a window was solved anew, as the plan met a limit between nodes or a singular pose.
        unconverged: Windows that ended without a minimum.
        braked: Windows without a plan that keeps the limits, in which the machine came to a stop.
        seconds: Wall-clock time it took.
    """

    objective: str
    claimed: float
    played: float
    windows: int
    iterations: int
    widened: int
    unconverged: int
    braked: int
    seconds: float

    def notes(self) -> dict[str, str]:
        """As text, for the record of a drive."""
        return {f"optimum_{name}": f"{value}" for name, value in asdict(self).items()}

    def to_json(self) -> str:
        """For :meth:`from_json`."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Account:
        """The account in a text.

        Raises:
            DataError: it is none.
        """
        try:
            return cls(**json.loads(text))
        except (TypeError, ValueError) as error:
            raise DataError(f"not the account of a plan ({error})") from None


@dataclass(frozen=True, eq=False)
class Plan:
    """Accelerations for a drive.

    Args:
        accelerations: (n, 9) of every time step, in the order of ``AXES``; k leads to sample k + 1.
        start: (9,) pose at the first sample.
        account: How they were found.
    """

    accelerations: NDArray[np.float64]
    start: NDArray[np.float64]
    account: Account

    def __post_init__(self) -> None:
        shape = np.shape(self.accelerations)
        if len(shape) != 2 or shape[1] != N_AXES or not np.all(np.isfinite(self.accelerations)):
            raise DataError(f"a plan needs finite accelerations of shape (n, {N_AXES}), found {shape}")
