"""Files: written whole or not at all, and places for them checked, and claimed, before the work."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, Any, Final

from .errors import DataError

try:
    import fcntl
except ImportError:  # Windows: two processes in one folder are not distinguished there.
    fcntl = None  # type: ignore[assignment]

_LONGEST_NAME: Final = 255
"""Bytes of a file's name on the usual file systems."""

_LEFT_ALONE: Final = 60.0
"""Age from which a temporary file that nobody holds is taken for one of a killed process, s."""


@contextmanager
def replacing(path: str | Path, mode: str = "w") -> Iterator[IO[Any]]:
    """Open a temporary file beside ``path`` that replaces it when the block ends without an error."""
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    prefix = _temporary_prefix(target.name)
    _remove_abandoned(target.parent, prefix)
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=prefix)
    text = "b" not in mode
    try:
        with os.fdopen(
            handle, mode, encoding="utf-8" if text else None, newline="" if text else None
        ) as file:
            _lock(file.fileno())
            yield file
            file.flush()
            os.chmod(name, 0o644)
            os.replace(name, target)
    except BaseException as error:
        Path(name).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno is not None and error.filename in (None, name):
            # A full disk is reported without a name, or with the temporary one.
            raise OSError(error.errno, error.strerror, str(target)) from None
        raise


def _temporary_prefix(name: str) -> str:
    """How the temporary files of a file begin; a hash instead of a name too long for an ending."""
    if len(os.fsencode(name)) > _LONGEST_NAME - 10:
        name = hashlib.sha256(os.fsencode(name)).hexdigest()[:16]
    return f".{name}."


def _remove_abandoned(folder: Path, prefix: str) -> None:
    """Remove temporary files whose writer was killed: those that are old, and that no process holds."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            old = entry.name.startswith(prefix) and time.time() - entry.stat().st_mtime > _LEFT_ALONE
            if not old or len(entry.name) != len(prefix) + 8:
                continue
            with suppress(OSError), open(entry.path, "rb") as file:
                if _lock(file.fileno()):
                    os.unlink(entry.path)


def _lock(handle: int) -> bool:
    """Lock an open file until it is closed or the process ends; False where another process holds it."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        # A file system without locks.
        return True
    return True


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
    ``~/.cache``. Where that cannot be written, it is a temporary one, and standard error says so once.
    """
    chosen = os.environ.get("MOTION_CUEING_CACHE")
    if chosen:
        return writable_cache(Path(chosen), "MOTION_CUEING_CACHE")
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        folder = (Path(base) if base else Path.home() / ".cache") / "motion-cueing"
    except RuntimeError:
        # There is no home.
        folder = private_folder() / "cache"
    return writable_cache(folder, "MOTION_CUEING_CACHE")


@lru_cache(maxsize=64)
def writable_cache(folder: Path, variable: str) -> Path:
    """A folder for a cache, or a temporary one where it cannot be written, which is said once.

    Args:
        folder: That need not exist.
        variable: Of the environment, with which a user chooses another.
    """
    nearest = next(place for place in (folder, *folder.absolute().parents) if os.path.lexists(place))
    if nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK):
        return folder
    other = private_folder() / variable.lower()
    print(
        f"motion-cueing: the cache {folder} cannot be written; {other} is used instead (set {variable} to "
        "choose a folder)",
        file=sys.stderr,
        flush=True,
    )
    return other


@lru_cache(maxsize=1)
def private_folder() -> Path:
    """A folder for temporary files that the user alone can write, the same for all processes."""
    folder = Path(tempfile.gettempdir()) / f"motion-cueing-{_user()}"
    with suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    # Somebody else may have made it first.
    return folder if is_private(folder) else Path(tempfile.mkdtemp(prefix="motion-cueing-"))


def is_private(path: Path) -> bool:
    """Whether a file or folder is the user's, no link, and nobody else can write it."""
    if not hasattr(os, "geteuid"):
        return True
    try:
        found = path.lstat()
    except OSError:
        return False
    return found.st_uid == os.geteuid() and not found.st_mode & 0o022 and not stat.S_ISLNK(found.st_mode)


def _user() -> str:
    return str(os.geteuid()) if hasattr(os, "geteuid") else os.environ.get("USERNAME", "user")


# What a user names: files, and where a command writes, checked before the work.


def is_file(name: str) -> bool:
    """Whether a word means a file rather than a registered name."""
    return bool(Path(name).suffix) or len(Path(name).parts) > 1 or Path(name).exists()


def check_folder(option: str, folder: Path) -> None:
    """Refuse a folder, named by an option such as ``--out``, that cannot be written.

    It need not exist, and is not made: a wrong argument later leaves nothing behind.

    The folder is this process' own until :func:`release_folders` or its end, however it ends.

    Raises:
        DataError: it is a file or lies below one, or it takes no files; or another process of this machine
            writes there.
    """
    _check(option, folder, folder)
    _claim(option, folder)


_CLAIMED: Final[dict[Path, IO[str]]] = {}
"""Open files that hold the locks of this process, by folder."""


def _claim(option: str, folder: Path) -> None:
    place = folder.resolve()
    if place in _CLAIMED:
        return
    locks = private_folder() / "locks"
    locks.mkdir(mode=0o700, exist_ok=True)
    file = (locks / hashlib.sha256(os.fsencode(place)).hexdigest()).open("a+", encoding="utf-8")
    if not _lock(file.fileno()):
        file.seek(0)
        owner = file.read(1000).strip() or "another process"
        file.close()
        raise DataError(f"{option} {folder} is in use by {owner}; wait for its end, or name another folder")
    file.truncate(0)
    program = " ".join(shlex.quote(word) for word in [Path(sys.argv[0]).name, *sys.argv[1:]])
    file.write(f"process {os.getpid()} ({program.encode('ascii', 'replace').decode()[:300]})")
    file.flush()
    _CLAIMED[place] = file


def release_folders() -> None:
    """Let other processes write to the folders that this one claimed."""
    while _CLAIMED:
        _CLAIMED.popitem()[1].close()


def check_name(label: str, path: Path) -> None:
    """Refuse a path that no file can have, or whose name is not UTF-8.

    Raises:
        DataError: a part of it is too long, or is not UTF-8.
    """
    for part in path.parts:
        try:
            length = len(part.encode("utf-8"))
        except UnicodeEncodeError:
            raise DataError(f"{label} {str(path)!a}: the name is not UTF-8; choose another") from None
        if "\0" in part:
            raise DataError(f"{label} {str(path)!a}: a name cannot hold a zero byte; choose another")
        if length > _LONGEST_NAME:
            raise DataError(
                f"{label}: {part[:30]}... is a name of {length} bytes, at most {_LONGEST_NAME} are allowed"
            )


def check_file(option: str, file: Path) -> None:
    """Refuse a file that cannot be written; neither it nor its folder need exist.

    Raises:
        DataError: it is a folder or lies below a file, or its folder takes no files.
    """
    check_name(option, file)
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
    check_name(option, target)
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
