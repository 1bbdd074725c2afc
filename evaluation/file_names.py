"""Labels as parts of file names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import chain, count


def plain_name(label: str) -> str:
    """A label with nothing but letters, digits and ``_ . + -``."""
    # A pair of names is joined by `--`: within a name it would make two pairs alike.
    return re.sub(r"--+", "-", re.sub(r"[^\w.+-]+", "_", label)).strip("-") or "_"


def file_names(labels: Iterable[str]) -> dict[str, str]:
    """Each label as part of a file name, no two alike, even where case does not count."""
    names: dict[str, str] = {}
    taken: set[str] = set()
    for label in labels:
        plain = plain_name(label)
        numbered = (f"{plain}_{number}" for number in count(2))
        names[label] = next(name for name in chain([plain], numbered) if name.casefold() not in taken)
        taken.add(names[label].casefold())
    return names
