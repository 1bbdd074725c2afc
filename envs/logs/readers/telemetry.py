"""Datagrams of simulators and games: recordings of ``bridge --record``, and captures of a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from ...cues import Floats
from ...errors import DataError, UnknownNameError
from ...telemetry import CueEstimator, Datagram, Sample, Source, get_source, recognize
from ...telemetry.stream import CAPTURE_MAGICS, MAGIC, read_capture, read_stream
from ..signals import Change, ImportOptions
from ..units import FORCES, RATES
from .recording import Column, Reader, Recording, Table

_UNITS: Final = {
    "time": "s", **dict.fromkeys(FORCES, "m/s2"), **dict.fromkeys(RATES, "rad/s"),
    "speed": "m/s", "course": "rad",
}  # fmt: skip


def read_datagrams(path: Path, options: ImportOptions) -> Recording:
    """The recording in a file of ``bridge --record``.

    Raises:
        DataError: it is cut off and the options refuse that, or its protocol is unknown.
    """
    name, datagrams, fault = read_stream(path)
    changes = _damage(path, fault, options)
    try:
        source = get_source(name)
    except UnknownNameError as error:
        raise DataError(f"{path}: {error}") from None
    return _recording(path, source, datagrams, changes)


def read_network(path: Path, options: ImportOptions) -> Recording:
    """The recording in a capture of a network: the first flow whose protocol is known.

    Raises:
        DataError: no flow's protocol is known, or the capture is damaged and the options refuse that.
        ImportError: dpkt is missing.
    """
    flows, fault = read_capture(path)
    changes = _damage(path, fault, options)
    for datagrams in sorted(flows.values(), key=len, reverse=True):
        source = recognize([datagram.data for datagram in datagrams])
        if source is not None:
            return _recording(path, source, datagrams, changes)
    found = ", ".join(f"{len(datagrams)} to port {port}" for port, datagrams in flows.items())
    raise DataError(f"{path}: no telemetry that is known among its datagrams ({found or 'none'})")


def _damage(path: Path, fault: str, options: ImportOptions) -> list[Change]:
    if fault and options.damage == "refuse":
        raise DataError(f"{path}: {fault}; set damage='mend' to take what is whole")
    return [Change(f"{fault}: left out")] if fault else []


def _recording(path: Path, source: Source, datagrams: Sequence[Datagram], changes: list[Change]) -> Recording:
    samples = []
    counts = dict.fromkeys(("of another kind", "that repeat the one before", "of a pause", "broken"), 0)
    last = b""
    for datagram in datagrams:
        try:
            sample = source.parse(datagram.data)
        except DataError:
            counts["of another kind"] += 1
            continue
        if sample is None:
            continue
        if sample.paused:
            counts["of a pause"] += sample.moves or not np.isnan(sample.time)
            continue
        if not sample.moves:
            continue
        if sample.broken:
            counts["broken"] += 1
        elif datagram.data == last:
            counts["that repeat the one before"] += 1
        else:
            samples.append((datagram.time, sample))
        last = datagram.data
    table = _table(samples)
    if len(table) < 2:
        raise DataError(f"{path}: fewer than 2 samples of motion among {len(datagrams)} datagrams")
    said = [Change(f"{count} datagrams {what}: left out") for what, count in counts.items() if count]
    columns = [
        Column(name, values, _UNITS[name])
        for name, values in zip(_UNITS, table.T, strict=True)
        if np.isfinite(values).any()
    ]
    return Recording(
        f"telemetry, {source.summary}", (Table("", tuple(columns), "time"),), (*changes, *said), True
    )


def _table(samples: Sequence[tuple[float, Sample]]) -> Floats:
    """(n, 9) time, cues, speed and course; the time is that of the arrival where senders have no clock."""
    estimator, rows = CueEstimator(), []
    before = -np.inf
    for arrival, sample in samples:
        time = arrival if np.isnan(sample.time) else sample.time
        if time <= before:
            # What runs backwards is judged by the import; a rate across it would mean nothing.
            estimator.reset()
        before = time
        cues = estimator(replace(sample, time=time))
        if cues is not None:
            north, east = sample.velocity[:2]
            rows.append([time, *cues, np.hypot(north, east), np.arctan2(east, north)])
    return np.array(rows).reshape(-1, len(_UNITS))


DATAGRAMS: Final = Reader("recorded datagrams", lambda path, head: head.startswith(MAGIC), read_datagrams)
NETWORK: Final = Reader(
    "capture of a network", lambda path, head: head[:4] in CAPTURE_MAGICS, read_network, extra="logs"
)
