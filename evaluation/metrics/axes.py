"""Metrics of one axis of specific force or angular velocity."""

from __future__ import annotations

import dataclasses
from functools import cached_property
from typing import Final

import numpy as np

from ...envs.settings import configuration
from ..trajectory import Floats
from .criteria import Criteria
from .declaration import OF_AXIS, PERCENT, SECONDS, documented, metric
from .formulas import Mask, delay, false_cues, missing_cues, normalized_rmse, pearson, rms

CUE_AXES: Final = ("f_x", "f_y", "f_z", "w_x", "w_y", "w_z")
"""Specific force (m/s^2) and angular velocity (rad/s) in the cab's axes."""
INDIFFERENCE: Final = "Indifference zone: Slob et al., Bosch Rexroth."
CLEIJ: Final = "Scaled, missing and false cues: the classes of Cleij."
GRANT: Final = "After the classification of Grant and Reid (1997, from memory)."


@dataclasses.dataclass(eq=False)
class AxisSignals:
    """The signals of one axis, m/s^2 or rad/s, and its thresholds.

    Args:
        motions: (4, n) reference and simulator cue, then the perceived ones.
        dt: Time step, s.
        zone: Indifference zone.
        threshold: Of perception.
        criteria: All thresholds.
    """

    motions: Floats
    dt: float
    zone: float
    threshold: float
    criteria: Criteria

    def __post_init__(self) -> None:
        self.reference, self.simulated, self.perceived_reference, self.perceived_simulated = self.motions

    @cached_property
    def false(self) -> Mask:
        """(n,) samples with a false cue."""
        return false_cues(self.reference, self.simulated, self.threshold)

    @cached_property
    def missing(self) -> Mask:
        """(n,) samples with a missing cue."""
        return missing_cues(self.reference, self.simulated, self.threshold)

    @property
    def scaled(self) -> Mask:
        """(n,) samples with neither: a cue of the right sign and of any size, or none to be noticed."""
        return np.asarray(~(self.false | self.missing))

    @cached_property
    def error(self) -> Floats:
        """(n,) squared error over the indifference zone."""
        return np.asarray(((self.simulated - self.reference) / self.zone) ** 2)

    @property
    def delay(self) -> float | None:
        """See :func:`delay`. Below the threshold there is nothing whose delay a driver could feel."""
        if min(np.abs(self.reference).max(), np.abs(self.simulated).max()) <= self.threshold:
            return None
        reach, least = self.criteria.delay_range, self.criteria.delay_correlation
        return delay(self.reference, self.simulated, self.dt, reach, least)


@documented
@configuration
class AxisMetrics:
    """Metrics of one axis of :data:`CUE_AXES`."""

    rmse: float = metric(
        lambda a: rms(a.simulated - a.reference),
        "√mean(e²).",
        "m/s² or rad/s", "RMSE", OF_AXIS,
    )  # fmt: skip
    nrmse: float = metric(
        lambda a: normalized_rmse(a.reference, a.simulated, a.threshold),
        "rmse / max(√mean(c²), perception threshold). No motion has 1 where the car moves. Where it hardly "
        "moves, the error is read in thresholds.",
        header="normalized",
    )
    correlation: float | None = metric(
        lambda a: pearson(a.reference, a.simulated),
        "Pearson's r of c and s. Undefined where a standard deviation is below 10⁻⁶.",
        header="correlation", better="higher",
        source="An objective indicator of motion cueing in Casas et al.",
    )  # fmt: skip
    delay: float | None = metric(
        lambda a: a.delay,
        "The lag τ in ±1 s with the highest Pearson correlation of c(t) and s(t + τ) over their overlap, "
        "refined by a parabola; positive: the simulator is late. The range is at most a quarter of the "
        "drive. Undefined where car or simulator never exceeds the threshold, where the highest correlation "
        "is below 0.5, or where it lies at the end of the range.",
        "s", "delay", SECONDS, better="",
    )  # fmt: skip
    false_cues: float = metric(
        lambda a: float(a.false.mean()),
        "Share of samples with |s| > threshold, |e| > threshold, and (|c| ≤ threshold or c·s < 0): motion "
        "where the car has none, or of the wrong sign.",
        header="false", display=PERCENT, source=GRANT,
    )  # fmt: skip
    missing_cues: float = metric(
        lambda a: float(a.missing.mean()),
        "Share of samples with |c| > threshold, |s| ≤ threshold, |e| > threshold.",
        header="missing", display=PERCENT, source=GRANT,
    )  # fmt: skip
    cue_error: float = metric(
        lambda a: float(a.error.mean()),
        "mean(e²) / zone²: this axis's part of J.",
        header="part of J", source=INDIFFERENCE,
    )  # fmt: skip
    cue_error_false: float = metric(
        lambda a: float(np.mean(a.error * a.false)),
        "The part of `cue_error` that arises in samples with a false cue, divided by all samples.",
    )
    cue_error_missing: float = metric(
        lambda a: float(np.mean(a.error * a.missing)),
        "The part of `cue_error` that arises in samples with a missing cue, divided by all samples.",
    )
    cue_error_scaled: float | None = metric(
        lambda a: float(np.mean(a.error * a.scaled)),
        "The part of `cue_error` that arises in all other samples, divided by all samples: a cue of the "
        "right sign with the wrong size or at the wrong time, or too small a one to be noticed. "
        "The three parts sum to `cue_error`.",
        source=CLEIJ, default=None,
    )  # fmt: skip
    perceived_rmse: float = metric(
        lambda a: rms(a.perceived_simulated - a.perceived_reference),
        "`rmse` of the perceived cues.",
        "m/s² or rad/s", "perceived RMSE", OF_AXIS,
    )  # fmt: skip
    perceived_nrmse: float = metric(
        lambda a: normalized_rmse(a.perceived_reference, a.perceived_simulated, a.threshold),
        "`nrmse` of the perceived cues.",
    )
    perceived_cue_error: float = metric(
        lambda a: float(np.mean(((a.perceived_simulated - a.perceived_reference) / a.zone) ** 2)),
        "`cue_error` of the perceived cues: this axis's part of the perceived J.",
        header="perceived part",
    )
