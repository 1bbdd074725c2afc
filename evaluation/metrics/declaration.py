"""The declaration of a metric: what it is, its unit, how tables show it, and how drives are combined."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, TypeVar

from ..reporting.text import degrees, microseconds, number, percent, seconds

T = TypeVar("T")


def mean(values: Sequence[float]) -> float:
    """Plain mean."""
    return sum(values) / len(values)


def undefined(values: Sequence[float]) -> None:
    """No value: several drives have none in common."""


Table = Literal["drive", "benchmark", "study", "feel"]
"""The tables of one maneuver, of the benchmark, of a condition of a study, and of what people feel."""
EVERY_TABLE: Final[tuple[Table, ...]] = ("drive", "benchmark", "study")
"""The tables that are always shown."""


@dataclasses.dataclass(frozen=True)
class Display:
    """How a table shows a value.

    Args:
        unit: Behind the header.
        text: Value in SI units to text.
    """

    unit: str
    text: Callable[[float | None], str]


PLAIN: Final = Display("", number)
PERCENT: Final = Display("%", percent)
DEGREES_PER_SECOND: Final = Display("deg/s", degrees)
MICROSECONDS: Final = Display("µs", microseconds)
ACCELERATION: Final = Display("m/s²", number)
SECONDS: Final = Display("s", seconds)
TIME: Final = Display("s", number)
JERK: Final = Display("m/s³", number)
OF_AXIS: Final = Display("", number)
"""In m/s^2 on an axis of force, in deg/s on one of rotation."""


@dataclasses.dataclass(frozen=True)
class Metric:
    """The declaration of a metric.

    Args:
        measure: Gives the value from the signals of a drive, an axis or an actuator.
        definition: One to four sentences, for the page of metrics.
        unit: SI, of the value in files.
        header: In tables, without unit. A metric without header is in files only.
        display: How tables show the value.
        over_drives: Makes one value of those of several drives.
        better: The better direction, where there is one. "one": a ratio to the car's, best at 1.
        source: Literature.
        tables: The tables in which it is a column.
        costly: Whether it takes longer than all others and is measured on request only.
        name: Of the field.
    """

    measure: Callable[[Any], Any]
    definition: str
    unit: str = "1"
    header: str = ""
    display: Display = PLAIN
    over_drives: Callable[[Sequence[float]], float | None] = mean
    better: Literal["lower", "higher", "one", ""] = "lower"
    source: str = ""
    tables: tuple[Table, ...] = ()
    costly: bool = False
    name: str = ""

    @property
    def title(self) -> str:
        """Header with its unit."""
        return f"{self.header} {self.display.unit}".strip()


def metric(
    measure: Callable[[Any], Any],
    definition: str,
    *more: Any,
    default: Any = dataclasses.MISSING,
    **named: Any,
) -> Any:
    """Declare a metric, as the field of a configuration.

    Args:
        measure: The first argument of :class:`Metric`.
        definition: The second.
        more: The others, by place.
        default: Value in files that were written before the metric was declared.
        named: The others, by name.
    """
    one = Metric(measure, definition, *more, **named)
    return dataclasses.field(default=default, kw_only=True, metadata={"metric": one})


def declared(cls: type[Any]) -> list[Metric]:
    """The metrics that a class declares, in order."""
    return [
        dataclasses.replace(field.metadata["metric"], name=field.name)
        for field in dataclasses.fields(cls)
        if "metric" in field.metadata
    ]


def documented(cls: type[T]) -> type[T]:
    """Put the definition of each metric into the docstring of the class that declares it; a decorator."""
    arguments = [f"    {one.name}: {one.definition}" for one in declared(cls)]
    cls.__doc__ = "\n".join([f"{cls.__doc__}\n\nArgs:", *arguments])
    return cls


def measured(cls: type[T], signals: Any, costly: bool = False) -> T:
    """The metrics that a class declares, of some signals; costly ones are None unless requested."""
    return cls(
        **{one.name: one.measure(signals) if costly or not one.costly else None for one in declared(cls)}
    )
