"""Forecasts of the cues by lead time: a predictor beside what needs none, and the calibration of its spread.

- *held*: the present cue for ever;
- *decay*: to the low-pass of the past, and that to rest, as predictive control without a preview has it;
- *predicted*: by the predictor.

The truth has no error. Errors are root mean squares over all samples of all drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import lfilter

from ...baselines.mpc.parameters import Forecast
from ...envs.cues import CueTrace
from ...envs.expected import ExpectedCues, held
from ...envs.simulator.simulator import TIME_STEP
from ...envs.task.predictor import REST, Predictor, cues_of
from ..reporting.figures import new_figure, styled
from ..reporting.text import TextTable, number, percent

Floats = NDArray[np.float64]

LEADS: Final = (0.2, 0.5, 1.0, 2.0, 3.0)
"""Lead times of the table, s."""

METHODS: Final = ("held", "decay", "predicted")

SHOWN: Final = (("f_x", 0, 1.0, "m/s²"), ("f_y", 1, 1.0, "m/s²"), ("w_z", 5, 180.0 / np.pi, "deg/s"))
"""Cues of the table: name, entry, factor and unit."""


@dataclass(frozen=True, eq=False)
class Forecasts:
    """Errors by lead time.

    Args:
        leads: (m,) s.
        errors: (m, 6) root mean square of each method, m/s^2 and rad/s.
        within: (2, m, 6) share of samples whose error is within one and two spreads of the predictor's.
    """

    leads: Floats
    errors: dict[str, Floats]
    within: Floats


def measure_forecasts(
    predictor: Predictor, drives: Sequence[CueTrace], leads: Sequence[float] = LEADS
) -> Forecasts:
    """Forecast at each sample of drives.

    Args:
        predictor: The predictor.
        drives: That it has never learned from.
        leads: Times ahead, s.
    """
    times = np.array(leads)
    squares = {method: np.zeros((len(times), 6)) for method in METHODS}
    within, count = np.zeros((2, len(times), 6)), 0
    for drive in drives:
        drive = drive.resampled(TIME_STEP)
        cues, known = cues_of(drive), predictor(drive)
        truth = _later(cues, times)
        answers = {
            "held": held(cues).at(cues, times),
            "decay": decaying(cues, times),
            "predicted": known.at(cues, times),
        }
        for method, answer in answers.items():
            squares[method] += np.sum((answer - truth) ** 2, axis=0)
        spread = _spread(known, times)
        for k in range(2):
            within[k] += np.sum(np.abs(answers["predicted"] - truth) <= (k + 1) * spread, axis=0)
        count += len(drive)
    return Forecasts(times, {m: np.sqrt(s / count) for m, s in squares.items()}, within / count)


def decaying(cues: Floats, times: Floats, forecast: Forecast | None = None) -> Floats:
    """(n, t, 6) at times ahead, s, of cues (n, 6): the transient part decays, and then the sustained one."""
    given = forecast or Forecast()
    gain = 1.0 - np.exp(-TIME_STEP / given.memory)
    sustained = lfilter([gain], [1.0, gain - 1.0], cues, axis=0, zi=(1.0 - gain) * cues[:1])[0]
    decay = np.exp(-times[:, None] / np.array([*given.force_decay, *[given.rate_decay] * 3]))
    lasting = np.exp(-times / given.lasting_decay)[:, None]
    return np.asarray(
        REST + lasting * (sustained - REST)[:, None, :] + decay * (cues - sustained)[:, None, :]
    )


def _later(cues: Floats, times: Floats) -> Floats:
    index = np.arange(len(cues))[:, None] + np.round(times / TIME_STEP).astype(int)
    return np.asarray(cues[np.minimum(index, len(cues) - 1)])


def _spread(known: ExpectedCues, times: Floats) -> Floats:
    """(n, t, 6) spread at times ahead, linear between leads and from 0 now."""
    assert known.spread is not None
    return np.asarray(np.einsum("tm,kmc->ktc", known.weights(times)[:, 1:], known.spread))


def forecast_table(found: Forecasts) -> TextTable:
    """Errors of each method, and the share within one and two spreads, at each lead time."""
    header = ["lead, s"]
    header += [f"{name} {method}, {unit}" for name, _, _, unit in SHOWN for method in METHODS]
    header += ["within 1 spread, %", "within 2, %"]
    rows = []
    for i, lead in enumerate(found.leads):
        cells = [f"{lead:g}"]
        cells += [number(factor * found.errors[m][i, k]) for _, k, factor, _ in SHOWN for m in METHODS]
        cells += [percent(float(np.mean(share[i, [0, 1, 5]]))) for share in found.within]
        rows.append(tuple(cells))
    return TextTable("Error of forecasts by lead time (root mean square)", tuple(header), tuple(rows))


def forecast_figure(found: Forecasts) -> Figure:
    """Errors over the lead time: a panel a cue, a line a method."""
    with styled():
        figure = new_figure(9.0, 3.2)
        panels = figure.subplots(1, len(SHOWN))
        for axes, (name, k, factor, unit) in zip(panels, SHOWN, strict=True):
            for method, style in zip(METHODS, (":", "--", "-"), strict=True):
                axes.plot(found.leads, factor * found.errors[method][:, k], style, label=method, marker="o")
            axes.set_title(f"{name}, {unit}")
            axes.set_xlabel("lead time, s")
            axes.set_ylim(bottom=0.0)
        panels[0].legend()
    return figure
