"""MCAP: messages of ROS 2 (CDR), ROS 1 or JSON in one file."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from ...errors import DataError, reason
from ..signals import Change, ImportOptions
from .messages import Topic
from .recording import Reader, Recording

_MAGIC: Final = b"\x89MCAP0\r\n"


def read_mcap(path: Path, options: ImportOptions) -> Recording:
    """The recording in an MCAP file: a table for each topic whose messages have numbers.

    Raises:
        DataError: the file is damaged, and the options refuse that; or no topic can be read.
        ImportError: mcap, or rosbags for messages of ROS, is not installed.
    """
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader

    topics: dict[str, Topic] = {}
    decoders: dict[int, Callable[[bytes], object]] = {}
    skipped: set[str] = set()
    changes: tuple[Change, ...] = ()
    with path.open("rb") as file:
        try:
            for schema, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
                name = schema.name if schema is not None else ""
                if channel.id not in decoders:
                    found = _decoder(channel.message_encoding, schema)
                    if found is None:
                        skipped.add(f"{channel.topic} ({channel.message_encoding})")
                        continue
                    decoders[channel.id] = found
                topic = topics.setdefault(channel.topic, Topic(channel.topic, name))
                topic.add(message.log_time, decoders[channel.id](message.data))
        # The reader raises errors of struct, too, where a file is cut off.
        except (McapError, EOFError, ValueError, OSError, KeyError, IndexError) as error:
            fault = f"cannot be read to its end ({reason(error) or type(error).__name__})"
            if options.damage == "refuse" or not topics:
                raise DataError(f"{path}: {fault}; set damage='mend' to take what is whole") from None
            changes = (Change(f"{fault}: left out"),)
    tables = tuple(table for topic in topics.values() if (table := topic.table()) is not None)
    if not tables:
        raise DataError(
            f"{path}: no topic with numbers{': not read ' + ', '.join(sorted(skipped)) if skipped else ''}"
        )
    return Recording(f"MCAP, {len(tables)} topics", tables, changes)


def _decoder(encoding: str, schema: Any) -> Callable[[bytes], object] | None:
    """A function from the bytes of a message to its fields; None where the encoding is unknown."""
    if encoding == "json":
        return json.loads
    if schema is None or encoding not in ("cdr", "ros1"):
        return None
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    text, name = schema.data.decode(), schema.name
    if schema.encoding == "ros2idl":
        store.register(get_types_from_idl(text))
    elif schema.encoding in ("ros2msg", "ros1msg"):
        name = name if "/msg/" in name else name.replace("/", "/msg/")
        store.register(get_types_from_msg(text, name))
    else:
        return None
    if encoding == "ros1":
        return lambda data: store.deserialize_ros1(data, name)
    return lambda data: store.deserialize_cdr(data, name)


MCAP: Final = Reader("MCAP", lambda path, head: head.startswith(_MAGIC), read_mcap, "logs")
