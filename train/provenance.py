"""What a training ran on and with."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

_DISTRIBUTIONS: Final = (
    "motion-cueing-gym", "numpy", "warp-lang", "gymnasium", "torch", "stable-baselines3", "sb3-contrib",
)  # fmt: skip


def versions() -> dict[str, str]:
    """This package, Python, the system, and the libraries that could change a bit."""
    system = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.machine()}",
    }
    return {name: _version(name) for name in _DISTRIBUTIONS} | system


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def hardware(device: str) -> str:
    """Processor and its cores, and the GPU where one is used."""
    found = f"{_processor()}, {os.cpu_count()} cores"
    if device != "cpu":
        import torch

        found += f", {torch.cuda.get_device_name(device)}"
    return found


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def command_line() -> str:
    """The command as it was typed."""
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
    """The time, ISO 8601, UTC."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
