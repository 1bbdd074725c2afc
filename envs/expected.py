"""Expected cues: what is taken for the cues ahead at each sample of a drive, where the true ones are unknown.

A drive that carries expected cues shows them to every policy with a preview, in place of the truth. They come
from a predictor, or hold the present cue.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from .errors import DataError

Floats = NDArray[np.float64]

Preview = Literal["true", "held", "predicted"]
"""Where a policy with a preview has it from: the drive itself, the present cue, or a predictor."""

PREVIEWS: Final[tuple[Preview, ...]] = ("true", "held", "predicted")


@dataclass(frozen=True, eq=False)
class ExpectedCues:
    """Expected cues at each sample of a drive.

    Args:
        leads: (m,) times ahead, s, increasing from above 0.
        mean: (n, m, 6) specific force, m/s^2, and angular velocity, rad/s.
        spread: (n, m, 6) standard deviation of the same; None where it is not known.
    """

    leads: Floats
    mean: Floats
    spread: Floats | None = None

    def __post_init__(self) -> None:
        if self.mean.ndim != 3 or self.mean.shape[1:] != (len(self.leads), 6):
            raise DataError(f"expected cues have shape {self.mean.shape}, expected (n, {len(self.leads)}, 6)")
        if not np.isfinite(self.mean).all():
            raise DataError("expected cues must be finite")

    def __len__(self) -> int:
        return len(self.mean)

    def weights(self, times: Floats) -> Floats:
        """(t, m + 1) from the cue now and those at the leads to those at ``times`` (t,), s.

        Linear between leads, held after the last one.
        """
        nodes = np.concatenate(([0.0], self.leads))
        return np.array([np.interp(times, nodes, unit) for unit in np.eye(len(nodes))]).T

    def at(self, now: Floats, times: Floats, samples: slice = slice(None)) -> Floats:
        """(k, t, 6) at ``times`` (t,), s, for samples whose cues are ``now`` (k, 6)."""
        known = np.concatenate((now[:, None, :], self.mean[samples]), axis=1)
        return np.asarray(np.einsum("tm,kmc->ktc", self.weights(times), known))


def held(cues: Floats) -> ExpectedCues:
    """The present cue for ever; ``cues`` are (n, 6) of the drive."""
    return ExpectedCues(np.ones(1), cues[:, None, :])
