"""Reading files of others: limits of size, depth and number, so that none takes all time or memory.

Every reader of YAML, JSON, CSV, ``.npz`` and agents takes its limits from here. What a limit refuses is a
:class:`~.errors.DataError` of one sentence, as a broken file is.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from collections.abc import Hashable
from pathlib import Path
from tokenize import TokenError
from typing import Any, Final

import numpy as np
import yaml
from numpy.typing import NDArray

from .errors import DataError, reason

MIB: Final = 2**20

LARGEST_TEXT: Final = MIB
"""Bytes of a configuration: the largest shipped one has a hundredth of it."""

LARGEST_RESULTS: Final = 256 * MIB
"""Bytes of results, as JSON."""

LARGEST_TABLE: Final = 256 * MIB
"""Bytes of a CSV file, unpacked: some hours of a log at 100 Hz."""

MOST_COLUMNS: Final = 1000
"""Columns of a table."""

MOST_CELLS: Final = 20_000_000
"""Cells of a table."""

LARGEST_ARRAYS: Final = 1024 * MIB
"""Bytes of all arrays of a file, unpacked."""

MOST_ARRAYS: Final = 256
"""Arrays of a file."""

LARGEST_AGENT: Final = 256 * MIB
"""Bytes of an agent's file."""

MOST_LAYERS: Final = 100
"""Layers of a network."""

DEEPEST: Final = 50
"""Levels of lists and mappings within each other."""

MOST_NODES: Final = 20_000
"""Values of a YAML file, those of its aliases counted each time they stand for something."""

LONGEST_INTEGER: Final = 40
"""Characters of a whole number in YAML."""

_LONGEST_ARRAY_HEADER: Final = 10_000
"""Characters that describe one array; NumPy's own limit."""

_PIECE: Final = MIB
"""Bytes unpacked at once."""


def read_bytes(path: str | Path, largest: int) -> bytes:
    """The content of a file of at most so many bytes, also where the file does not end (``/dev/zero``).

    Raises:
        DataError: it is larger.
        OSError: it cannot be read.
    """
    with open(path, "rb") as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise _too_large(path, largest)
    return content


def _too_large(path: str | Path, largest: int, unpacked: str = "") -> DataError:
    return DataError(f"{path}: larger than {largest / MIB:g} MiB{unpacked}; give a smaller file")


def read_table_text(path: str | Path) -> str:
    """The text of a CSV file; one whose name ends in ``.gz`` is unpacked.

    Raises:
        DataError: it is larger than :data:`LARGEST_TABLE`.
        OSError, EOFError, zlib.error, UnicodeDecodeError: it cannot be read.
    """
    content = read_bytes(path, LARGEST_TABLE)
    if str(path).endswith(".gz"):
        content = _unpacked(path, content)
    return content.decode("utf-8-sig")


def _unpacked(path: str | Path, content: bytes) -> bytes:
    """The content of all members of a gzip file."""
    pieces, size = [], 0
    while content:
        unpacker = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
        while not unpacker.eof:
            piece = unpacker.decompress(content, _PIECE)
            content = unpacker.unconsumed_tail
            if not piece and not content and not unpacker.eof:
                raise EOFError("the packed data are cut off")
            pieces.append(piece)
            size += len(piece)
            if size > LARGEST_TABLE:
                raise _too_large(path, LARGEST_TABLE, " unpacked")
        content = unpacker.unused_data.lstrip(b"\0")
    return b"".join(pieces)


def parse_json(text: str | bytes) -> Any:
    """The values in a text of JSON.

    Raises:
        ValueError: it is none, is nested deeper than :data:`DEEPEST`, or has an integer too long for Python.
    """
    try:
        values = json.loads(text)
    except RecursionError:
        raise ValueError(_DEEP) from None
    level = [values]
    for _ in range(DEEPEST + 1):
        containers = [value for value in level if isinstance(value, (dict, list))]
        level = [
            inner
            for value in containers
            for inner in (value.values() if isinstance(value, dict) else value)
            if isinstance(inner, (dict, list))
        ]
        if not level:
            return values
    raise ValueError(_DEEP)


_DEEP: Final = f"lists and mappings within each other deeper than {DEEPEST} levels"


