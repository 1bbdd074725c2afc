"""Provenance: the command, commit, versions, time and hardware behind a result, a training or a recording."""

from __future__ import annotations

import json
import math
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

from pydantic import JsonValue

DISTRIBUTION: Final = "motion-cueing-gym"
"""Name of this package for installers."""
_LIBRARIES: Final = (
    "numpy", "scipy", "warp-lang", "gymnasium", "matplotlib", "pydantic",
    "torch", "stable-baselines3", "sb3-contrib",
)  # fmt: skip


def package_version() -> str:
    """Version of this package."""
    return _version(DISTRIBUTION)


def versions() -> dict[str, str]:
    """Versions of this package, of Python, of the system, and of the libraries that could change a number."""
    return {
        DISTRIBUTION: package_version(),
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    } | {name: _version(name) for name in _LIBRARIES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def hardware(device: str) -> str:
    """Processor and its cores, and the GPU where one is used."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = names[0] if names else platform.processor() or platform.machine()
    described = f"{processor}, {os.cpu_count()} cores"
    if device != "cpu":
        import torch

        described += f", {torch.cuda.get_device_name(device)}"
    return described


def command_line() -> str:
    """The command line of this process, as it was typed."""
    program = Path(sys.argv[0]).name
    return shlex.join(["motion-cueing" if program == "__main__.py" else program, *sys.argv[1:]])


def commit() -> str | None:
    """The git commit of the sources, "+" behind it where files differ; None outside of a repository."""
    if shutil.which("git") is None:
        return None
    head = _git("rev-parse", "HEAD")
    # An installed package may lie within somebody else's repository.
    if not head or not _git("ls-files", Path(__file__).name):
        return None
    changed = _git("status", "--porcelain", "--untracked-files=no")
    return head + ("+" if changed else "")


def _git(*words: str) -> str:
    folder = Path(__file__).parent
    done = subprocess.run(["git", *words], cwd=folder, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def now() -> str:
    """The current time: UTC, ISO 8601."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def plain(value: Any) -> JsonValue:
    """A configuration as JSON: infinity and NaN become null, and JSON inside a string is parsed."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        try:
            return plain(json.loads(value)) if value.startswith(("{", "[")) else value
        except json.JSONDecodeError:
            return value
    return value if value is None or isinstance(value, (bool, int)) else str(value)
