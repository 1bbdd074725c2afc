"""A policy on its machine in real time: live cues, steps of 10 ms, and set-points between them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ..baselines.interface import Live, Machines
from ..baselines.policy import Policy, as_policy
from ..envs.cues import CONTROLS, GRAVITY, CueTrace
from ..envs.errors import ActionError, ConfigurationError
from ..envs.expected import ExpectedCues, Preview
from ..envs.perception import VestibularModel, get_vestibular_model
from ..envs.platform import Platform
from ..envs.platform.kernels.step import CARRIAGE, LEGS, TURNTABLE
from ..envs.road import ROAD_TIMES, Ahead, RoadMap, Route
from ..envs.simulator.kernels.observation import SCALES
from ..envs.simulator.simulator import N_AXES, TIME_STEP, Simulator
from ..envs.task.kernels.observation import ObservationOptions
from ..envs.task.knowledge import Controls as KnownControls
from ..envs.task.knowledge import KnownRows, preview_times
from ..envs.task.predictor import DEFAULT, LivePredictor, find_predictor
from ..evaluation.rollout import Actor
from ..evaluation.suite import explain
from .packets import MOTION, MOTION_SIZE, Cues, Road

Floats = NDArray[np.float64]

AT_REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cues of a car that stands: specific force and angular velocity; read-only."""
AT_REST.setflags(write=False)

_SCALE: Final = np.repeat([SCALES["reference_force"], SCALES["reference_rate"]], 3)

NOW: Final = 1
"""Row of the present reference cue; the kernels step to it from the row before."""


def standing(ahead: int) -> CueTrace:
    """The drive whose rows :class:`LiveCues` fills: what was, what is, and ``ahead`` steps to come."""
    n = NOW + 1 + ahead
    time, still, level = np.asarray(TIME_STEP * np.arange(n), dtype=np.float64), np.zeros(n), np.zeros(2)
    road = RoadMap.of_route(Route.unknown(level, 0.0), level, None, still, still)
    channels = dict.fromkeys(CONTROLS, still)
    return CueTrace(
        "live", time, np.tile(AT_REST[:3], (n, 1)), np.zeros((n, 3)), channels=channels, road=road
    )


class LiveCues:
    """The rows of a simulator's only drive, moved on by one each time step, the newest cues at their end.

    A policy that looks ahead sees the newest cues that far ahead.

    Args:
        live: With one environment on the CPU and the drive of :func:`standing`.
        forecast: The expected cues, where policies see these in place of the true ones ahead.
    """

    def __init__(self, live: Live, forecast: LiveForecast | None = None) -> None:
        drives = live.simulator.constants[2]
        self._shown, self._newest = live.shown, AT_REST
        self._simulator = live.simulator
        self._rows = [drives.force.numpy(), drives.rate.numpy(), drives.rate_derivative.numpy()]
        # Views that are made once: each step of a millisecond counts.
        self._moves = [(rows[:-1], rows[1:], rows[-1]) for rows in self._rows]
        self._samples = [states.numpy()["sample"] for states, _ in live.simulator.copies]
        self._low_passes = [
            _LowPasses(memory.view, constants, self._scaled())
            for memory, constants in live.memories
            if constants
        ]
        self._known = [_LiveKnown(rows.view, options) for rows, options in live.known if options.knows]
        self._expected = [
            _LiveExpected(rows.view, options, forecast.expected)
            for rows, options in live.known
            if forecast is not None and options.preview
        ]

    @property
    def reference_cue(self) -> Floats:
        """(6,) cues of the car now."""
        return np.concatenate([self._rows[0][NOW], self._rows[1][NOW]])

    def put(self, cues: Floats, known: Cues | None = None) -> None:
        """Move on by a time step.

        Args:
            cues: (6,) the newest: force, m/s^2, angular velocity, rad/s.
            known: The packet with controls and road; None for a car that stands.

        Raises:
            ConfigurationError: the policy sees what the packet does not have.
        """
        if self._shown is not None:
            self._newest = cues
            cues = self._shown.put(cues)
        change = (cues[3:] - self._moves[1][2]) / TIME_STEP
        for (earlier, later, last), newest in zip(self._moves, (cues[:3], cues[3:], change), strict=True):
            earlier[...] = later
            last[...] = newest
        # The kernels count samples; here the sample they step to is always the same row.
        self._samples[self._simulator.current][...] = NOW - 1
        scaled = self._scaled()
        for one in self._low_passes:
            one.put(scaled)
        for rows in self._known:
            rows.put(known)
        for expected in self._expected:
            expected.put(self.reference_cue)

    def begin(self) -> None:
        """Take the car to have moved for ever as it moves now, as at the beginning of any drive."""
        if self._shown is not None:
            self._shown.begin(self._newest)
            cues = self._shown.put(self._newest)
            for (*_, last), written in zip(self._moves, (cues[:3], cues[3:], 0.0), strict=True):
                last[...] = written
        for one in self._low_passes:
            one.begin(self._scaled())

    def _scaled(self) -> Floats:
        """(6,) cues of the car now, as an observation scales them."""
        return np.asarray((self.reference_cue - AT_REST) / _SCALE)


