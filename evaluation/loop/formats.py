"""How packets are written, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from ...envs.errors import look_up
from .message_pack import MessagePackFormat
from .packets import FloatsFormat, Format

_FORMATS: Final[Mapping[str, Callable[[], Format]]] = {
    FloatsFormat.name: FloatsFormat,
    MessagePackFormat.name: MessagePackFormat,
}


def make_format(name: str) -> Format:
    """A format by name: floats or msgpack.

    Raises:
        UnknownNameError: there is none of this name.
        ConfigurationError: its library is missing.
    """
    return look_up("format", name, _FORMATS)()
