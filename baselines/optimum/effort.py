"""The machine's own motion, which costs next to nothing: it decides among plans of equal cues."""

from __future__ import annotations

from typing import Final

from ..symbolic.library import Expression, cs

_REACH: Final = (10.0, 10.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 10.0)
"""A large position of each axis, m and rad."""

_PACE: Final = (3.0, 3.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 1.0)
"""A large rate of each axis, m/s and rad/s."""

_PUSH: Final = (3.0, 3.0, 3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 2.0)
"""A large acceleration of each axis, m/s^2 and rad/s^2."""


def effort(q: Expression, v: Expression, a: Expression, b: Expression) -> Expression:
    """Distances from neutral, rates, accelerations and their changes, each in its large value."""
    parts = (
        q / cs.DM(_REACH),
        v / cs.DM(_PACE),
        0.5 * (a + b) / cs.DM(_PUSH),
        (b - a) / cs.DM(_PUSH),
    )
    return cs.vertcat(*parts)