class _KnownNow:
    """Rows of controls and road of the present sample, of packets.

    Args:
        make: Makes the rows.
        allow_missing: Whether packets may lack the road.
    """

    def __init__(self, make: KnownRows, allow_missing: bool) -> None:
        self._make, self._allow_missing = make, allow_missing
        self._smooth: Floats | None = None

    def __call__(self, packet: Cues | None) -> Floats:
        """(size,) after a time step with a packet; None for a car that stands."""
        if packet is None:
            self._smooth = None
            return np.asarray(self._make(_standing_controls(), None, _NO_MAP)[0][0])
        if packet.controls is None:
            raise ConfigurationError("the policy sees the car's speed, which the packets do not have")
        times = self._make.times
        if len(times) and packet.road is None and not self._allow_missing:
            raise ConfigurationError("the policy sees the road ahead, which the packets do not have")
        wheel, throttle, brake, speed, slip = (np.array([value]) for value in packet.controls)
        controls = KnownControls(wheel, throttle, brake, speed, slip, np.array([True]))
        there = np.array([packet.road is not None])
        rows, self._smooth = self._make(controls, self._ahead(packet.road), there, self._smooth)
        return np.asarray(rows[0])

    def _ahead(self, road: Road | None) -> Ahead | None:
        if road is None:
            return None
        columns = (road.curvature, road.grade, road.bank, road.speed_limit)
        curvature, grade, bank, limit = (
            np.interp(self._make.times, ROAD_TIMES, column)[None, :] for column in columns
        )
        return Ahead(curvature, grade, bank, limit, np.array([road.stop_distance]))


class _LiveKnown:
    """Controls and road of the present sample, in the row that observations read.

    Args:
        rows: (samples, size) that observations read, expected cues behind them.
        options: What is seen.
    """

    def __init__(self, rows: NDArray[Any], options: ObservationOptions) -> None:
        make = KnownRows(options)
        self._row, self._known = rows[NOW, : make.size], _KnownNow(make, options.allow_missing)

    def put(self, packet: Cues | None) -> None:
        """Move on by a time step, with a packet; None for a car that stands."""
        self._row[...] = self._known(packet)


class _LiveExpected:
    """Expected cues of the present sample, in the row that observations read.

    Args:
        rows: (samples, size) that observations read; their last columns are the expected cues.
        options: What is seen.
        expected: The cues.
    """

    def __init__(self, rows: NDArray[Any], options: ObservationOptions, expected: ExpectedCues) -> None:
        self._row, self._expected = rows[NOW, -6 * options.preview :], expected
        self._times = preview_times(options)

    def put(self, cues: Floats) -> None:
        """Move on by a time step, with the cues (6,) of the car now."""
        ahead = self._expected.at(cues[None], self._times, slice(NOW, NOW + 1))[0]
        self._row[...] = ((ahead - AT_REST) / _SCALE).ravel()


