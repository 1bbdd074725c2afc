"""The formats that an import reads, and how one is recognized."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...errors import DataError, reason
from ..signals import ImportOptions
from .delimited import DELIMITED
from .mcap import MCAP
from .mdf import MDF
from .phone import PHONE
from .recording import Reader, Recording
from .rosbag import ROSBAG
from .telemetry import DATAGRAMS, NETWORK
from .vbo import VBO

FORMATS: Final[tuple[Reader, ...]] = (MDF, MCAP, ROSBAG, DATAGRAMS, NETWORK, PHONE, VBO, DELIMITED)
"""Readers in the order in which they are tried; text tables are what is left."""

_HEAD: Final = 4096
"""Bytes at the beginning of a file that show its format."""


def read_recording(path: str | Path, options: ImportOptions | None = None) -> Recording:
    """Read a log of any known format.

    Raises:
        DataError: the file cannot be read, is damaged, or its format needs a package that is not installed.
    """
    path = Path(path)
    head = b""
    if not path.is_dir():
        try:
            with path.open("rb") as file:
                head = file.read(_HEAD)
        except OSError as error:
            raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    reader = next((one for one in FORMATS if one.recognizes(path, head)), DELIMITED)
    try:
        return reader.read(path, options or ImportOptions())
    except ImportError as error:
        if reader.extra is None:
            raise
        raise DataError(
            f"{path}: {reader.name} needs the package {error.name}, which is not installed; run "
            f'pip install "motion-cueing-gym[{reader.extra}]"'
        ) from None