class _Loader(yaml.SafeLoader):
    """YAML without surprises: bounded, no key twice, and dates are the words that stand there."""

    yaml_implicit_resolvers = {  # noqa: RUF012
        first: [(tag, pattern) for tag, pattern in pairs if tag != "tag:yaml.org,2002:timestamp"]
        for first, pairs in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = 0
        self._nodes = 0
        self._sizes: dict[str, int] = {}

    def fetch_flow_collection_start(self, TokenClass: Any) -> None:
        # Before the scanner looks back over all brackets that are open.
        self._check(self.flow_level < DEEPEST, _DEEP)
        super().fetch_flow_collection_start(TokenClass)

    def compose_node(self, parent: Any, index: Any) -> Any:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        anchor, before = getattr(event, "anchor", None), self._nodes
        self._depth += 1
        self._check(self._depth <= DEEPEST + 1, _DEEP)
        alias = isinstance(event, yaml.AliasEvent)
        if alias and anchor in self.anchors:
            self._check(anchor in self._sizes, f"{anchor!r} holds itself")
        self._nodes += self._sizes.get(str(anchor), 1) if alias else 1
        self._check(self._nodes <= MOST_NODES, f"more than {MOST_NODES} values, those of aliases included")
        node = super().compose_node(parent, index)
        if anchor is not None and not alias:
            self._sizes[anchor] = self._nodes - before
        self._depth -= 1
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen:
                    problem = f"the key {key.value!r} stands there twice"
                    raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
                seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_yaml_int(self, node: Any) -> int:
        if len(node.value) > LONGEST_INTEGER:
            problem = f"a whole number of {len(node.value)} characters, at most {LONGEST_INTEGER} are read"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return int(super().construct_yaml_int(node))

    def _check(self, holds: bool, problem: str) -> None:
        if not holds:
            raise yaml.composer.ComposerError(None, None, problem, self.get_mark())


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)


def parse_yaml(text: str) -> object:
    """The values in a text of YAML.

    Raises:
        yaml.YAMLError: it is none, exceeds a limit, or has a key twice.
    """
    loader = _Loader(text)
    try:
        return loader.get_single_data()
    except (ValueError, OverflowError, RecursionError) as error:
        # A value that its own tag does not allow, such as !!int of a word.
        raise yaml.YAMLError(f"a value cannot be read ({error})") from None
    finally:
        loader.dispose()


def read_arrays(path: str | Path) -> dict[str, NDArray[Any]]:
    """The arrays of an ``.npz`` file by name, each checked before memory is taken for it.

    Raises:
        DataError: a limit is exceeded, or the file is encrypted, packed in another way or broken.
        OSError: it cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) > MOST_ARRAYS:
                raise DataError(f"{path}: {len(members)} arrays, at most {MOST_ARRAYS} are read")
            if sum(member.file_size for member in members) > LARGEST_ARRAYS:
                raise _too_large(path, LARGEST_ARRAYS, " unpacked")
            return {member.filename.removesuffix(".npy"): _array(path, archive, member) for member in members}
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({reason(error)})") from None
    except (EOFError, ValueError, OverflowError, RuntimeError, MemoryError) as error:
        raise DataError(f"{path}: broken or cut off ({reason(error)})") from None
    except (zipfile.BadZipFile, zlib.error, SyntaxError, TypeError, KeyError, TokenError):
        with open(path, "rb") as file:
            alone = file.read(6) == b"\x93NUMPY"
        raise DataError(f"{path}: {'one array, ' if alone else ''}no .npz file, or broken") from None


def _array(path: str | Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    if member.flag_bits & 1:
        raise DataError(f"{path}: {member.filename} is encrypted; give a file without a password")
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise DataError(f"{path}: {member.filename} is packed in a way that NumPy does not write")
    with archive.open(member) as file:
        # Not more than the file says it holds: the shape in its header takes memory.
        content = file.read(member.file_size)
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    header = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if header is None:
        raise DataError(
            f"{path}: {member.filename} has version {version} of NumPy's format, 1.0 and 2.0 are read"
        )
    shape, fortran, kind = header(stream, max_header_size=_LONGEST_ARRAY_HEADER)
    if kind.hasobject:
        raise DataError(f"{path}: {member.filename} holds Python objects; only numbers and text are read")
    count = 1
    for length in shape:
        count *= length
    if min(shape, default=0) < 0 or count * kind.itemsize != len(content) - stream.tell():
        raise DataError(
            f"{path}: {member.filename} has shape {shape}, for which its {len(content)} bytes do not do"
        )
    values = np.frombuffer(content, dtype=kind, count=count, offset=stream.tell())
    return values.reshape(shape, order="F" if fortran else "C").copy()


def check_size(path: str | Path, largest: int) -> None:
    """Refuse a file of more bytes, unread.

    Raises:
        DataError: it is larger.
        OSError: there is none.
    """
    if os.stat(path).st_size > largest:
        raise _too_large(path, largest)
