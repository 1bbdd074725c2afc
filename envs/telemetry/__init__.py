"""Telemetry of simulators and games: datagrams become cues; one module a protocol."""

from .layout import Field, Layout
from .motion import CueEstimator, MotionCheck
from .sample import Sample, Source
from .sources import SOURCES, get_source, recognize, source_names
from .stream import Datagram, StreamWriter, read_stream

__all__ = [
    "SOURCES",
    "CueEstimator",
    "Datagram",
    "Field",
    "Layout",
    "MotionCheck",
    "Sample",
    "Source",
    "StreamWriter",
    "get_source",
    "read_stream",
    "recognize",
    "source_names",
]
