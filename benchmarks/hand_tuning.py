"""Times of a replay of `motion-cueing tune --live`: from the request to the answer, packed.

python -m benchmarks.hand_tuning
"""

from __future__ import annotations

import time

import numpy as np

from motion_cueing.baselines.washout.families import load_parameters
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.reporting.view.tuning import HandTuning

DRIVES = ("double-lane-change", "braking")
CHANGES = 30


def main() -> None:
    platform = get_platform("paper")
    for preset in ("classical-tuned", "adaptive-tuned", "optimal-washout-tuned"):
        for name in DRIVES:
            drive = get_maneuver(name).drive()
            tuning = HandTuning(load_parameters(preset), [drive], platform)
            wall, processor = [], []
            for place in np.linspace(0.2, 0.8, CHANGES):
                before = time.process_time()
                answer = tuning.replay({"drive": name, "places": {"force_scale.0": float(place)}})
                processor.append(time.process_time() - before)
                wall.append(answer["seconds"])
            # The first also drives the start.
            columns = [
                f"{1e3 * np.median(one[1:]):.0f} (at most {1e3 * max(one[1:]):.0f})"
                for one in (wall, processor)
            ]
            print(f"{preset}, {name} of {drive.duration:.1f} s: {columns[0]} ms, processor {columns[1]} ms")


if __name__ == "__main__":
    main()
