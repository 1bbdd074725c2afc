"""Choices of an import: the rate, the filter, gaps, and what shall not be estimated."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from ..settings import NonNegative, Positive, Vector3, configuration

Sign = Literal["estimate", "keep", "flip"]


@configuration
class ImportOptions:
    """How a log becomes cues. Angles are in degrees because a person types them."""

    rate_hz: Annotated[float, Field(ge=2.0, le=1000.0)] = 100.0
    """Sample rate of the result, 2 to 1000 Hz: the estimates need signals up to 0.5 Hz, and no device in
    a car gives more than a thousand samples a second."""

    cutoff_hz: Positive = 5.0
    """Cut-off of the zero-phase low-pass on force and rates, Hz. Driving itself ends near 3 Hz;
    what is above is road, engine and the holder of the device. Below half the rate."""

    start_s: NonNegative = 0.0
    """What comes earlier in the log is left out, s from its first stamp."""

    end_s: Positive | None = None
    """What comes later in the log is left out, s from its first stamp."""

    gaps: Literal["refuse", "bridge"] = "refuse"
    """Refuse missing data (long steps, repeated stamps, empty cells), or bridge it by interpolation."""

    longest_step_s: Positive = 0.2
    """A longer step between samples is a gap, s."""

    longest_gap_s: Positive = 2.0
    """A longer gap is refused even when bridging, s."""

    standstill_m_s: NonNegative = 0.3
    """The car counts as standing below this speed, m/s."""

    roll_deg: float | None = None
    """Roll of the device in the car, right side down positive; estimated from gravity if not given."""

    pitch_deg: float | None = None
    """Pitch of the device in the car, nose up positive; estimated from gravity if not given."""

    yaw_deg: float | None = None
    """Yaw of the device in the car, to the right positive; estimated from dv/dt and v r if not given."""

    lateral_sign: Sign = "estimate"
    """Whether the lateral axis is mirrored (left-handed force axes); estimated from v r."""

    rate_sign: Sign = "estimate"
    """Whether the angular rates are reversed; estimated from the course, if there is one."""

    gravity_m_s2: Positive | None = None
    """Gravity as the device measures it; estimated if not given. The difference to 9.81 is taken as a
    bias of the vertical axis."""

    rate_bias_deg_s: Vector3 | None = None
    """Bias of the rates about the car's axes; estimated if not given."""

    speed_delay_s: float | None = None
    """How long the speed lags behind the force; estimated if not given, s."""

    @field_validator("cutoff_hz")
    @classmethod
    def _below_half_the_rate(cls, cutoff_hz: float, info: ValidationInfo) -> float:
        # A rate that is itself wrong is missing here, and is reported on its own.
        rate_hz = info.data.get("rate_hz")
        if rate_hz is not None and cutoff_hz >= 0.5 * rate_hz:
            raise ValueError(f"must be below half of rate_hz, {0.5 * rate_hz:g} Hz")
        return cutoff_hz
