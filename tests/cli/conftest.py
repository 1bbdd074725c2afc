"""Figures that no test looks at are not drawn."""

from __future__ import annotations

from typing import IO, Any

import pytest
from matplotlib.figure import Figure


@pytest.fixture
def undrawn(monkeypatch) -> None:
    """Figures are made, and their files are empty: drawing takes most of the time of a small evaluation."""

    def nothing(figure: Figure, file: IO[bytes], **_: Any) -> None:
        file.write(b"")

    monkeypatch.setattr(Figure, "savefig", nothing)