_NO_MAP: Final = np.array([False])


def _standing_controls() -> KnownControls:
    zero = np.zeros(1)
    return KnownControls(zero, zero, zero, zero, zero, known=np.array([True]))


class _LowPasses:
    """The low-passed cues of the present sample, in the row that observations read.

    Args:
        memory: (samples, 6 per time constant) that observations read.
        time_constants: Of the low-passes, s.
        cues: (6,) as they were for ever.
    """

    def __init__(self, memory: NDArray[Any], time_constants: Sequence[float], cues: Floats) -> None:
        self._row = memory[NOW]
        self._poles = np.exp(-TIME_STEP / np.array(time_constants, dtype=np.float64))[:, None]
        self._past: Floats = np.tile(cues, (len(time_constants), 1))

    def begin(self, cues: Floats) -> None:
        """Cues (6,) were as now for ever."""
        self._past[...] = cues
        self._row[...] = self._past.ravel()

    def put(self, cues: Floats) -> None:
        """Move on by a time step, with cues (6,)."""
        self._past = self._poles * self._past + (1.0 - self._poles) * cues
        self._row[...] = self._past.ravel()


AXES_AND_LEGS: Final = 15
"""Entries of a :class:`MotionView`."""


class MotionView:
    """Reads where a machine's set-point is, fast: its memory is looked up once, not field by field each time.

    Args:
        simulator: With one environment on the CPU.
    """

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator
        self._parts = [_parts_of(states.numpy()[0]["setpoint"]) for states, _ in simulator.copies]

    def __call__(self) -> Floats:
        """(2, 15) positions and rates of the nine axes and the six legs; m, rad, from neutral."""
        positions, rates = self._parts[self._simulator.current]
        return np.concatenate(positions + rates).reshape(2, AXES_AND_LEGS)


def _parts_of(motion: Any) -> tuple[list[Floats], list[Floats]]:
    """Views of positions and rates of a ``Motion``: axes in the order of ``AXES``, then legs."""
    position, rate = motion["position"], motion["rate"]
    table = slice(TURNTABLE, TURNTABLE + 1)
    return (
        [position[CARRIAGE], motion["displacement"], motion["beta"], position[table], position[LEGS]],
        [rate[CARRIAGE], motion["velocity"], motion["beta_rate"], rate[table], rate[LEGS]],
    )


class Track:
    """Set-points of one time step, for the end of each of its periods.

    Within a step an actuator moves with constant acceleration. Velocity goes in a straight line from one step
    to the next, acceleration is its slope, and position follows Hermite's cubic, which is the parabola itself
    where acceleration is constant. So velocities and accelerations keep the limits that the steps keep.

    Args:
        periods: In a time step.
        dt: Time step, s.
    """

    def __init__(self, periods: int, dt: float) -> None:
        s = np.arange(1, periods + 1)[:, None] / periods
        self._share, self._dt = s, dt
        # Hermite's basis for p0, p1 and the rates at both ends.
        self._basis = np.hstack(
            [(1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s), dt * s * (1 - s) ** 2, dt * s**2 * (s - 1)]
        )

    def between(self, begin: Floats, end: Floats) -> Floats:
        """(periods, 39) numbers of the set-points between two motions of :class:`MotionView`."""
        position = self._basis @ np.vstack([begin[0], end[0], begin[1], end[1]])
        rate = begin[1] + self._share * (end[1] - begin[1])
        # To the bit: the last set-point is the step's end.
        position[-1], rate[-1] = end
        out = np.empty((len(position), MOTION_SIZE))
        out[:, MOTION["position"]], out[:, MOTION["legs"]] = position[:, :9], position[:, 9:]
        out[:, MOTION["velocity"]], out[:, MOTION["leg_rates"]] = rate[:, :9], rate[:, 9:]
        out[:, MOTION["acceleration"]] = (end[1, :9] - begin[1, :9]) / self._dt
        return out


_WARMING: Final = 4
"""Steps that meet both copies of every state."""


