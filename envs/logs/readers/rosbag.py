"""Bags of ROS 1 (.bag) and ROS 2 (a folder with metadata.yaml, or one .db3)."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from ...errors import DataError, reason
from ..signals import ImportOptions
from .messages import Topic
from .recording import Reader, Recording


def read_rosbag(path: Path, options: ImportOptions) -> Recording:
    """The recording in a bag: a table for each topic whose messages have numbers.

    Raises:
        DataError: the bag is damaged, or has no topic with numbers.
        ImportError: rosbags is not installed.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.interfaces import TopicInfo  # noqa: F401  (fails early where rosbags is too old)
    from rosbags.typesys import Stores, get_typestore

    topics: dict[str, Topic] = {}
    unknown: set[str] = set()
    folder = path.parent if path.suffix == ".db3" else path
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, received, data in reader.messages():
                if connection.msgtype in unknown:
                    continue
                try:
                    message = reader.deserialize(data, connection.msgtype)
                except KeyError:
                    unknown.add(connection.msgtype)
                    continue
                topics.setdefault(connection.topic, Topic(connection.topic, connection.msgtype)).add(
                    received, message
                )
    # Readers of bags raise errors of their own kinds, one a storage.
    except (AnyReaderError, ValueError, OSError, KeyError) as error:
        raise DataError(f"{path}: cannot be read as a bag ({reason(error)})") from None
    tables = tuple(table for topic in topics.values() if (table := topic.table()) is not None)
    if not tables:
        raise DataError(f"{path}: no topic with numbers")
    return Recording(f"ROS bag, {len(tables)} topics", tables)


def _recognizes(path: Path, head: bytes) -> bool:
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return head.startswith((b"#ROSBAG V2", b"SQLite format 3\0"))


ROSBAG: Final = Reader("ROS bag", _recognizes, read_rosbag, "logs")
