"""What a simulator's state says to a renderer."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..platform.state import CARRIAGE, LEGS, TURNTABLE
from .cue_history import CueHistory
from .motion_view import MotionView


def motion_of(state: Any) -> MotionView:
    """The pose in one row of :attr:`..simulator.Simulator.state`."""
    motion = state["motion"]
    position = motion["position"]
    return MotionView(
        carriage=position[CARRIAGE],
        hexapod=np.concatenate([motion["displacement"], motion["beta"]]),
        turntable=float(position[TURNTABLE]),
        legs=position[LEGS],
    )


def append_state(history: CueHistory, time: float, state: Any) -> None:
    """Add the cues in one row of :attr:`..simulator.Simulator.state` to a history."""
    wanted, felt = (
        np.concatenate([state[name]["force"], state[name]["rate"]]) for name in ("wanted", "felt")
    )
    history.append(time, wanted, felt)
