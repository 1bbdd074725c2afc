"""The picture of an import: whether the estimated mounting makes the record agree with itself."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import welch

from ..envs.cues import GRAVITY, Floats
from ..envs.logs.importer import ImportedLog
from ..envs.logs.mounting import SMOOTHING_HZ, correlation
from ..envs.logs.signals import low_pass
from ..evaluation.reporting.figures import new_figure, png, styled

_WINDOW_S = 20.0
"""Length of a window of the spectra: resolves 0.05 Hz."""

Names = tuple[str, str]


def import_plot(imported: ImportedLog) -> bytes:
    """PNG with the cues against the car's own motion, the raw signals, and spectra before and after."""
    with styled():
        figure = new_figure(12.0, 11.0)
        figure.suptitle(f"{imported.trace.name}: what the import found")
        _draw(figure, imported)
        return png(figure)


def _draw(figure: Figure, imported: ImportedLog) -> None:
    axes = figure.subplots(4, 2)
    trace = imported.trace
    rate_hz = 1.0 / trace.dt
    speed = trace.channels.get("speed_m_s")
    along = None if speed is None else np.gradient(low_pass(speed, rate_hz, SMOOTHING_HZ), trace.dt)
    across = None if speed is None else speed * trace.angular_velocity[:, 2]
    _compare(axes[0, 0], trace.time, trace.specific_force[:, 0], along, ("f_x", "dv/dt"))
    _compare(axes[1, 0], trace.time, trace.specific_force[:, 1], across, ("f_y", "v r"))
    _scatter(axes[0, 1], trace.specific_force[:, 0], along, ("f_x", "dv/dt"), rate_hz)
    _scatter(axes[1, 1], trace.specific_force[:, 1], across, ("f_y", "v r"), rate_hz)
    rest = np.full(len(trace), -GRAVITY)
    _compare(axes[2, 0], trace.time, trace.specific_force[:, 2], rest, ("f_z", "at rest"))
    _lines(axes[2, 1], trace.time, np.degrees(trace.angular_velocity), ("p", "q", "r"), "rates, deg/s")
    _lines(axes[3, 0], trace.time, imported.raw_force, ("x", "y", "z"), "raw, device axes, m/s²")
    _spectra(axes[3, 1], imported)


def _compare(
    axes: Axes, time: Floats, found: Floats, expected: Floats | None, names: tuple[str, str]
) -> None:
    axes.plot(time, found, linewidth=0.7, label=names[0])
    if expected is not None:
        axes.plot(time, expected, label=names[1])
    axes.set(xlabel="time, s", ylabel="m/s²")
    axes.legend(ncols=2)


def _scatter(axes: Axes, found: Floats, expected: Floats | None, names: Names, rate_hz: float) -> None:
    if expected is None:
        axes.text(0.5, 0.5, "no speed in the log", ha="center", va="center")
        return
    smooth_found, smooth = (low_pass(values, rate_hz, SMOOTHING_HZ) for values in (found, expected))
    span = np.array([smooth.min(), smooth.max()])
    axes.plot(smooth, smooth_found, ".", markersize=1.0)
    axes.plot(span, span, color="#444444", linewidth=0.8)
    axes.set(xlabel=f"{names[1]}, m/s²", ylabel=f"{names[0]}, m/s²")
    note = f"below {SMOOTHING_HZ:g} Hz: correlation {correlation(smooth_found, smooth):.2f}"
    axes.set_title(note, loc="right", fontweight="normal")


def _lines(axes: Axes, time: Floats, values: Floats, names: tuple[str, str, str], label: str) -> None:
    for name, column in zip(names, values.T, strict=True):
        axes.plot(time, column, linewidth=0.7, label=name)
    axes.set(xlabel="time, s", ylabel=label)
    axes.legend(ncols=3)


def _spectra(axes: Axes, imported: ImportedLog) -> None:
    rate_hz = 1.0 / imported.trace.dt
    window = min(len(imported.trace), int(_WINDOW_S * rate_hz))
    for name, values in (("raw", imported.raw_force), ("converted", imported.trace.specific_force)):
        # The trace of the spectral matrix does not depend on the axes, so raw and converted compare.
        frequency, density = welch(values - values.mean(axis=0), fs=rate_hz, nperseg=window, axis=0)
        axes.loglog(frequency[1:], density.sum(axis=1)[1:], label=name)
    axes.set(xlabel="frequency, Hz", ylabel="force, (m/s²)²/Hz")
    axes.set_ylim(bottom=1e-8)
    axes.legend(ncols=2)
