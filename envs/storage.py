"""Files: written whole or not at all, and places for them checked before the work."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from .errors import DataError


@contextmanager
def replacing(path: str | Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside ``path`` that replaces it when the block ends without an error."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    text = "b" not in mode
    try:
        with os.fdopen(
            handle, mode, encoding="utf-8" if text else None, newline="" if text else None
        ) as file:
            yield file
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def copy_file(source: str | Path, target: str | Path) -> None:
    """Copy a file in one piece."""
    with Path(source).open("rb") as file, replacing(target, "wb") as copy:
        shutil.copyfileobj(file, copy)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file in one piece."""
    with replacing(path) as file:
        file.write(text)


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a binary file in one piece."""
    with replacing(path, "wb") as file:
        file.write(data)


def cache_folder() -> Path:
    """Folder for results that take long to compute; it may be deleted at any time.

    It is ``MOTION_CUEING_CACHE`` of the environment, else ``motion-cueing`` in ``XDG_CACHE_HOME`` or in
    ``~/.cache``.
    """
    chosen = os.environ.get("MOTION_CUEING_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "motion-cueing"


# What a user names: files, and where a command writes, checked before the work.


def is_file(name: str) -> bool:
    """Whether a word means a file rather than a registered name."""
    return bool(Path(name).suffix) or len(Path(name).parts) > 1 or Path(name).exists()


def check_folder(option: str, folder: Path) -> None:
    """Refuse a folder, named by an option such as ``--out``, that cannot be written.

    It need not exist, and is not made: a wrong argument later leaves nothing behind.

    Raises:
        DataError: it is a file or lies below one, or it takes no files.
    """
    _check(option, folder, folder)


def check_file(option: str, file: Path) -> None:
    """Refuse a file that cannot be written; neither it nor its folder need exist.

    Raises:
        DataError: it is a folder or lies below a file, or its folder takes no files.
    """
    if file.is_dir():
        raise DataError(f"{option} {file} is a folder; name a file")
    _check(option, file, file.absolute().parent)


def check_own_json(option: str, file: Path, keys: frozenset[str]) -> None:
    """Refuse to write over a file of JSON that is none of ours.

    Raises:
        DataError: it has not the ``keys`` that every version of ours has.
    """
    if not file.exists():
        return
    try:
        values = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        values = None
    if not isinstance(values, dict) or not keys <= values.keys():
        raise DataError(f"{file} was not written by this command; move it away, or name another {option}")


def _check(option: str, target: Path, folder: Path) -> None:
    """Try the nearest folder there is."""
    try:
        nearest = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        if not nearest.is_dir():
            named = "" if nearest == target else f"{target}: "
            raise DataError(f"{option} {named}{nearest} is a file; name a folder")
        probe(nearest)
    except OSError as error:
        reason = error.strerror or error
        raise DataError(f"{option} {target} cannot be written ({reason}); name another folder") from None


def probe(folder: Path) -> None:
    """Make a file in a folder, and remove it: permissions alone do not tell (read-only disks, root).

    Raises:
        OSError: the folder takes no files.
    """
    with tempfile.TemporaryFile(dir=folder):
        pass
