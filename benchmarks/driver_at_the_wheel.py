"""J against the time known ahead, for every class of information; and one drive as it was predicted and felt.

    python -m benchmarks.driver_at_the_wheel --out driver-at-the-wheel.png

Predictive control is given 0.2 to 2 s ahead: the truth, a prediction, or the present cue held. Agents are
lines across. Mean J over some standard maneuvers; a few minutes of one core.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from motion_cueing.baselines.mpc.parameters import MpcParameters
from motion_cueing.baselines.mpc.policy import make_mpc
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.storage import write_bytes
from motion_cueing.envs.task.predictor import find_predictor, with_preview
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.reporting.figures import new_figure, png, styled
from motion_cueing.evaluation.rollout import rollout

MANEUVERS = ("braking", "double-lane-change", "slalom", "roundabout")
LEADS = (0.2, 0.5, 1.0, 2.0)
AGENTS = {
    "learned": "now",
    "learned-controls": "controls",
    "learned-road": "road",
    "learned-preview": "2 s true",
}
SHOWN = "roundabout"


def score(policy, drives) -> float:
    """Mean J."""
    return float(np.mean([measure(rollout(policy, drive)).cue_error for drive in drives]))


def main() -> None:
    """Drive, draw, and print the figures of the picture."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, default=Path("driver-at-the-wheel.png"))
    parser.add_argument("--predictor", default="road")
    parser.add_argument("--agents", nargs="*", default=[], help="NAME=FILE in place of shipped agents")
    given = parser.parse_args()
    files = dict(text.split("=", 1) for text in given.agents)
    platform, drives = get_platform("paper"), [get_maneuver(name).drive() for name in MANEUVERS]
    rows = {"no preview": [score(make_mpc(platform), drives)]}
    for preview in ("held", "predicted", "true"):
        known = [with_preview(drive, preview, given.predictor) for drive in drives]
        rows[preview] = []
        for lead in LEADS:
            parameters = MpcParameters()
            forecast = replace(parameters.forecast, preview=lead)
            rows[preview].append(score(make_mpc(platform, replace(parameters, forecast=forecast)), known))
    agents = {name: make_policy(files.get(name, name), platform) for name in AGENTS}
    lines = {name: score(policy, drives) for name, policy in agents.items()}
    for name, values in (*rows.items(), *((name, [value]) for name, value in lines.items())):
        print(f"{name}: {', '.join(f'{value:.3g}' for value in values)}")
    draw(rows, lines, agents, given)


def draw(rows, lines, agents, given) -> None:
    """The picture."""
    drive = get_maneuver(SHOWN).drive()
    known = find_predictor(given.predictor)(drive)
    at = int(np.argmin(np.abs(known.leads - 1.0)))
    felt = {name: rollout(agents[name], drive) for name in ("learned", "learned-road")}
    with styled():
        figure = new_figure(11.0, 4.2)
        left, right = figure.subplots(1, 2)
        for preview, style in (("held", ":"), ("predicted", "-"), ("true", "--")):
            left.plot(
                (0.0, *LEADS), rows["no preview"] + rows[preview], style, marker="o", label=f"mpc, {preview}"
            )
        for k, (name, value) in enumerate(lines.items()):
            left.axhline(value, color=f"C{3 + k}", linewidth=1.0)
            left.text(2.0, value, f"{name} ({AGENTS[name]})", fontsize=7, ha="right", va="bottom")
        left.set(
            xlabel="time known ahead, s", ylabel="J", yscale="log", title="J against the time known ahead"
        )
        left.legend()
        right.plot(drive.time, drive.specific_force[:, 1], color="black", label="car")
        right.plot(drive.time + 1.0, known.mean[:, at, 1], ":", label="predicted 1 s before")
        for name, one in felt.items():
            right.plot(one.time, one.f_simulator[:, 1], label=f"{name}, in the cab")
        right.set(xlabel="s", ylabel="lateral specific force, m/s²", title=SHOWN, xlim=(0.0, drive.duration))
        right.legend(fontsize=7)
    write_bytes(given.out, png(figure))


if __name__ == "__main__":
    main()
