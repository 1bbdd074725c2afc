"""Set-points in the words of other motion controllers: CSV, JSON or OSC over UDP, in the units of the drives.

A template in YAML names the address, the format and the channels:

.. code-block:: yaml

    to: 127.0.0.1:9000
    format: csv
    rate: 100
    channels:
      - {source: leg_1, unit: percent}
      - {source: leg_2, unit: counts, counts: [0, 65535]}
      - {source: pitch, unit: deg, name: tilt, reverse: true}

OSC is Open Sound Control 1.0 (https://opensoundcontrol.stanford.edu/spec-1_0.html): an address padded with
zeros to a multiple of four bytes, the type tags likewise, then big-endian numbers of 32 bits. Counts are
integers, everything else is a float.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ..envs.errors import ConfigurationError
from ..envs.platform import Platform, actuator_limits
from ..envs.platform.machines import AXES
from ..envs.settings import Vector2, check_names, configuration, load
from .packets import MOTION, SetPoint

Floats = NDArray[np.float64]

LEG_NAMES: Final = tuple(f"leg_{k}" for k in range(1, 7))
SOURCES: Final = (*AXES, *LEG_NAMES)
"""What a channel can carry: the nine axes, and the extensions of the legs."""

_LINEAR: Final = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
_ANGULAR: Final = {"rad": 1.0, "deg": 180.0 / math.pi}
_SHARES: Final = ("percent", "counts")
_ANGLES: Final = ("roll", "pitch", "yaw", "turntable")

Unit = Literal["m", "cm", "mm", "rad", "deg", "percent", "counts"]


@configuration
class Channel:
    """One number of a line.

    Args:
        source: An axis, or leg_1 to leg_6.
        unit: m, cm or mm from neutral; rad or deg; percent of the stroke; counts of a drive, whole numbers.
        name: In JSON and the head of a CSV; default: the source.
        stroke: Where percent and counts begin and end, m or rad from neutral; default: the actuator's travel.
        counts: Counts at both ends of the stroke.
        reverse: Whether the drive counts the other way: percent and counts fall, other units change sign.
    """

    source: str
    unit: Unit
    name: str = ""
    stroke: Vector2 | None = None
    counts: tuple[int, int] = (0, 65535)
    reverse: bool = False

    def __post_init__(self) -> None:
        check_names("source", [self.source], SOURCES)
        units = _ANGULAR if self.source in _ANGLES else _LINEAR
        if self.unit not in (*units, *_SHARES):
            raise ValueError(f"{self.source} has no unit {self.unit}; use {', '.join((*units, *_SHARES))}")
        if self.stroke is not None and not self.stroke[0] < self.stroke[1]:
            raise ValueError(f"stroke must be from low to high, found {list(self.stroke)}")
        if self.counts[0] == self.counts[1]:
            raise ValueError(f"counts must differ, found {list(self.counts)}")

    @property
    def label(self) -> str:
        """Its name."""
        return self.name or self.source


@configuration
class OutputTemplate:
    """Where set-points go, and how they are written.

    Args:
        to: Host and port.
        format: csv, a line of numbers; json, an object; osc, Open Sound Control 1.0.
        channels: What is in a datagram, in this order.
        rate: Datagrams a second; a divisor of the rate of the set-points.
        address: Of OSC messages.
        decimals: Digits behind the point in csv and json.
        state: Whether the number of the controller's state comes first.
        separator: Between the numbers of a csv.
        end: Behind them.
    """

    to: str
    channels: Annotated[tuple[Channel, ...], Field(min_length=1)]
    format: Literal["csv", "json", "osc"] = "csv"
    rate: Annotated[int, Field(gt=0)] = 100
    address: str = "/motion"
    decimals: Annotated[int, Field(ge=0, le=12)] = 4
    state: bool = False
    separator: str = ","
    end: str = "\n"

    def __post_init__(self) -> None:
        labels = [channel.label for channel in self.channels]
        if len(set(labels)) < len(labels):
            raise ValueError(f"channels need names of their own, found {', '.join(labels)}")
        host, colon, port = self.to.rpartition(":")
        if not (host and colon and port.isascii() and port.isdigit() and 0 < int(port) < 65536):
            raise ValueError(f"to must be a host and a port, as in 127.0.0.1:9000, found {self.to!r}")
        if not (self.address.startswith("/") and self.address.isascii() and self.address.isprintable()):
            raise ValueError(f"an OSC address is ASCII and begins with '/', found {self.address!r}")


class Output:
    """Writes set-points as a template says.

    Args:
        template: Address, format and channels.
        platform: For the strokes of its actuators.
        rate: Set-points a second.

    Attributes:
        template: The same.
        every: Set-points from one datagram to the next.

    Raises:
        ConfigurationError: a channel needs a stroke that the machine has not, or the rates do not fit.
    """

    def __init__(self, template: OutputTemplate, platform: Platform, rate: int) -> None:
        if rate % template.rate:
            raise ConfigurationError(
                f"rate must be a divisor of the {rate} set-points a second, found {template.rate}"
            )
        self.template, self.every = template, rate // template.rate
        limits = actuator_limits(platform)
        # Actuators are carriage, legs and turntable; the pose of the hexapod has no travel of its own.
        actuators = (*AXES[:2], *LEG_NAMES, AXES[-1])
        travel = dict(
            zip(actuators, zip(limits["position_min"], limits["position_max"], strict=True), strict=True)
        )
        scales = [_scale(channel, travel.get(channel.source)) for channel in template.channels]
        self._factor, self._offset, self._low, self._high = map(np.array, zip(*scales, strict=True))
        self._columns = [_column(channel.source) for channel in template.channels]
        self._whole = [channel.unit == "counts" for channel in template.channels]
        self._labels = [
            *(["state"] if template.state else []),
            *(channel.label for channel in template.channels),
        ]
        writers: dict[str, Callable[[list[float]], bytes]] = {
            "csv": self._csv,
            "json": self._json,
            "osc": self._osc,
        }
        self._write = writers[template.format]

    def datagram(self, setpoint: SetPoint) -> bytes:
        """The datagram of a set-point."""
        values = np.clip(self._factor * setpoint.motion[self._columns] + self._offset, self._low, self._high)
        numbers = [
            round(value) if whole else value
            for value, whole in zip(values.tolist(), self._whole, strict=True)
        ]
        return self._write([*([int(setpoint.state)] if self.template.state else []), *numbers])

    def _texts(self, numbers: list[float]) -> list[str]:
        places = self.template.decimals
        # A negative zero would flicker.
        return [str(n) if isinstance(n, int) else f"{round(n, places) + 0.0:.{places}f}" for n in numbers]

    def _csv(self, numbers: list[float]) -> bytes:
        return (self.template.separator.join(self._texts(numbers)) + self.template.end).encode()

    def _json(self, numbers: list[float]) -> bytes:
        pairs = zip(self._labels, self._texts(numbers), strict=True)
        return ("{" + ", ".join(f"{json.dumps(label)}: {text}" for label, text in pairs) + "}").encode()

    def _osc(self, numbers: list[float]) -> bytes:
        tags = "," + "".join("i" if isinstance(n, int) else "f" for n in numbers)
        body = b"".join(struct.pack(">i" if isinstance(n, int) else ">f", n) for n in numbers)
        return _padded(self.template.address) + _padded(tags) + body


def load_output(path: Path, platform: Platform, rate: int) -> Output:
    """Read a template.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: something in it is wrong, or does not fit the machine.
    """
    template = load(OutputTemplate, path)
    try:
        return Output(template, platform, rate)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def _column(source: str) -> int:
    """Where a source stands in the motion of a set-point."""
    if source in LEG_NAMES:
        return MOTION["legs"].start + LEG_NAMES.index(source)
    return MOTION["position"].start + AXES.index(source)


def _scale(channel: Channel, travel: tuple[float, float] | None) -> tuple[float, float, float, float]:
    """Factor, offset and bounds of a channel's number, from m or rad from neutral."""
    if channel.unit not in _SHARES:
        factor = (_LINEAR | _ANGULAR)[channel.unit]
        return -factor if channel.reverse else factor, 0.0, -math.inf, math.inf
    low, high = channel.stroke or travel or (math.nan, math.nan)
    if not (math.isfinite(low) and math.isfinite(high)):
        raise ConfigurationError(
            f"{channel.source} in {channel.unit} needs a stroke, as in stroke: [-0.3, 0.3]; "
            "this machine has no travel of it"
        )
    first, last = (0.0, 100.0) if channel.unit == "percent" else map(float, channel.counts)
    if channel.reverse:
        first, last = last, first
    factor = (last - first) / (high - low)
    return factor, first - factor * low, min(first, last), max(first, last)


def _padded(text: str) -> bytes:
    """An OSC string: at least one zero behind it, to a multiple of four bytes."""
    data = text.encode("ascii")
    return data + bytes(4 - len(data) % 4)