class LiveForecast:
    """Expected cues of the present sample, in place of a preview that nobody has.

    Args:
        preview: "held" for the present cue, "predicted" for a predictor.
        predictor: Name or file of the predictor.

    Attributes:
        expected: What policies see; its rows are all those of the present sample.
    """

    def __init__(self, preview: Preview, predictor: str = DEFAULT) -> None:
        self._live: LivePredictor | None = None
        leads: Floats = np.ones(1)
        if preview == "predicted":
            found = find_predictor(predictor)
            self._live, leads = LivePredictor(found), found.leads
        self.expected = ExpectedCues(leads, np.tile(AT_REST, (NOW + 1, len(leads), 1)))
        self._known = None if self._live is None else _KnownNow(self._live.rows, allow_missing=True)

    def begin(self) -> None:
        """Forget the past."""
        if self._live is not None:
            self._live.begin()

    def put(self, cues: Floats, packet: Cues | None) -> None:
        """Move on by a time step, with the car's cues (6,) and the packet of controls and road."""
        mean = self.expected.mean
        mean[...] = cues
        if self._live is not None and self._known is not None:
            mean[...] = self._live(cues, self._known(packet))


class LiveMachine:
    """One machine that moves while its cues come, and the policy that moves it.

    A rollout knows the cues at the end of a step when it takes it; here they are still to come. So each step
    is taken twice. At its begin the machine ahead takes it, whose motion is sent: motion does not depend on
    the reference cue. At its end the machine now takes it, with the cues that have come since: this one the
    policy sees. Both take the very steps of a rollout.

    Args:
        policy: The policy, made for the machine.
        platform: The machine.
        vestibular: Perception model.
        forecast: What policies with a preview take for it; None for cues that are sent ahead of time.

    Attributes:
        now: Where the machine is, with the live drive.
        ahead: The same a time step later.
        ahead_steps: Time steps that the policy looks ahead.
        start: (9,) pose to begin at.
        motion: (2, 15) set-point of the machine ahead, see :class:`MotionView`.
    """

    def __init__(
        self,
        policy: Policy,
        platform: Platform,
        vestibular: VestibularModel,
        forecast: LiveForecast | None = None,
    ) -> None:
        self._forecast = forecast
        self.ahead_steps = 0 if forecast is not None else round(policy.information.seconds / TIME_STEP)
        drive = standing(self.ahead_steps)
        if forecast is not None:
            drive = replace(drive, expected=forecast.expected)
            policy = policy.for_drive(drive)
        self._policy = policy
        # A base policy has a memory: each interface gets one of its own.
        self._now, self._ahead = (
            policy.connect(Machines([drive], [platform], None, vestibular)) for _ in range(2)
        )
        self.now, self.ahead = self._now.simulator, self._ahead.simulator
        self._follow = self._ahead.follow(self._now)
        self._cues = [LiveCues(one, forecast) for one in self._now.live]
        self._view = MotionView(self.ahead)
        self.start = np.asarray(policy.start_pose, dtype=np.float64)
        self.reset()
        self.begin()

    def reset(self) -> None:
        """Put the machine at rest at its start pose."""
        for simulator in (self.now, self.ahead):
            simulator.reset(self.start)
        self._last: Floats | None = None
        self.motion = self._view()

    def begin(self) -> None:
        """The policy begins anew, from where the machine is."""
        if self._forecast is not None:
            self._forecast.begin()
        for cues in self._cues:
            cues.begin()
        self._now.begin(None)
        self._actor = Actor(self._policy, 1, self._now.action_size)
        self._let_go()

    @property
    def reference_cue(self) -> Floats:
        """(6,) cues of the car now: specific force, m/s^2, and angular velocity, rad/s."""
        return self._cues[0].reference_cue

    def catch_up(self, cues: Floats, known: Cues | None = None) -> None:
        """Take the machine to where it was a step ahead, with the car's cues (6,) there.

        Args:
            cues: Specific force, m/s^2, and angular velocity, rad/s.
            known: The packet with controls and road; None for a car that stands.

        Raises:
            Exception: any error of the policy's own code; the machine is there all the same.
        """
        if self._forecast is not None:
            self._forecast.put(cues, known)
        for live_cues in self._cues:
            live_cues.put(cues, known)
        if self._last is None:
            for one in self._now.live:
                one.simulator.reset(self.start, sample=NOW)
            return
        try:
            if self._actions is None:
                self.now.step(self._last)
            else:
                next(self._actions[0])
                if self._left == 0:
                    # The end of the action makes the observation whole.
                    next(self._actions[0], None)
        except Exception:
            self.now.restore(self.ahead.snapshot())
            raise

    def act(self) -> tuple[Floats, float]:
        """Let the policy act; returns the (9,) accelerations it requests, and the seconds it took.

        Raises:
            Exception: any error of the policy's own code, or an ActionError; nothing has moved then.
        """
        try:
            seconds = self._lead()
            self._arrive()
        except Exception:
            self.ahead.restore(self.now.snapshot())
            raise
        self._last = self._ahead.requested[0]
        return self._last, seconds

    def move(self, accelerations: Floats) -> None:
        """Take the next step with (9,) accelerations of ours instead of the policy's."""
        self._let_go()
        self.ahead.step(accelerations)
        self._arrive()
        self._last = accelerations

    def _let_go(self) -> None:
        """Forget the action that the policy had begun."""
        self._actions: tuple[Iterator[None], Iterator[None]] | None = None
        self._left = 0

    def _lead(self) -> float:
        """Ask the policy if its last action is over, and take the machine ahead through the next step."""
        seconds, actions = math.nan, self._actions
        if actions is None or self._left == 0:
            action, seconds = self._actor(self._now.observe())
            actions = self._now.act(action), self._ahead.act(action)
            self._actions, self._left = actions, self._now.steps_per_action
        # The base policy, if there is one, must see the cues that have come since.
        self._follow()
        next(actions[1])
        self._left -= 1
        return seconds

    def _arrive(self) -> None:
        motion = self._view()
        if not np.isfinite(motion).all():
            raise ActionError("the policy requested accelerations beyond all numbers")
        self.motion = motion


