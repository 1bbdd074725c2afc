"""An export against Python: compiled with the machine's compiler, driven, compared and timed."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ...baselines.interface import Machines
from ...baselines.policy import Policy
from ...envs.cues import GRAVITY, CueTrace
from ...envs.errors import MotionCueingError
from ...envs.platform.machines import Platform
from ...envs.simulator.kernels.observation import read
from ...evaluation.rollout import Actor
from .source import Source, write_files

Floats = NDArray[np.float64]

WARNINGS: Final = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Wshadow",
    "-Wdouble-promotion",
    "-Wfloat-equal",
    "-Wcast-qual",
    "-Wstrict-prototypes",
    "-Wmissing-prototypes",
    "-Wswitch-default",
    "-Wundef",
)
"""Options with which an export compiles without a warning."""


TOLERANCE: Final = {False: 5e-6, True: 1e-3}
"""Largest difference from Python that an export may have; in double precision, and in single.

Washouts in double precision differ by 1e-14; networks compute in single precision in Python, too.
"""


class CompilerError(MotionCueingError, RuntimeError):
    """There is no C compiler, or it refuses the code."""


def compiler() -> str:
    """The machine's C compiler: ``CC`` of the environment, else cc, gcc or clang.

    Raises:
        CompilerError: there is none.
    """
    for name in (os.environ.get("CC"), "cc", "gcc", "clang"):
        found = shutil.which(name) if name else None
        if found:
            return found
    raise CompilerError("no C compiler found: install gcc or clang, or name one in the environment as CC")


def run_compiler(arguments: Sequence[str]) -> str:
    """Compile; returns what the compiler says.

    Raises:
        CompilerError: there is no compiler, or it fails.
    """
    done = subprocess.run([compiler(), *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise CompilerError(f"the C compiler fails: {done.stderr.strip()[:1000]}")
    return done.stderr


def compile_shared(source: Source, folder: Path) -> Compiled:
    """Compile an export in a folder of its own, which gets its files.

    Raises:
        CompilerError: there is no compiler, or it refuses the code.
    """
    write_files(source, folder)
    (folder / "driver.c").write_text(_driver(source), encoding="utf-8")
    library = folder / f"{source.name}.so"
    files = [str(folder / f"{source.name}.c"), str(folder / "driver.c")]
    run_compiler(["-std=c99", "-O3", "-shared", "-fPIC", "-o", str(library), *files, "-lm"])
    return Compiled(source, library)


@dataclass(frozen=True)
class Compiled:
    """A compiled export.

    Args:
        source: The export.
        library: The shared library.
    """

    source: Source
    library: Path

    def drive(self, inputs: Floats, repeats: int = 1) -> tuple[Floats, Floats]:
        """Steps from the beginning, one a row.

        Args:
            inputs: (n, entries) in the order of :attr:`Source.inputs`.
            repeats: Drives one after another, for the time of a step.

        Returns:
            (n, entries) outputs, and (repeats n,) seconds that each step took.
        """
        library: Any = ctypes.CDLL(str(self.library))
        given = np.ascontiguousarray(inputs, dtype=np.float64)
        out = np.zeros((len(given), sum(one.size for one in self.source.outputs)))
        seconds = np.zeros(repeats * len(given))
        kind = ctypes.POINTER(ctypes.c_double)
        pointers = [array.ctypes.data_as(kind) for array in (given, out, seconds)]
        library.drive(ctypes.c_long(len(given)), ctypes.c_long(repeats), *pointers)
        return out, seconds


@dataclass(frozen=True)
class Comparison:
    """An export against Python over a drive.

    Args:
        difference: Largest difference of each output, over 1 or its magnitude where that is larger.
        seconds: (n,) time of each step in C.
    """

    difference: float
    seconds: Floats


_REPEATS: Final = 5
"""Drives to time a step: the first of them fills the processor's memories."""


def compare(compiled: Compiled, policy: Policy, platform: Platform, drive: CueTrace) -> Comparison:
    """Take an export and the policy in Python through a drive.

    Args:
        compiled: The export, of the policy by itself or of the whole step.
        policy: The policy, made for the machine.
        platform: The machine.
        drive: Cues in steps of 10 ms.
    """
    given, expected = _recorded(compiled.source, policy, platform, drive)
    found, seconds = compiled.drive(given, _REPEATS)
    known = expected.shape[1]
    difference = np.abs(found[:, :known] - expected) / np.maximum(1.0, np.abs(expected))
    return Comparison(float(difference.max()), seconds[len(given) :])


