"""Recorded drives that come with the package.

Each lies in a folder of its own under ``recorded``, with the notice of its license and the
command that converted it from the published log.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from ..cues import CueTrace
from ..errors import look_up

_FOLDER: Final = Path(__file__).parent / "recorded"
_FILE: Final = "cues.csv.gz"

_SOURCES: Final[Mapping[str, str]] = {
    "city-drive": "214 s through a city, turns and a rough stretch; log by Paul Balzer, CC BY-SA 2.0",
    "commute": "60 s of a commute, speeding up and slowing down; comma2k19 by comma.ai, MIT",
}


def recording_names() -> list[str]:
    """Names of the recorded drives."""
    return sorted(_SOURCES)


def describe_recording(name: str) -> str:
    """One line about a recorded drive, with its source."""
    return look_up("recording", name, _SOURCES)


def get_recording(name: str) -> CueTrace:
    """A recorded drive: 100 Hz, F_A axes, with the channel ``speed_m_s``.

    Raises:
        UnknownNameError: no recording has this name.
    """
    source = describe_recording(name)
    return replace(CueTrace.from_csv(_FOLDER / name / _FILE, name=name), source=source)
