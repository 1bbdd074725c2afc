"""Protocols by name, open to other packages, and which of them datagrams are of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ..errors import DataError
from ..registry import Registry
from .sample import Source

SOURCES: Final[Registry[type[Source]]] = Registry("source", "motion_cueing.sources")
"""Register a protocol of your own with ``SOURCES.register("mine", MyProtocol, "my simulator")``."""

for _name, _kind, _summary in (
    ("beamng", "beamng:BeamNG", "BeamNG.drive, MotionSim"),
    ("outsim", "outsim:OutSim", "Live for Speed, OutSim"),
    ("forza", "forza:Forza", "Forza Motorsport and Horizon, Data Out"),
    ("f1", "f1:F1", "F1 23 and F1 24"),
    ("dirt", "dirt:Dirt", "DiRT Rally and DiRT Rally 2.0, extradata 3"),
    ("xplane", "xplane:XPlane", "X-Plane 11 and 12, RREF"),
    ("mcgc", "mcgc:Mcgc", "cue packets of this project"),
):
    SOURCES.register(_name, f"motion_cueing.envs.telemetry.{_kind}", _summary)


def source_names() -> list[str]:
    """All names."""
    return SOURCES.names()


def get_source(name: str) -> Source:
    """A protocol by name.

    Raises:
        UnknownNameError: there is none.
    """
    return SOURCES[name]()


_TRIED: Final = 200
"""Datagrams that decide."""


def recognize(datagrams: Sequence[bytes]) -> Source | None:
    """The protocol that reads most of the datagrams, if one reads at least half."""
    tried = datagrams[:_TRIED]
    counts = {name: sum(_reads(source, data) for data in tried) for name, source in _all().items()}
    best = max(counts, key=lambda name: counts[name])
    return get_source(best) if tried and 2 * counts[best] >= len(tried) else None


def _all() -> dict[str, Source]:
    return {name: get_source(name) for name in source_names()}


def _reads(source: Source, data: bytes) -> bool:
    try:
        source.parse(data)
    except DataError:
        return False
    return True