def _recorded(source: Source, policy: Policy, platform: Platform, drive: CueTrace) -> tuple[Floats, Floats]:
    """(n, entries) inputs and outputs of an export's steps, as Python has them."""
    interface = policy.connect(Machines([drive], [platform]))
    interface.begin(policy.start_pose)
    actor = Actor(policy, 1, interface.action_size)
    seen: list[Floats] = []
    done: list[Floats] = []
    moved: list[Floats] = []
    while len(moved) < len(drive) - 1:
        observation = interface.observe()
        action, _ = actor(observation)
        seen.append(observation[0].astype(np.float64))
        done.append(action[0])
        for _ in interface.act(action):
            moved.append(_set_point(interface.simulator.state[0]["setpoint"]))
    # The last action may go on behind the end of the drive.
    moved = moved[: len(drive) - 1]
    first = source.inputs[0].name
    if source.outputs[0].name != "position":
        inputs = np.array(seen) if first == "observation" else _readings(np.array(seen))
        return inputs, np.array(done)
    cues = np.hstack([drive.specific_force, drive.angular_velocity])
    rows = [np.arange(len(moved))]
    rows += [rows[0] + round(ahead / drive.dt) for ahead in source.ahead]
    inputs = np.hstack([cues[np.minimum(one, len(cues) - 1)] for one in rows])
    return inputs, np.array(moved)


def _set_point(motion: Any) -> Floats:
    """Positions and rates of the nine axes."""
    positions = [motion["position"][:2], motion["displacement"], motion["beta"], motion["position"][8:]]
    rates = [motion["rate"][:2], motion["velocity"], motion["beta_rate"], motion["rate"][8:]]
    return np.concatenate(positions + rates)


def _readings(rows: Floats) -> Floats:
    """Inputs of a washout by itself, from the simulator's observations."""
    parts = [read(rows, "reference_force") - np.array([0.0, 0.0, GRAVITY]), read(rows, "reference_rate")]
    parts += [
        read(rows, name)
        for name in ("carriage", "carriage_rate", "displacement", "velocity", "beta", "beta_rate")
    ]
    angle = read(rows, "turntable")
    return np.hstack([*parts, np.arctan2(angle[:, :1], angle[:, 1:]), read(rows, "turntable_rate")])


def _driver(source: Source) -> str:
    """C that takes an export through a drive and times each step."""
    name = source.name
    given, taken = 0, 0
    fill, read = [], []
    for one in source.inputs:
        for _, place in one.entries():
            fill.append(f"        input.{place} = ({_kind(source, one.kind)})given[{given}];")
            given += 1
    for one in source.outputs:
        for _, place in one.entries():
            read.append(f"        taken[{taken}] = (double)output.{place};")
            taken += 1
    return f"""#define _POSIX_C_SOURCE 199309L
#include "{name}.h"
#include <time.h>

void drive(long n, long repeats, const double *inputs, double *outputs, double *seconds);

void drive(long n, long repeats, const double *inputs, double *outputs, double *seconds) {{
    for (long r = 0; r < repeats; r++) {{
    static {name}_state state;
    {name}_init(&state);
    for (long k = 0; k < n; k++) {{
        const double *given = inputs + k * {given};
        double *taken = outputs + k * {taken};
        {name}_input input;
        {name}_output output;
        struct timespec began, ended;
{chr(10).join(fill)}
        clock_gettime(CLOCK_MONOTONIC, &began);
        {name}_step(&state, &input, &output);
        clock_gettime(CLOCK_MONOTONIC, &ended);
        seconds[r * n + k] =
            (double)(ended.tv_sec - began.tv_sec) + 1e-9 * (double)(ended.tv_nsec - began.tv_nsec);
{chr(10).join(read)}
    }}
    }}
}}
"""


def _kind(source: Source, kind: str) -> str:
    return f"{source.name}_real" if kind == "real" else kind
