"""What a step of each shipped agent takes through ONNX Runtime, beside the predictive controllers.

    python -m benchmarks.agents

Agents answer to what they see in the maneuvers, one observation after another, on one thread; by the clock,
and in processor time, in which other work on the machine counts less. The predictive controllers, compiled,
drive the same maneuvers in the same process; their first step, in which libraries wake, counts. An answer
of an agent holds for some time steps, a controller plans at each: so there are two ratios.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.predictive import MANEUVERS, steps
from benchmarks.report import machine, yes
from motion_cueing.baselines.policy import Wrapper
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.evaluation import rollout
from motion_cueing.train.agents import Agent, agent_names, get_agent
from motion_cueing.train.agents.export import INPUT, OUTPUT, export_onnx

FASTER = 400.0
"""Times than the nonlinear controller that an agent shall be."""
P99_US = 100.0
"""That an agent's step shall keep by the clock."""
WARM_UP = 1000

Answer = Callable[[np.ndarray], Any]
"""An agent's to an observation (1, size)."""


class Watched(Wrapper):
    """An agent that remembers what it saw."""

    def __init__(self, agent: Agent) -> None:
        super().__init__(agent)
        self.seen: list[np.ndarray] = []

    def predict(self, observation: np.ndarray, *arguments: Any, **options: Any) -> Any:
        self.seen.append(np.array(observation, dtype=np.float32).reshape(1, -1))
        return self.inner.predict(observation, *arguments, **options)


def seen_by(agent: Agent) -> list[np.ndarray]:
    """Observations (1, size) of an agent in the maneuvers."""
    watched: Any = Watched(agent)
    for name in MANEUVERS:
        rollout(watched, get_maneuver(name).drive(), agent.platform)
    return watched.seen


def session_of(agent: Agent) -> Any:
    """ONNX Runtime with the agent's exported file, on one thread."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "agent.onnx"
        export_onnx(agent, file)
        return onnxruntime.InferenceSession(file.read_bytes(), options, providers=["CPUExecutionProvider"])


def plain(session: Any, size: int) -> Answer:
    """Called as most do: arrays in, new arrays out."""
    return lambda observation: session.run([OUTPUT], {INPUT: observation})


def bound(session: Any, size: int) -> Answer:
    """Called as a controller does: its input and output lie where they always lie."""
    from onnxruntime import OrtValue

    (output,) = session.get_outputs()
    given, answer = np.zeros((1, size), dtype=np.float32), np.zeros((1, output.shape[1]), dtype=np.float32)
    binding = session.io_binding()
    binding.bind_ortvalue_input(INPUT, OrtValue.ortvalue_from_numpy(given))
    binding.bind_ortvalue_output(OUTPUT, OrtValue.ortvalue_from_numpy(answer))

    def call(observation: np.ndarray) -> np.ndarray:
        given[...] = observation
        session.run_with_iobinding(binding)
        return answer.copy()

    (expected,) = session.run([OUTPUT], {INPUT: given + 0.1})
    if not np.array_equal(call(given + 0.1), expected):
        raise SystemExit("ONNX Runtime copied what it was bound to")
    return call


def by_clock(answer: Answer, seen: list[np.ndarray], count: int) -> np.ndarray:
    """Seconds of each of ``count`` answers."""
    seconds = np.zeros(WARM_UP + count)
    for k in range(WARM_UP + count):
        one = seen[k % len(seen)]
        began = time.perf_counter_ns()
        answer(one)
        seconds[k] = time.perf_counter_ns() - began
    return 1e-9 * seconds[WARM_UP:]


def of_processor(answer: Answer, seen: list[np.ndarray], count: int) -> float:
    """Mean seconds of ``count`` answers; asking for each would take a tenth as long as an answer."""
    began = time.thread_time()
    for k in range(count):
        answer(seen[k % len(seen)])
    return (time.thread_time() - began) / count


def row(name: str, called: str, kind: str, seconds: np.ndarray) -> list[str]:
    """Of the table, in us."""
    us = 1e6 * seconds
    values = [us.mean(), *np.percentile(us, [50.0, 99.0, 99.9]), us.max()]
    return [name, called, kind, f"{len(us)}", *(f"{value:,.1f}" for value in values)]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--agent", nargs="+", default=agent_names())
    parser.add_argument("--policy", nargs="+", default=["nmpc-preview", "nmpc", "mpc-preview"])
    parser.add_argument("--steps", type=int, default=100_000)
    given = parser.parse_args()
    Console(stderr=True).print(machine())
    controllers = {name: steps(name) for name in given.policy}
    out = Table("step of", "called", "time", "steps", "mean us", "p50", "p99", "p99.9", "longest")
    bars = Table("agent", *(f"{name} takes" for name in controllers), f"p99 below {P99_US:.0f} us")
    for name in given.agent:
        agent = get_agent(name)
        session, seen = session_of(agent), seen_by(agent)
        for called in (plain, bound):
            answer = called(session, agent.network.size)
            seconds = by_clock(answer, seen, given.steps)
            worked = of_processor(answer, seen, given.steps)
            out.add_row(*row(name, called.__name__, "clock", seconds))
            out.add_row(name, called.__name__, "processor", f"{given.steps}", f"{1e6 * worked:,.1f}")
        bars.add_row(name, *ratios(agent, worked, controllers), kept(seconds))
    for name, each in controllers.items():
        out.add_row(*row(name, "", "processor", each))
    told = f"Means of processor time over that of the agent's answer, bound; the bar for nmpc is {FASTER:.0f}"
    Console(width=130).print(out, told, bars)


def ratios(agent: Agent, seconds: float, controllers: dict[str, np.ndarray]) -> list[str]:
    """Mean step of each controller over the agent's, a time step and an answer."""
    repeat = agent.task.action.repeat
    found = [other.mean() / seconds for other in controllers.values()]
    return [f"{ratio:,.0f} times; {repeat * ratio:,.0f} a time step" for ratio in found]


def kept(seconds: np.ndarray) -> str:
    """Whether an agent keeps the bar of its 99th percentile."""
    return yes(1e6 * float(np.percentile(seconds, 99.0)) < P99_US)


if __name__ == "__main__":
    main()
