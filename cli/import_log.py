"""``motion-cueing import``: a log of a drive becomes cues, with a picture of the estimates."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
from cyclopts import Parameter

from ..envs.errors import ConfigurationError, DataError
from ..envs.logs.signals import ImportOptions, parse_columns
from ..envs.storage import check_file, write_bytes, write_text
from .arguments import Whole, option, several, with_flags

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..envs.cues import Floats
    from ..envs.logs.importer import ImportedLog

_MOST_DECIMALS: Final = 15
"""More digits than a double has are noise."""
_WINDOW_S: Final = 20.0
"""Length of a window of the spectra: resolves 0.05 Hz."""


@dataclass(frozen=True, kw_only=True)
class ImportCommand:
    """Turn a log of a drive into cues.

    Estimates from the record itself how the device sat in the car (gravity, dv/dt against the
    forward axis, v r against the lateral one, course against yaw rate), and prints the findings.
    """

    file: Annotated[Path, option("LOG")] = field(kw_only=False)
    """Log to convert: CSV of any dialect, also packed, RaceLogic VBO, ASAM MDF, MCAP, a ROS bag, or the
    folder or zip file of a phone's logger."""
    columns: Annotated[tuple[str, ...], several("SIGNAL=COLUMN[:UNIT] ...")] = ()
    """Columns to take instead of those that are found, of the signals time [s, ms, us, ns, hhmmss], force_x
    force_y force_z [m/s2, g, mg, ft/s2], rate_x rate_y rate_z [rad/s, deg/s], speed [m/s, km/h, mph, kn] and
    course [rad, deg]. The default unit is that of the file, or the first. `-` before a column reverses it; a
    number instead of one is a constant; none leaves the signal out. If all forces and rates and the time are
    given, no others are added."""
    out: Annotated[Path | None, option("FILE")] = None
    """Cues to write, as CSV; packed if the name ends in .gz. Its .findings.txt is written beside it."""
    dry_run: bool = False
    """Show the format and the columns that would be taken, with their units, and write nothing."""
    plot: Annotated[Path | None, option("FILE.png")] = None
    """Picture (PNG) to write: cues against the car's own motion, raw signals, spectra."""
    decimals: Whole | None = None
    """Digits after the point in the cues; nine significant digits if not given."""
    conversion: Annotated[ImportOptions, Parameter(name="*")] = field(default_factory=ImportOptions)
    """How the log becomes cues."""


def run(command: ImportCommand) -> int:
    """Convert, write, and print the findings."""
    if command.decimals is not None and not 0 <= command.decimals <= _MOST_DECIMALS:
        raise ConfigurationError(f"decimals is {command.decimals}; use 0 to {_MOST_DECIMALS}")
    columns, units = parse_columns(command.columns)
    if command.dry_run:
        return _show(command, columns, units)
    if command.out is None:
        raise ConfigurationError("--out is missing: name a file for the cues, or look with --dry-run")
    findings = _checked_targets(command, command.out)
    from ..envs.logs.importer import import_log

    name = findings.name.removesuffix(".findings.txt")
    with _flags():
        imported = import_log(command.file, columns, units=units, options=command.conversion, name=name)
    imported.trace.to_csv(command.out, decimals=command.decimals)
    lines = "\n".join(imported.findings.lines())
    write_text(findings, lines + "\n")
    print(lines)
    print(f"{command.out}: {len(imported.trace)} samples, {imported.trace.duration:.1f} s")
    if command.plot is not None:
        write_bytes(command.plot, import_plot(imported))
        print(f"{command.plot}: picture")
    return 0


def _show(command: ImportCommand, columns: dict[str, str], units: dict[str, str]) -> int:
    """Print what a file is, and what an import would take from it."""
    from ..envs.logs.importer import select_columns
    from ..envs.logs.readers import read_recording

    with _flags():
        recording = read_recording(command.file, command.conversion)
        print(f"format  {recording.format}")
        for table in recording.tables:
            columns_of = ", ".join(
                column.name + (f" [{column.unit}]" if column.unit else "") for column in table.columns
            )
            print(f"holds   {table.name + ': ' if table.name else ''}{columns_of}")
        selection = select_columns(recording, columns, units, command.conversion)
    for line in selection.lines():
        print(f"takes   {line}")
    print("\n--columns " + " ".join(map(shlex.quote, selection.words())))
    return 0


@contextmanager
def _flags() -> Iterator[None]:
    """Errors of an import, with options in place of fields."""
    names = [one.name for one in fields(ImportOptions)]
    try:
        yield
    except (ConfigurationError, DataError) as error:
        raise type(error)(with_flags(str(error), names)) from None


