"""CasADi functions as machine code, where a C compiler is at hand; kept for the next time.

A library lies in the cache folder under a hash of its C source and of the compiler's command, so
nothing stale is ever loaded. Without a compiler the function stays what it is: slower, and the same.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Final

from ...envs.storage import write_bytes, write_text
from ..cache import cache_folder
from ..symbolic.library import cs

_FLAGS: Final = ("-O2", "-ffp-contract=off", "-fPIC", "-shared")
"""No flag that would change arithmetic: results are those of the function not compiled, to the bit.

Compilers contract a * b + c to one rounding where the processor can, unless told not to.
"""

_COMPILERS: Final = ("cc", "gcc", "clang")

_PATIENCE: Final = 300.0
"""Longest time a compiler may take, s."""


def find_compiler() -> str | None:
    """A C compiler: ``CC`` of the environment, else one on the path; None without one."""
    names = [os.environ["CC"]] if os.environ.get("CC") else list(_COMPILERS)
    return next((path for name in names if (path := shutil.which(name))), None)


def compiled(function: Any) -> Any:
    """The function as machine code, or as it is where that cannot be had.

    Args:
        function: A CasADi function.
    """
    compiler = find_compiler()
    if compiler is None:
        return function
    generator = cs.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    source = generator.dump()
    key = hashlib.sha256("\n".join((*_FLAGS, compiler, platform.platform(), source)).encode()).hexdigest()
    library = cache_folder() / f"{function.name()}-{key}.so"
    try:
        if not _is_whole(library):
            code = _compile(compiler, source)
            write_bytes(library, code)
            write_text(_seal(library), hashlib.sha256(code).hexdigest())
        return cs.external(function.name(), str(library))
    except (OSError, RuntimeError, subprocess.SubprocessError):
        return function


def _seal(library: Path) -> Path:
    """The file with the library's own hash."""
    return library.with_suffix(".sha256")


def _is_whole(library: Path) -> bool:
    """Whether a library is there and undamaged: loading a torn one would end the process."""
    if not (library.exists() and _seal(library).exists()):
        return False
    return hashlib.sha256(library.read_bytes()).hexdigest() == _seal(library).read_text(encoding="utf-8")


def _compile(compiler: str, source: str) -> bytes:
    """The shared library of a C source."""
    with tempfile.TemporaryDirectory() as folder:
        code, library = Path(folder) / "function.c", Path(folder) / "function.so"
        code.write_text(source, encoding="utf-8")
        command = [compiler, *_FLAGS, "-o", str(library), str(code), "-lm"]
        subprocess.run(command, check=True, capture_output=True, timeout=_PATIENCE)
        return library.read_bytes()
