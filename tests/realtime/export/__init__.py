"""Exports, compiled by the machine's compiler; without one these tests are skipped."""

from __future__ import annotations

from pathlib import Path

import pytest

from motion_cueing.realtime.export import Source, make_source, write_files
from motion_cueing.realtime.export.check import (
    WARNINGS,
    Compiled,
    CompilerError,
    compile_shared,
    compiler,
    run_compiler,
)


def _has_compiler() -> bool:
    try:
        compiler()
    except CompilerError:
        return False
    return True


needs_compiler = pytest.mark.skipif(not _has_compiler(), reason="no C compiler: install gcc or clang")


def compiled(folder: Path, policy, platform=None, **options) -> Compiled:
    """A policy's export as a library."""
    return compile_shared(make_source(policy, platform, **options), folder)


def warnings(source: Source, folder: Path) -> str:
    """What the compiler says of an export."""
    _, code = write_files(source, folder)
    return run_compiler([*WARNINGS, "-O2", "-c", "-o", str(folder / "out.o"), str(code)])
