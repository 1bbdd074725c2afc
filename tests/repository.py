"""Where the project's own files lie."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("baselines", "cli", "envs", "evaluation", "realtime", "train")


def package_files() -> list[Path]:
    """Every file of the packages, relative to the root."""
    found = (path for package in PACKAGES for path in (ROOT / package).rglob("*"))
    return sorted(
        path.relative_to(ROOT)
        for path in found
        if path.is_file()
        and "__pycache__" not in path.parts
        and not any(p.startswith(".") for p in path.parts[-2:])
    )
