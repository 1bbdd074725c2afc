"""Where what takes long to make is kept from one run to the next. The folder may be deleted at any time."""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path:
    """``MOTION_CUEING_CACHE`` of the environment, else ``motion-cueing`` in the user's cache folder.

    That is ``XDG_CACHE_HOME``, or ``~/.cache`` without it.
    """
    chosen = os.environ.get("MOTION_CUEING_CACHE")
    if chosen:
        return Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "motion-cueing"
