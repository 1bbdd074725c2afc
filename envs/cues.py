"""Cue traces: the specific force and angular velocity of a car over time, and their CSV form."""

from __future__ import annotations

import csv
import gzip
import hashlib
import io
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ConfigurationError, DataError, reason
from .expected import ExpectedCues
from .limits import MOST_CELLS, MOST_COLUMNS, read_table_text
from .road import RoadMap
from .settings import NonNegative, configuration
from .storage import write_bytes, write_text

Floats = NDArray[np.float64]

GRAVITY: Final = 9.81
"""Acceleration due to gravity, m/s^2, along +z (down)."""

CSV_COLUMNS: Final = (
    "time_s",
    "specific_force_x_m_s2",
    "specific_force_y_m_s2",
    "specific_force_z_m_s2",
    "angular_velocity_x_rad_s",
    "angular_velocity_y_rad_s",
    "angular_velocity_z_rad_s",
)
"""Columns every cue CSV has; further numeric columns become channels."""

CONTROLS: Final = (
    "steering_wheel_rad",
    "throttle",
    "brake",
    "speed_m_s",
    "lateral_speed_m_s",
)
"""Channels of the driver's controls and the car's state that a policy may see."""

_MOST_SAMPLES: Final = 10_000_000
"""Of a resampled trace: more than a day at 100 Hz, and about a gigabyte."""

_LARGEST: Final = {"m_s2": (1000.0, "m/s^2"), "rad_s": (100.0, "rad/s")}
"""More than any car does, by the end of a column's name: the column is in another unit, or damaged."""

_TIME_TOLERANCE: Final = 1e-3
"""Largest deviation of a time step from the mean step, relative."""


_Scales = tuple[NonNegative, NonNegative, NonNegative]

