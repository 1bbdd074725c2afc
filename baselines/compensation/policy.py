"""A policy on a late machine: it drives an ideal one ahead, whose set-points the late one gets."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...envs.cues import CueTrace
from ...envs.platform.machines import UNITY, Platform
from ...envs.simulator.simulator import TIME_STEP, Simulator
from ..interface import Interface, Live, Machines, state_copier
from ..policy import Information, Policy, Wrapper, as_policy
from .cues import CuePredictor, earlier, steps_of
from .options import CompensationOptions, Lateness, lateness_of
from .setpoints import SetPointLead

Floats = NDArray[np.float64]
Array = NDArray[Any]

_AHEAD: Final = ("preview", "drive")
"""Kinds of information with true cues ahead."""


_LEG_SPEED: Final = 1.0 - 2e-4
"""Share of the legs' speed that an ideal machine has. Late legs go through the positions of poses whose legs
keep the limit at every step; between steps they are faster by 7e-5 at most where legs stay at their limit."""

_KEPT: Final = (
    "setpoint",
    "setpoint_acceleration",
    "simulator_cue",
    "vestibular_simulator",
    "perceived_simulator",
)
"""Of the state of a late machine, where an ideal one begins in mid-drive."""


class Compensated(Wrapper):
    """The policy with its machine's lag and dead time compensated.

    The policy itself sees and moves an ideal machine. What it sees of the car comes earlier by what the real
    machine is late, see :mod:`~motion_cueing.baselines.compensation`. Its preview reaches further by that.

    Args:
        policy: A policy, or any object with ``predict``.
        options: Of the compensation.
        machine: The late machine; default: the one the policy was made for.
    """

    def __init__(
        self, policy: Any, options: CompensationOptions | None = None, machine: Platform | None = None
    ) -> None:
        super().__init__(as_policy(policy))
        self.options = options or CompensationOptions()
        self._on(machine or self.platform)

    def _on(self, machine: Platform | None) -> None:
        self.platform = machine
        self.time_step = TIME_STEP
        known = self.inner.information
        late = 0.0 if machine is None else self._steps(machine) * TIME_STEP
        further = known.kind == "preview"
        self.information = Information.ahead(known.seconds + late) if further else known

    def _lateness(self, machine: Platform) -> Lateness:
        return lateness_of(machine, self.options)

    def _steps(self, machine: Platform) -> int:
        return steps_of(self._lateness(machine).common)

    @property
    def statistics(self) -> Mapping[str, str]:
        """What the policy counted, and the lateness known."""
        late = {} if self.platform is None else {"lateness_known_s": f"{self._known:.3f}"}
        return {**self.inner.statistics, **late}

    @property
    def _known(self) -> float:
        assert self.platform is not None
        return max(one.dynamics.lateness for one in self._lateness(self.platform).subsystems)

    def _before(self, policy: Policy, machine: Platform | None) -> Policy:
        moved = copy.copy(self)
        Wrapper.__init__(moved, policy)
        moved._on(machine)
        return moved

    def around(self, policy: Policy) -> Policy:
        """The same compensation before another policy."""
        return self._before(policy, self.platform)

    def for_drive(self, cues: CueTrace) -> Policy:
        """The policy for a drive: it plans for the cues as it will see them."""
        steps = 0 if self.platform is None else self._steps(self.platform)
        return self.around(self.inner.for_drive(earlier(cues, steps, hold=True)))

    def for_platform(self, platform: Platform) -> Policy:
        """The policy for a machine.

        One that was made for a machine runs on another that differs in lag and dead time alone, or in name.

        Raises:
            ConfigurationError: it was made for another machine.
        """
        own = self.inner.platform
        if own is not None and _ideal(own, own) == _ideal(platform, own):
            return self._before(self.inner.on(platform), platform)
        return self._before(self.inner.for_platform(platform), platform)

    def on(self, platform: Platform) -> Policy:
        """The policy on a machine."""
        return self._before(self.inner.on(platform), platform)

    def connect(self, machines: Machines) -> Interface:
        """The machines as the policy sees them; its own interface where none is late."""
        if all(one.lateness == 0.0 for platform in machines.platforms for one in platform.dynamics.values()):
            return self.inner.connect(machines)
        return LateMachines(self, machines)


def _ideal(platform: Platform, called: Platform) -> Platform:
    """A machine without lag and dead time, with the name of another."""
    return replace(platform.with_dynamics(UNITY), name=called.name, description=called.description)


def _ideal_of(platform: Platform) -> Platform:
    """The machine that the policy moves: without lag and dead time, its legs a hair slower."""
    hexapod = platform.hexapod
    slower = replace(hexapod, velocity=_LEG_SPEED * hexapod.velocity)
    return replace(platform, hexapod=slower).with_dynamics(UNITY)


class LateMachines(Interface):
    """Late machines, seen and moved by a policy for ideal ones.

    Args:
        policy: With the policy that is compensated.
        machines: The late ones.
    """

    def __init__(self, policy: Compensated, machines: Machines) -> None:
        platforms, n = machines.platforms, len(machines.drives)
        of = np.zeros(n, dtype=np.int32) if machines.platform_of is None else np.asarray(machines.platform_of)
        lateness = [lateness_of(platforms[int(k)], policy.options) for k in of]
        steps = [steps_of(one.common) for one in lateness]
        pairs = list(zip(machines.drives, steps, strict=True))
        knows = policy.inner.information.kind in _AHEAD
        seen = [
            earlier(drive, late) if knows else CuePredictor(late, policy.options).whole(drive)
            for drive, late in pairs
        ]
        ideal = [_ideal_of(platform) for platform in platforms]
        self._model = policy.inner.connect(replace(machines, drives=seen, platforms=ideal))
        self.simulator = Simulator(
            platforms,
            machines.drives,
            platform_of=machines.platform_of,
            vestibular=machines.vestibular,
            dt=machines.time_step,
        )
        self._lead = SetPointLead(lateness, policy.options, machines.time_step)
        self.action_size, self.steps_per_action = self._model.action_size, self._model.steps_per_action
        self.slices, self.simulator_cue_measured = self._model.slices, False
        # Cues that come one by one are those of one car.
        shown = [None if knows else CuePredictor(steps[0], policy.options) for _ in self._model.live]
        live = zip(self._model.live, shown, strict=True)
        self.live = (Live(self.simulator), *(replace(one, shown=filtered) for one, filtered in live))
        self.requested = np.zeros((n, 9))

    def begin(self, start: ArrayLike | None) -> None:
        """Begin all drives; from where the set-points are, the ideal machines begin there."""
        if start is None:
            self._place_model()
        else:
            self.simulator.reset(start)
        self._model.begin(start)
        self._lead.begin(self._model.simulator.state)

    def _place_model(self) -> None:
        """Put the ideal machines where the set-points of the late ones are, at the same samples."""
        model, late = self._model.simulator, self.simulator.state
        ends = np.array([len(drive) - 1 for drive in model.drives])[model.drive_of]
        state = np.array(model.reset(sample=np.minimum(late["sample"], ends)))
        for name in _KEPT:
            state[name] = late[name]
        state["motion"], state["acceleration"] = late["setpoint"], late["setpoint_acceleration"]
        model.restore({**model.snapshot(), "state": state.view(np.uint8).reshape(-1)})

    def observe(self) -> Array:
        """(n, size) what the policy sees of the ideal machines."""
        return self._model.observe()

    def act(self, action: Floats) -> Iterator[None]:
        """Move the ideal machines, and the late ones after them."""
        for _ in self._model.act(action):
            self.requested = self._lead(
                self._model.requested, self._model.simulator.state, self.simulator.state
            )
            self.simulator.step(self.requested)
            yield

    def follow(self, leader: Any) -> Callable[[], None]:
        """The ideal machines and the leads follow; late machines are moved alike."""
        model = self._model.follow(leader._model)
        states = state_copier(leader._model.simulator, self._model.simulator)

        def copy_all() -> None:
            model()
            states()
            self._lead.follow(leader._lead)

        return copy_all
