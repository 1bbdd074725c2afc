"""``motion-cueing import``: a log of a drive becomes cues, with a picture of what was found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter

from ..envs.errors import ConfigurationError
from ..envs.logs.signals import ImportOptions, parse_columns
from ..envs.storage import check_file, write_bytes
from .arguments import Whole, option, several

_MOST_DECIMALS: Final = 15
"""More digits than a double has are noise."""


@dataclass(frozen=True, kw_only=True)
class ImportCommand:
    """Turn a log of a drive into cues.

    Estimates from the record itself how the device sat in the car (gravity, dv/dt against the
    forward axis, v r against the lateral one, course against yaw rate), and prints what it found.
    """

    file: Annotated[Path, option("LOG")] = field(kw_only=False)
    """Log to convert: CSV with a header row, or .csv.gz."""
    columns: Annotated[tuple[str, ...], several("SIGNAL=COLUMN[:UNIT] ...")]
    """Columns of the signals time [s, ms, us], force_x force_y force_z [m/s2, g], rate_x rate_y rate_z
    [rad/s, deg/s], speed [m/s, km/h, mph] and course [rad, deg]; the first unit is the default. `-`
    before a column reverses it; a number instead of one is a constant. Speed and course may be missing."""
    out: Annotated[Path, option("FILE")]
    """Cues to write, as CSV; packed if the name ends in .gz."""
    plot: Annotated[Path | None, option("FILE.png")] = None
    """Picture (PNG) to write: cues against the car's own motion, raw signals, spectra."""
    decimals: Whole | None = None
    """Digits after the point in the cues; nine significant digits if not given."""
    conversion: Annotated[ImportOptions, Parameter(name="*")] = field(default_factory=ImportOptions)
    """How the log becomes cues."""


def run(command: ImportCommand) -> int:
    """Convert, write, and print the findings.

    Raises:
        MotionCueingError: the log or an argument is wrong.
    """
    if command.decimals is not None and not 0 <= command.decimals <= _MOST_DECIMALS:
        raise ConfigurationError(f"decimals is {command.decimals}; use 0 to {_MOST_DECIMALS}")
    if command.out.resolve() == command.file.resolve():
        raise ConfigurationError(f"--out {command.out} is the log itself; name another file")
    check_file("--out", command.out)
    if command.plot is not None:
        _check_plot(command.plot, command)
    from ..envs.logs.importer import import_log

    columns, units = parse_columns(command.columns)
    name = command.out.name.removesuffix(".gz").removesuffix(".csv")
    imported = import_log(command.file, columns, units=units, options=command.conversion, name=name)
    imported.trace.to_csv(command.out, decimals=command.decimals)
    print("\n".join(imported.findings.lines()))
    print(f"{command.out}: {len(imported.trace)} samples, {imported.trace.duration:.1f} s")
    if command.plot is not None:
        from .import_figure import import_plot

        write_bytes(command.plot, import_plot(imported))
        print(f"{command.plot}: picture")
    return 0


def _check_plot(plot: Path, command: ImportCommand) -> None:
    if plot.suffix.lower() != ".png":
        raise ConfigurationError(f"--plot {plot} does not end in .png, the only format of the picture")
    if plot.resolve() in (command.file.resolve(), command.out.resolve()):
        raise ConfigurationError(f"--plot {plot} is the log or the cues; name another file")
    check_file("--plot", plot)