_SCALED: Final[Mapping[str, tuple[int, ...]]] = {
    "force": (0, 1, 2),
    "rates": (3, 4, 5),
    **{name: (k,) for k, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw"))},
}
"""Entries of a scale by the names that stand for them."""


@configuration
class CueScale:
    """Motion scale: the share of the car's cues that a simulator shall give, axis by axis.

    Small motion bases are driven at a scale below 1, and 1 is judged too strong by many drivers (Gracio et
    al.). A scaled reference is both the input of a policy and the reference of the cue error. Gravity is not
    scaled.

    Args:
        force: Of specific force beyond gravity: x, y, z.
        rates: Of angular velocity: roll, pitch, yaw.
    """

    force: _Scales = (1.0, 1.0, 1.0)
    rates: _Scales = (1.0, 1.0, 1.0)

    @classmethod
    def parse(cls, text: str) -> CueScale:
        """A scale from text: ``0.6``, or ``force=0.6,rates=0.5``; ``x y z roll pitch yaw`` name single axes.

        Of several that name the same axis the last one counts.

        Raises:
            ConfigurationError: the text is neither.
        """
        values = [1.0] * 6
        try:
            for part in text.split(","):
                name, equals, number = part.partition("=")
                for k in _SCALED[name.strip()] if equals else range(6):
                    values[k] = float(number if equals else name)
        except (KeyError, ValueError):
            raise ConfigurationError(
                f"scale {text!r} is not understood; give a number such as 0.6, or one each of "
                f"{', '.join(_SCALED)}, such as force=0.6,rates=0.5"
            ) from None
        return cls((values[0], values[1], values[2]), (values[3], values[4], values[5]))

    def __str__(self) -> str:
        """As :meth:`parse` takes it, the shortest form."""
        values = (*self.force, *self.rates)
        if len(set(values)) == 1:
            return f"{values[0]:g}"
        if len(set(self.force)) == len(set(self.rates)) == 1:
            return f"force={self.force[0]:g},rates={self.rates[0]:g}"
        return ",".join(f"{name}={value:g}" for name, value in zip([*_SCALED][2:], values, strict=True))

    @property
    def neutral(self) -> bool:
        """Whether it leaves cues as they are."""
        return self == UNSCALED

    def of_force(self, force: Floats) -> Floats:
        """Specific force (..., 3), m/s^2, with the part beyond gravity scaled."""
        rest = np.array([0.0, 0.0, -GRAVITY])
        return np.asarray(rest + np.array(self.force) * (force - rest))

    def of_rates(self, rates: Floats) -> Floats:
        """Angular velocity or acceleration (..., 3), scaled."""
        return np.asarray(np.array(self.rates) * rates)

    def times(self, other: CueScale) -> CueScale:
        """Both, one after the other."""
        force, rates = np.multiply(self.force, other.force), np.multiply(self.rates, other.rates)
        return CueScale(tuple(force.tolist()), tuple(rates.tolist()))


UNSCALED: Final = CueScale()
"""The neutral scale, 1:1."""


@dataclass(frozen=True, eq=False)
class CueTrace:
    """Specific force and angular velocity of a car over time, at its cab's reference point (F_A).

    Any arrays can fill it; they are copied, checked and made read-only.

    Args:
        name: What the drive is called in tables and file names.
        time: (n,) seconds, strictly increasing in equal steps.
        specific_force: (n, 3) f = a - g in F_A (x forward, y right, z down), m/s^2.
        angular_velocity: (n, 3) of the car's body in F_A, rad/s.
        angular_acceleration: (n, 3) rad/s^2; central differences of the angular velocity if not given.
        channels: Further signals of the car, each (n,), such as ``speed_m_s``. Policies see those of
            :data:`CONTROLS`, where they are made for them, and no others.
        source: Where the trace comes from, for reports.
        scale: By which the cues have been scaled already, see :meth:`scaled`.
        road: Road ahead: what a map and a scenario know; None where nothing is known.
        expected: Expected cues, which policies with a preview see in place of the true ones; None for these.

    Raises:
        DataError: a shape is wrong, a value is not finite, or time does not advance in equal steps.
    """

    name: str
    time: Floats
    specific_force: Floats
    angular_velocity: Floats
    angular_acceleration: Floats = None  # type: ignore[assignment]  # filled below
    channels: Mapping[str, Floats] = field(default_factory=dict)
    source: str = ""
    scale: CueScale = UNSCALED
    road: RoadMap | None = None
    expected: ExpectedCues | None = None

    def __post_init__(self) -> None:
        time = _checked(self.name, "time", self.time, (None,))
        n = len(time)
        if n < 2:
            raise DataError(f"{self.name}: time has {n} samples; a trace needs at least 2")
        _check_steps(self.name, time)
        object.__setattr__(self, "time", time)
        for label in ("specific_force", "angular_velocity"):
            object.__setattr__(self, label, _checked(self.name, label, getattr(self, label), (n, 3)))
        acceleration: Any = self.angular_acceleration
        if acceleration is None:
            acceleration = np.gradient(self.angular_velocity, self.dt, axis=0)
        acceleration = _checked(self.name, "angular_acceleration", acceleration, (n, 3))
        object.__setattr__(self, "angular_acceleration", acceleration)
        channels = {key: _checked(self.name, key, value, (n,)) for key, value in self.channels.items()}
        object.__setattr__(self, "channels", channels)
        if self.road is not None and len(self.road) != n:
            raise DataError(f"{self.name}: road has {len(self.road)} samples, expected {n}")
        if self.expected is not None and len(self.expected) != n:
            raise DataError(f"{self.name}: expected cues have {len(self.expected)} samples, not {n}")

    def __len__(self) -> int:
        return len(self.time)

    @property
    def dt(self) -> float:
        """Time step, s."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    @property
    def duration(self) -> float:
        """From the first sample to the last, s."""
        return float(self.time[-1] - self.time[0])

    def digest(self) -> str:
        """SHA-256 of the motion, in hexadecimal: the same for the same motion, whatever the name.

        It covers the time step, specific force, angular velocity and angular acceleration, to the bit; not
        the name, the source or the channels.
        """
        found = hashlib.sha256()
        motion = (self.specific_force, self.angular_velocity, self.angular_acceleration)
        for values in (np.float64(self.dt), *motion):
            found.update(f"{values.shape}".encode())
            # One byte order, so that the same drive has the same digest on every machine.
            found.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
        return found.hexdigest()

    def at_point(self, offset: ArrayLike) -> Floats:
        """Specific force (n, 3) at a point fixed to the car, ``offset`` (3,) in meters from F_A's origin.

        f_P = f_A + (Omegadot + Omega Omega) OP, the rigid-body part of Eq. (37).
        """
        arm = np.broadcast_to(_checked(self.name, "offset", offset, (3,)), (len(self), 3))
        omega = self.angular_velocity
        tangential = np.cross(self.angular_acceleration, arm)
        return np.asarray(self.specific_force + tangential + np.cross(omega, np.cross(omega, arm)))

    def scaled(self, scale: CueScale) -> CueTrace:
        """The reference at a motion scale: the one place where a drive is scaled.

        The channels stay: they are the car's. A neutral scale returns the trace itself.

        Raises:
            DataError: the drive carries expected cues; these come after the scale.
        """
        if scale.neutral:
            return self
        if self.expected is not None:
            raise DataError(f"{self.name}: a drive with expected cues cannot be scaled")
        return replace(
            self,
            specific_force=scale.of_force(self.specific_force),
            angular_velocity=scale.of_rates(self.angular_velocity),
            angular_acceleration=scale.of_rates(self.angular_acceleration),
            scale=self.scale.times(scale),
        )

    def resampled(self, dt: float) -> CueTrace:
        """The trace at another time step, by linear interpolation between samples.

        A trace that already has this step is returned as it is. Nothing is filtered: before going to a
        longer step, take out what is above half the new rate, or it folds back into the cues.

        Args:
            dt: New time step, s.

        Raises:
            DataError: the step is not positive, or gives fewer than 2 or more than 10 million samples.
        """
        if not dt > 0.0:
            raise DataError(f"{self.name}: time step must be positive, found {dt}")
        if abs(self.dt / dt - 1.0) <= 1e-9:
            return self
        if self.expected is not None:
            raise DataError(f"{self.name}: a drive with expected cues keeps its time step")
        steps = self.duration / dt + 1e-9
        if not 1.0 <= steps < _MOST_SAMPLES:
            raise DataError(
                f"{self.name}: {self.duration:g} s in steps of {dt:g} s gives "
                f"{'fewer than 2' if steps < 1.0 else 'more than 10 million'} samples; a resampled trace "
                f"has at least 2 and at most 10 million"
            )
        time = self.time[0] + dt * np.arange(int(steps) + 1)

        def at(values: Floats) -> Floats:
            columns = [np.interp(time, self.time, column) for column in np.atleast_2d(values.T)]
            return np.asarray(columns[0] if values.ndim == 1 else np.stack(columns, axis=1))

        return replace(
            self,
            time=time,
            specific_force=at(self.specific_force),
            angular_velocity=at(self.angular_velocity),
            angular_acceleration=at(self.angular_acceleration),
            channels={key: at(value) for key, value in self.channels.items()},
            road=None if self.road is None else self.road.resampled(self.time, time),
        )

    def to_csv(self, path: str | Path, decimals: int | None = None) -> None:
        """Write the trace as CSV: :data:`CSV_COLUMNS`, then the channels, one row a sample.

        Args:
            path: A name that ends in ``.gz`` is packed; the same trace always gives the same bytes.
            decimals: Digits after the point; nine significant digits if not given.
        """
        number = "{:.9g}" if decimals is None else f"{{:.{decimals}f}}"
        body = np.column_stack(
            [
                self.time,
                self.specific_force,
                self.angular_velocity,
                *(self.channels[k] for k in self.channels),
            ]
        )
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow([*CSV_COLUMNS, *self.channels])
        # Adding 0.0 after rounding turns -0.0 into 0.0.
        body = body if decimals is None else np.round(body, decimals) + 0.0
        writer.writerows([[number.format(value) for value in row] for row in body])
        if str(path).endswith(".gz"):
            write_bytes(path, gzip.compress(buffer.getvalue().encode(), mtime=0))
        else:
            write_text(path, buffer.getvalue())

    @classmethod
    def from_csv(cls, path: str | Path, name: str | None = None) -> CueTrace:
        """Read a trace written by :meth:`to_csv`, or any CSV with :data:`CSV_COLUMNS`.

        Raises:
            DataError: the file is empty, a column is missing, or a value is not a finite number or beyond
                what a car does (1000 m/s^2, 100 rad/s).
        """
        table = read_table(path)
        missing = [column for column in CSV_COLUMNS if column not in table]
        if missing:
            raise DataError(
                f"{path}: missing column {', '.join(missing)}; found {', '.join(table)}. "
                "`motion-cueing import` converts a log with other columns"
            )
        _check_table(path, table)
        name = name or Path(path).name.removesuffix(".gz").removesuffix(".csv")
        try:
            return cls(
                name=name,
                time=table[CSV_COLUMNS[0]],
                specific_force=np.stack([table[column] for column in CSV_COLUMNS[1:4]], axis=1),
                angular_velocity=np.stack([table[column] for column in CSV_COLUMNS[4:7]], axis=1),
                channels={key: value for key, value in table.items() if key not in CSV_COLUMNS},
                source=str(path),
            )
        except DataError as error:
            raise DataError(f"{path}: {str(error).removeprefix(f'{name}: ')}") from None


def read_table(path: str | Path, columns: list[str] | None = None) -> dict[str, Floats]:
    """Numeric columns of a CSV file (or ``.gz``) with a header row, by name; all, or those named.

    Empty cells become NaN.

    Raises:
        DataError: the file cannot be read, is empty, has ragged rows or a cell that is no number.
    """
    header, rows = _read_rows(path)
    names = header if columns is None else columns
    repeated = sorted({name for name in names if header.count(name) > 1})
    if repeated:
        raise DataError(f"{path}: column {', '.join(repeated)} occurs more than once")
    missing = [name for name in names if name not in header]
    if missing:
        raise DataError(f"{path}: missing column {', '.join(missing)}; found {', '.join(header)}")
    return {name: _numbers(path, name, header.index(name), rows) for name in names}


def _read_rows(path: str | Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header and rows of a CSV file, all of one length, each row with its line counted from 1."""
    try:
        reader = csv.reader(io.StringIO(read_table_text(path), newline=""))
        rows, cells = [], 0
        for row in filter(None, reader):
            rows.append((reader.line_num, row))
            cells += len(row)
            if len(row) > MOST_COLUMNS:
                raise DataError(
                    f"{path}: line {reader.line_num} has {len(row)} cells, at most {MOST_COLUMNS} are read"
                )
            if cells > MOST_CELLS:
                raise DataError(f"{path}: more than {MOST_CELLS} cells; split the file, or leave columns out")
    except (OSError, EOFError, zlib.error, csv.Error, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    if len(rows) < 2:
        raise DataError(f"{path}: empty; expected a header row and data rows")
    header = [cell.strip() for cell in rows[0][1]]
    separator = next((mark for mark in ";\t" if len(header) == 1 and mark in header[0]), None)
    if separator is not None:
        raise DataError(
            f"{path}: the separator is {separator!r}; save the file with commas between the columns, and "
            "points in the numbers"
        )
    if all(map(_is_number, header)):
        raise DataError(f"{path}: the first row must be the names of the columns, found numbers")
    for line, row in rows[1:]:
        if len(row) != len(header) == 1:
            raise DataError(
                f"{path}: the first line, {header[0]!r}, is no header of columns; remove the lines above the "
                "header, and save the file with commas between the columns"
            )
        if len(row) != len(header):
            raise DataError(f"{path}: line {line} has {len(row)} cells, the header has {len(header)}")
    return header, rows[1:]


def _numbers(path: str | Path, name: str, place: int, rows: list[tuple[int, list[str]]]) -> Floats:
    for line, row in rows:
        if row[place].strip() and not _is_number(row[place]):
            raise DataError(f"{path}: line {line}, column {name}: {row[place]!r} is no number")
    return np.array([float(row[place]) if row[place].strip() else np.nan for _, row in rows])


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _check_table(path: str | Path, table: Mapping[str, Floats]) -> None:
    """Refuse cells that are no finite number or no car's motion, by line and column."""
    for name, values in table.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            many = f" ({len(bad)} such cells)" if len(bad) > 1 else ""
            problem = f"not a finite number{many}; fill the gap, or cut it out"
            raise DataError(f"{path}: line {_line(path, bad[0])}, column {name}: {problem}")
    for name in CSV_COLUMNS[1:]:
        largest, unit = next(bound for end, bound in _LARGEST.items() if name.endswith(end))
        beyond = np.flatnonzero(np.abs(table[name]) > largest)
        if len(beyond):
            problem = (
                f"{table[name][beyond[0]]:g} is beyond {largest:g} {unit}, which no car does; check the unit"
            )
            raise DataError(f"{path}: line {_line(path, beyond[0])}, column {name}: {problem}")


def _line(path: str | Path, sample: int) -> int:
    """The line of a CSV file, counted from 1, in which a sample stands."""
    return _read_rows(path)[1][sample][0]


def _checked(trace: str, label: str, values: ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError(f"{trace}: {label} is not an array of numbers") from None
    if len(array.shape) != len(shape) or any(
        w not in (None, h) for w, h in zip(shape, array.shape, strict=True)
    ):
        expected = "(" + ", ".join("n" if w is None else str(w) for w in shape) + ")"
        raise DataError(f"{trace}: {label} has shape {array.shape}, expected {expected}")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=tuple(range(1, array.ndim))))
    if len(bad):
        raise DataError(f"{trace}: {label} is not finite at sample {bad[0]} ({len(bad)} samples in all)")
    array.setflags(write=False)
    return array


def _check_steps(trace: str, time: Floats) -> None:
    steps = np.diff(time)
    if np.any(steps <= 0.0):
        raise DataError(f"{trace}: time does not increase at sample {int(np.argmax(steps <= 0.0)) + 1}")
    mean = steps.mean()
    uneven = np.abs(steps - mean) > _TIME_TOLERANCE * mean
    if np.any(uneven):
        raise DataError(
            f"{trace}: time steps are uneven (sample {int(np.argmax(uneven)) + 1}: {steps[uneven][0]:.6g} s, "
            f"mean {mean:.6g} s); resample first, for example with `motion-cueing import`"
        )