def make_machine(
    policy: Any,
    platform: Platform,
    vestibular: str = "zacharias",
    preview: Preview = "true",
    predictor: str = DEFAULT,
) -> LiveMachine:
    """A policy on its machine, warmed up: kernels are compiled, and the policy has acted once.

    Args:
        policy: A policy, or any object with ``predict``.
        platform: The machine.
        vestibular: Perception model by name.
        preview: Where a policy with a preview has it from: "true" for cues that are sent ahead of time,
            "held" for the present cue, "predicted" for a predictor.
        predictor: Name or file of the predictor.

    Raises:
        ConfigurationError: the policy must know the drive before it begins, or was made for another machine,
            time step or perception model.
    """
    policy = as_policy(policy)
    seen_ahead = policy.information.kind == "preview"
    if policy.needs_drive and not (seen_ahead and preview != "true"):
        raise ConfigurationError(
            f"{policy.name} must know the drive before it begins; live cues are not known ahead"
        )
    if policy.time_step not in (None, TIME_STEP):
        raise ConfigurationError(
            f"the policy's time step is {policy.time_step} s, the machine's {TIME_STEP} s"
        )
    forecast = LiveForecast(preview, predictor) if seen_ahead and preview != "true" else None
    model = get_vestibular_model(vestibular)
    machine = LiveMachine(policy.for_platform(platform), platform, model, forecast)
    # A step of every kind, then at rest again: the first in real time takes no longer than the others.
    try:
        for _ in range(_WARMING):
            machine.catch_up(AT_REST)
            machine.begin()
            machine.act()
    except Exception as error:
        raise ConfigurationError(f"{policy.name} fails with a car that stands: {explain(error)}") from None
    machine.move(np.zeros(N_AXES))
    machine.catch_up(AT_REST)
    machine.reset()
    return machine
