"""Metrics: how well the motion of a simulator follows that of a car, and how the machine was used.

A metric is declared once, as a field of :class:`Metrics` (a drive), :class:`AxisMetrics` or
:class:`ActuatorMetrics`: see :func:`metric`. Tables, ``results.csv``, ``results.json``, reports, studies and
the page of metrics read this declaration. To add a metric, add a field with its function there.

In formulas c is the signal of the car on one axis, s that of the simulator, and e = s - c.
"""

from .actuators import ActuatorMetrics, ActuatorSignals
from .axes import CUE_AXES, AxisMetrics, AxisSignals
from .comfort import WD, WF, WK, Weighting, motion_sickness_dose, vibration_total
from .criteria import Criteria, References
from .declaration import (
    ACCELERATION,
    DEGREES_PER_SECOND,
    EVERY_TABLE,
    JERK,
    MICROSECONDS,
    OF_AXIS,
    PERCENT,
    PLAIN,
    SECONDS,
    TIME,
    Display,
    Metric,
    Table,
    declared,
    mean,
    metric,
    undefined,
)
from .drive import (
    METRICS,
    DriveSignals,
    Metrics,
    cab_motion,
    cue_error,
    measure,
    over_drives,
    perceived_motion,
    tilt_rate,
)
from .feel import incongruence, jerk, worst_window
from .formulas import (
    FLAT,
    beyond,
    correlation_by_lag,
    delay,
    false_cues,
    missing_cues,
    normalized_rmse,
    pearson,
    rms,
    vibration,
)
from .sickness import ConflictModel, HeadMotion, sickness_incidence

__all__ = [
    "ACCELERATION",
    "CUE_AXES",
    "DEGREES_PER_SECOND",
    "EVERY_TABLE",
    "FLAT",
    "JERK",
    "METRICS",
    "MICROSECONDS",
    "OF_AXIS",
    "PERCENT",
    "PLAIN",
    "SECONDS",
    "TIME",
    "WD",
    "WF",
    "WK",
    "ActuatorMetrics",
    "ActuatorSignals",
    "AxisMetrics",
    "AxisSignals",
    "ConflictModel",
    "Criteria",
    "Display",
    "DriveSignals",
    "HeadMotion",
    "Metric",
    "Metrics",
    "References",
    "Table",
    "Weighting",
    "beyond",
    "cab_motion",
    "correlation_by_lag",
    "cue_error",
    "declared",
    "delay",
    "false_cues",
    "incongruence",
    "jerk",
    "mean",
    "measure",
    "metric",
    "missing_cues",
    "motion_sickness_dose",
    "normalized_rmse",
    "over_drives",
    "pearson",
    "perceived_motion",
    "rms",
    "sickness_incidence",
    "tilt_rate",
    "undefined",
    "vibration",
    "vibration_total",
    "worst_window",
]