def _checked_targets(command: ImportCommand, out: Path) -> Path:
    """The file for the findings, after all targets were checked."""
    if out.resolve() == command.file.resolve():
        raise ConfigurationError(f"--out {out} is the log itself; name another file")
    check_file("--out", out)
    name = out.name.removesuffix(".gz").removesuffix(".csv")
    findings = out.with_name(f"{name}.findings.txt")
    if findings.resolve() == command.file.resolve():
        raise ConfigurationError(f"--out {out}: its findings would overwrite the log; name another file")
    check_file("--out", findings)
    if command.plot is not None:
        _check_plot(command.plot, command.file, out)
    return findings


def _check_plot(plot: Path, log: Path, out: Path) -> None:
    if plot.suffix.lower() != ".png":
        raise ConfigurationError(f"--plot {plot} does not end in .png, the only format of the picture")
    if plot.resolve() in (log.resolve(), out.resolve()):
        raise ConfigurationError(f"--plot {plot} is the log or the cues; name another file")
    check_file("--plot", plot)


def import_plot(imported: ImportedLog) -> bytes:
    """PNG with the cues against the car's own motion, the raw signals, and spectra before and after.

    A dotted line in the raw signals marks each place that was changed.
    """
    from ..evaluation.reporting.figures import new_figure, png, styled

    with styled():
        figure = new_figure(12.0, 11.0)
        figure.suptitle(f"{imported.trace.name}: findings of the import")
        _draw(figure, imported)
        return png(figure)


def _draw(figure: Figure, imported: ImportedLog) -> None:
    from ..envs.cues import GRAVITY
    from ..envs.logs.mounting import SMOOTHING_HZ
    from ..envs.logs.signals import low_pass

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
    for change in imported.findings.changes:
        for place in change.places:
            axes[3, 0].axvline(place, color="#aa3333", linestyle=":", linewidth=0.8, gid="changed")
    _spectra(axes[3, 1], imported)


def _compare(
    axes: Axes, time: Floats, measured: Floats, expected: Floats | None, names: tuple[str, str]
) -> None:
    axes.plot(time, measured, linewidth=0.7, label=names[0])
    if expected is not None:
        axes.plot(time, expected, label=names[1])
    axes.set(xlabel="time, s", ylabel="m/s²")
    axes.legend(ncols=2)


def _scatter(
    axes: Axes, measured: Floats, expected: Floats | None, names: tuple[str, str], rate_hz: float
) -> None:
    from ..envs.logs.mounting import SMOOTHING_HZ, correlation
    from ..envs.logs.signals import low_pass

    if expected is None:
        axes.text(0.5, 0.5, "no speed in the log", ha="center", va="center")
        return
    smooth_measured, smooth = (low_pass(values, rate_hz, SMOOTHING_HZ) for values in (measured, expected))
    span = np.array([smooth.min(), smooth.max()])
    axes.plot(smooth, smooth_measured, ".", markersize=1.0)
    axes.plot(span, span, color="#444444", linewidth=0.8)
    axes.set(xlabel=f"{names[1]}, m/s²", ylabel=f"{names[0]}, m/s²")
    note = f"below {SMOOTHING_HZ:g} Hz: correlation {correlation(smooth_measured, smooth):.2f}"
    axes.set_title(note, loc="right", fontweight="normal")


def _lines(axes: Axes, time: Floats, values: Floats, names: tuple[str, str, str], label: str) -> None:
    for name, column in zip(names, values.T, strict=True):
        axes.plot(time, column, linewidth=0.7, label=name)
    axes.set(xlabel="time, s", ylabel=label)
    axes.legend(ncols=3)


def _spectra(axes: Axes, imported: ImportedLog) -> None:
    from scipy.signal import welch

    rate_hz = 1.0 / imported.trace.dt
    window = min(len(imported.trace), int(_WINDOW_S * rate_hz))
    for name, values in (("raw", imported.raw_force), ("converted", imported.trace.specific_force)):
        # The trace of the spectral matrix does not depend on the axes, so raw and converted compare.
        frequency, density = welch(values - values.mean(axis=0), fs=rate_hz, nperseg=window, axis=0)
        axes.loglog(frequency[1:], density.sum(axis=1)[1:], label=name)
    axes.set(xlabel="frequency, Hz", ylabel="force, (m/s²)²/Hz")
    axes.set_ylim(bottom=1e-8)
    axes.legend(ncols=2)
