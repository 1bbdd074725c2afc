"""Drives packed for the report: what a plot shows of them, in a small part of the bytes.

Values are rounded to a thousandth of the least range that a plot keeps in view, which is a tenth of a pixel.
Second differences of the whole numbers are written as planes of bytes, low bytes first, and deflated. A page
takes them apart with the browser's own DecompressionStream. A sample of a drive takes about 5 bytes.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..metrics import Criteria, cab_motion, cue_error
from ..trajectory import Floats
from .signals import PANELS, Drives, Panel, worst_second

MOST_SAMPLES: Final = 30_000
"""Samples of a drive that are packed; of a longer one, lowest and highest value of equal stretches."""
MISSING: Final = -(2**20)
"""The whole number in place of a value that is not a number; any other is larger."""
_LARGEST: Final = 2**28
"""Magnitude of a whole number whose second difference has 32 bits."""
_RESOLUTION: Final = 1e-3
"""Of a panel, as a share of the least range in view."""
_LOGARITHM: Final = 0.02
"""Resolution of a logarithm to base 2: 1.4 %."""
_TIME: Final = 1e-5
"""Resolution of time, s."""


@dataclass(frozen=True)
class PackedDrive:
    """The drives of one maneuver, packed.

    Args:
        about: What a page must know of them, as JSON.
        data: The packed arrays, in the order of ``about["arrays"]``.
    """

    about: dict[str, Any]
    data: bytes

    @property
    def content(self) -> dict[str, Any]:
        """Everything as JSON."""
        return {**self.about, "data": base64.b64encode(self.data).decode("ascii")}


class Packer:
    """Gathers arrays; the same array is packed once.

    Attributes:
        arrays: About each array, as a page must know it.
    """

    def __init__(self) -> None:
        self.arrays: list[dict[str, Any]] = []
        self.planes: list[bytes] = []
        self._known: dict[bytes, int] = {}

    def add(self, values: Floats, resolution: float, logarithmic: bool = False) -> int:
        """Number of the array in the file."""
        known = np.isfinite(values)
        with np.errstate(invalid="ignore", divide="ignore"):
            values = np.log2(values) if logarithmic else values
        largest = float(np.abs(values[known]).max()) if known.any() else 0.0
        # A value beyond all bounds gets a coarser rounding; others never do.
        resolution = max(resolution, largest / (-MISSING - 1))
        whole = np.full(len(values), MISSING, dtype=np.int64)
        whole[known] = np.rint(values[known] / resolution)
        flags = {"log": logarithmic, "missing": not known.all()}
        return self._append(
            whole, {"step": resolution} | {name: True for name, is_so in flags.items() if is_so}
        )

    def add_time(self, time: Floats) -> int:
        """Number of an array of times."""
        resolution = max(_TIME, float(np.abs(time).max()) / _LARGEST)
        return self._append(np.rint(time / resolution).astype(np.int64), {"step": resolution})

    def _append(self, whole: NDArray[np.int64], about: dict[str, Any]) -> int:
        differences = np.diff(whole, n=2, prepend=[0, 0])
        folded = ((differences << 1) ^ (differences >> 63)).astype("<u4")
        count = 1 + (int(folded.max()).bit_length() - 1) // 8 if folded.any() else 1
        planes = folded.view(np.uint8).reshape(-1, 4)[:, :count].T.tobytes()
        key = repr(about).encode() + planes
        if key not in self._known:
            self._known[key] = len(self.arrays)
            self.arrays.append({"n": len(whole), "planes": count, **about})
            self.planes.append(planes)
        return self._known[key]

    def compressed(self) -> bytes:
        """All arrays, deflated."""
        return zlib.compress(b"".join(self.planes), 6)


def pack(drives: Drives, criteria: Criteria | None = None) -> PackedDrive:
    """Pack what plots show of the drives of one maneuver.

    Args:
        drives: Trajectory of each policy (at least one), all of the same cues.
        criteria: Thresholds to show.
    """
    criteria = criteria or Criteria()
    packer = Packer()
    policies: dict[str, Any] = {}
    for name, drive in drives.items():
        worst = worst_second(drive, criteria)
        policies[name] = {
            "error": float(np.mean(cue_error(*cab_motion(drive), criteria))),
            "worst": [worst.begin, worst.end, worst.error, worst.axis],
            "time": packer.add_time(_thinned_time(drive.time)),
            "panels": {
                panel.name: _add(packer, panel, values)
                for panel in PANELS
                if np.isfinite(values := panel.signal(drive, criteria)).any()
            },
        }
    first = next(iter(drives.values()))
    about = {
        "name": first.maneuver,
        "duration": [float(first.time[0]), float(first.time[-1])],
        "stride": _stride(len(first)),
        "car": {
            "time": packer.add_time(_thinned_time(first.time)),
            "panels": {
                panel.name: _add(packer, panel, panel.car(first, criteria))
                for panel in PANELS
                if panel.car is not None
            },
        },
        "policies": policies,
        "limits": {
            panel.name: [limit if np.isfinite(limit) else None for limit in panel.limits(first, criteria)]
            for panel in PANELS
            if panel.limits is not None
        },
        "arrays": packer.arrays,
    }
    return PackedDrive(about, packer.compressed())


def _add(packer: Packer, panel: Panel, values: Floats) -> list[int]:
    """Numbers of the arrays of a panel: one, or two of a band."""
    resolution = _LOGARITHM if panel.logarithmic else 1.0 if panel.levels else _RESOLUTION * panel.least
    columns: Sequence[Floats] = [values] if values.ndim == 1 else list(values.T)
    return [packer.add(thinned(one), resolution, panel.logarithmic) for one in columns]


def _stride(n: int) -> int:
    """Samples that two packed values stand for; 1 where every sample is packed."""
    return 1 if n <= MOST_SAMPLES else -(-2 * n // MOST_SAMPLES)


def thinned(values: Floats) -> Floats:
    """At most :data:`MOST_SAMPLES` values: of a longer array, the extremes of equal stretches, in order.

    Every extreme of the array is in the result, so a plot that is as wide as a screen looks the same.
    """
    stride = _stride(len(values))
    if stride == 1:
        return values
    # The last stretch is filled up with its last value.
    filled = np.concatenate([values, np.full(-len(values) % stride, values[-1])]).reshape(-1, stride)
    unknown = np.isnan(filled)
    lowest = np.where(unknown, np.inf, filled).argmin(axis=1)
    highest = np.where(unknown, -np.inf, filled).argmax(axis=1)
    rows = np.arange(len(filled))[:, None]
    return np.asarray(filled[rows, np.sort(np.column_stack([lowest, highest]), axis=1)].ravel())


def _thinned_time(time: Floats) -> Floats:
    """Two times of each stretch of :func:`thinned`."""
    stride = _stride(len(time))
    if stride == 1:
        return time
    starts = np.arange(0, len(time), stride)
    middles = np.minimum(starts + stride // 2, len(time) - 1)
    both = np.column_stack([time[starts], time[middles]]).ravel()
    # A last stretch of one sample has its time twice.
    both[-1] = max(both[-1], both[-2] + _TIME)
    return both
