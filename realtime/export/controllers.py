"""What an export computes: a washout or an agent by itself, or all from the car's cues to set-points.

A policy by itself equals ``predict``: a washout from cues and machine to accelerations, an agent from the
environment's observation to its action. The whole step equals the simulator's: it holds the machine's
set-points, makes the observation, lets the policy act, and keeps all limits of the machine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import singledispatch
from typing import Any, Final

import numpy as np

from ...baselines.policy import Policy
from ...baselines.washout.classical.policies import ScheduledWashout
from ...baselines.washout.kernels.blocks import Reading, read_state
from ...baselines.washout.policy import WashoutPolicy
from ...envs.arrays import float_rows, pair_array, real_rows, vec9
from ...envs.cues import GRAVITY
from ...envs.errors import ConfigurationError
from ...envs.platform.kernels import step as platform
from ...envs.platform.kernels.step import Machine, Motion
from ...envs.platform.kinematics import legs_of_pose
from ...envs.platform.machines import Platform
from ...envs.platform.parameters import machine_parameters
from ...envs.simulator.kernels import step as simulator
from ...envs.simulator.kernels.observation import OBSERVATION_SIZE, SCALES
from ...envs.simulator.kernels.step import State
from ...envs.simulator.simulator import TIME_STEP
from ...envs.task.arrays import rules_of
from ...envs.task.kernels import action as task_action
from ...envs.task.kernels import observation as task_observation
from ...train.agents import Agent
from .network import network_code
from .source import Signal, Steps, array_text
from .translator import Translator
from .types import FLOAT, INT, REAL, UINT64, Code, Type, number, type_of

_CUES: Final = (
    Signal("force", "force", 3, "real", "m/s^2", "specific force of the car at the driver's place"),
    Signal("rate", "rate", 3, "real", "rad/s", "its angular velocity"),
)

_MACHINE: Final = (
    Signal("carriage", "carriage", 2, "real", "m", "set-point of the carriage"),
    Signal("carriage_rate", "carriage_rate", 2, "real", "m/s", "its rate"),
    Signal("displacement", "displacement", 3, "real", "m", "set-point of the hexapod, from neutral"),
    Signal("velocity", "velocity", 3, "real", "m/s", "its rate"),
    Signal("beta", "beta", 3, "real", "rad", "roll, pitch and yaw of the hexapod"),
    Signal("beta_rate", "beta_rate", 3, "real", "rad/s", "their rates"),
    Signal("psi_t", "psi_t", 1, "real", "rad", "set-point of the turntable"),
    Signal("psi_t_rate", "psi_t_rate", 1, "real", "rad/s", "its rate"),
)

_ACCELERATION: Final = Signal(
    "acceleration", "acceleration", 9, "real", "m/s^2, rad/s^2",
    "of carriage x, y, surge, sway, heave, roll, pitch, yaw, turntable",
)  # fmt: skip

_SET_POINTS: Final = (
    Signal(
        "position", "position", 9, "real", "m, rad",
        "carriage x, y, surge, sway, heave, roll, pitch, yaw, turntable at the end of the step",
    ),
    Signal("velocity", "velocity", 9, "real", "m/s, rad/s", "their rates"),
    Signal("acceleration", "acceleration", 9, "real", "m/s^2, rad/s^2", "constant over the step"),
    Signal("legs", "legs", 6, "real", "m", "extensions of the legs from neutral"),
    Signal("leg_rates", "leg_rates", 6, "real", "m/s", "their rates"),
    Signal("limits", "limits", 1, "uint64_t", "1", "limits met, 4 bits an actuator; 0 for none"),
)  # fmt: skip


def steps_of(policy: Policy, platform_: Platform | None, to: Translator, start: Any = None) -> Steps:
    """What an export of a policy computes, its functions translated.

    Args:
        policy: A washout or an agent.
        platform_: The machine, for the whole step to set-points; None for the policy by itself.
        to: Takes the functions.
        start: (9,) pose the whole step begins at; default: the policy's start pose.

    Raises:
        ConfigurationError: the policy has no form in C.
    """
    if platform_ is None:
        return alone(policy, to)
    controller = controller_of(policy, platform_, to)
    return _whole_step(controller, platform_, to, policy.start_pose if start is None else start)


def _refusal(policy: Any, why: str) -> ConfigurationError:
    return ConfigurationError(f"{policy.name} has no form in C: {why}")


_SCHEDULED: Final = "its gains are chosen from outside"


@singledispatch
def alone(policy: Policy, to: Translator) -> Steps:
    """A policy by itself."""
    raise _refusal(
        policy, "it is neither a washout nor an agent; the washout of its file or an agent has one"
    )


@alone.register(ScheduledWashout)
def _(policy: Policy, to: Translator) -> Steps:
    raise _refusal(policy, _SCHEDULED)


@alone.register(WashoutPolicy)
def _(policy: WashoutPolicy[Any], to: Translator) -> Steps:
    washout = _Washout(policy, to)
    inputs = (*_CUES, *_MACHINE)
    return Steps(
        about=f"{policy.name}: {policy.family.title}, from cues and machine to accelerations",
        input=_fields(inputs),
        output=_fields((_ACCELERATION,)),
        state=[f"bool begun; /* Whether there was a step. */\n    {washout.memory} memory;"],
        types=[type_of(policy.family.kernels.memory)],
        inputs=inputs,
        outputs=(_ACCELERATION,),
        begin=["state->begun = false;"],
        step=[
            "Reading now = {0};",
            *[f"now.{one.place} = {_taken(one)};" for one in inputs],
            *washout.act,
            *_given("acceleration", "answer.action.v", 9),
        ],
        time_step=policy.time_step,
    )


@alone.register
def _(policy: Agent, to: Translator) -> Steps:
    tables, memory = network_code(policy.network, "network")
    size, entries = policy.network.size, policy.network.action_size
    seen = Signal("observation", "observation", size, "float", "1", "the environment's observation")
    done = Signal("action", "action", entries, "float", "1", "within its bound, as the environment takes it")
    return Steps(
        about=f"{policy.name}: the network of an agent, from observation to action",
        input=_fields((seen,)),
        output=_fields((done,)),
        state=[f"float memory[{max(memory, 1)}]; /* Of the network{'' if memory else '; it has none'}. */"],
        types=[],
        inputs=(seen,),
        outputs=(done,),
        begin=_zeroed("state->memory", max(memory, 1)),
        step=[
            *([] if memory else ["(void)state;"]),
            f"network({'state->memory, ' if memory else ''}input->observation, output->action);",
        ],
        time_step=TIME_STEP * policy.task.action.repeat,
        tables=tables,
    )


@dataclass(frozen=True)
class Controller:
    """A policy as a part of the whole step: fields of its state, and C that makes ``vec9 acceleration``.

    Args:
        about: What it is.
        state: Fields of the state, as lines of C.
        types: Types of these fields.
        begin: Statements of the first step, where the first cues are known.
        act: Statements of each step that declare ``acceleration``; ``simulator`` points to the state.
        tables: Tables and functions of C.
        ahead: Samples of preview in the input.
        spacing: Time between them, s.
        time_step: s.
        moved: Statements after the machine has moved, with ``before`` and ``moved``.
    """

    about: str
    state: list[str]
    types: list[Type]
    begin: list[str]
    act: list[str]
    tables: list[str]
    ahead: int = 0
    spacing: float = 0.0
    time_step: float = TIME_STEP
    moved: tuple[str, ...] = ()
    beginning: tuple[str, ...] = ()


@singledispatch
def controller_of(policy: Policy, machine: Platform, to: Translator) -> Controller:
    """A policy as a part of the whole step on a machine."""
    raise _refusal(
        policy, "it is neither a washout nor an agent; the washout of its file or an agent has one"
    )


@controller_of.register(ScheduledWashout)
def _(policy: Policy, machine: Platform, to: Translator) -> Controller:
    raise _refusal(policy, _SCHEDULED)


@controller_of.register(WashoutPolicy)
def _(policy: WashoutPolicy[Any], machine: Platform, to: Translator) -> Controller:
    _bind_machine(machine, to)
    washout = _Washout(policy, to)
    state = Code("state->simulator", type_of(State), variable=True)
    now = to.call(read_state, state)
    return Controller(
        about=f"{policy.name}, {policy.family.title}",
        state=[f"{washout.memory} memory;"],
        types=[type_of(policy.family.kernels.memory)],
        begin=[],
        act=[
            f"const Reading now = {now.text};",
            *washout.act,
            "const vec9 acceleration = answer.action;",
        ],
        tables=[],
    )


class _Washout:
    """Translated functions of a washout: ``act`` declares ``answer`` from a reading ``now``."""

    def __init__(self, policy: WashoutPolicy[Any], to: Translator) -> None:
        kernels = policy.family.kernels
        to.bind("WASHOUT", kernels.values(policy.parameters, policy.cab, policy.time_step))
        parameters = Code("WASHOUT", type_of(kernels.parameters), path="WASHOUT")
        now = Code("now", type_of(Reading), variable=True)
        memory = Code("state->memory", type_of(kernels.memory), variable=True)
        first = to.call(kernels.begin, parameters, now)
        command = to.call(kernels.step, parameters, memory, now, Code("TIME_STEP", REAL))
        to.numbers["TIME_STEP"] = _time_step(to, policy.time_step)
        to.use(command.type.struct, "action", "memory")
        self.memory = type_of(kernels.memory).name
        self.act = [
            "if (!state->begun) {",
            f"    state->memory = {first.text};",
            "    state->begun = true;",
            "}",
            f"const {command.type.name} answer = {command.text};",
            "state->memory = answer.memory;",
        ]


def _time_step(to: Translator, seconds: float) -> str:
    return f"static const real TIME_STEP = {number(seconds, to.single)};"


def _bind_machine(machine: Platform, to: Translator) -> None:
    to.bind("MACHINE", machine_parameters(machine, TIME_STEP))


_MACHINE_CODE: Final = Code("MACHINE", type_of(Machine), path="MACHINE")


def _whole_step(controller: Controller, machine: Platform, to: Translator, start: Any) -> Steps:
    """The whole step, from cues to set-points, around a controller."""
    to.numbers["TIME_STEP"] = _time_step(to, TIME_STEP)
    to.use(Motion)
    to.use(State, "setpoint", "setpoint_acceleration", "limits", "reference_cue")
    setpoint = Code("simulator->setpoint", type_of(Motion), variable=True)
    dt = Code("TIME_STEP", REAL)
    moved = to.call(
        platform.command,
        _MACHINE_CODE,
        setpoint,
        Code("simulator->setpoint_acceleration", type_of(vec9), variable=True),
        Code("simulator->limits", UINT64, variable=True),
        Code("acceleration", type_of(vec9)),
        dt,
    )
    mean = to.call(
        platform.mean_acceleration, setpoint, Code("moved.motion", type_of(Motion), variable=True), dt
    )
    rest = to.call(simulator.rest_motion, _MACHINE_CODE, Code("start", type_of(vec9)))
    inputs, fields = [*_CUES], _fields(_CUES)
    for k in range(controller.ahead):
        when = f"{(k + 1) * controller.spacing:g} s ahead"
        inputs += [
            replace(
                one,
                name=f"{one.name}_ahead_{k + 1}",
                place=f"{one.place}_ahead[{k}]",
                about=f"{one.about}, {when}",
            )
            for one in _CUES
        ]
    if controller.ahead:
        note = f"every {controller.spacing:g} s ahead, nearest first"
        fields += [
            f"real force_ahead[{controller.ahead}][3]; /* m/s^2; {note} */",
            f"real rate_ahead[{controller.ahead}][3]; /* rad/s; likewise */",
        ]
    start = np.asarray(start, dtype=np.float64)
    pose = ", ".join(repr(float(one)) + ("f" if to.single else "") for one in start)
    return Steps(
        about=f"{controller.about} on {machine.name}, from the car's cues to the machine's set-points",
        input=fields,
        output=_fields(_SET_POINTS),
        state=[
            "bool begun; /* Whether there was a step. */",
            "State simulator;",
            *controller.state,
        ],
        types=[type_of(State), *controller.types],
        inputs=tuple(inputs),
        outputs=_SET_POINTS,
        begin=[
            f"const vec9 start = {{{{{pose}}}}};",
            "*state = (NAME_state){0};",
            f"state->simulator.setpoint = {rest.text};",
            *controller.beginning,
        ],
        step=[
            "State *simulator = &state->simulator;",
            "simulator->reference_cue.force = " + _vec3("input->force") + ";",
            "simulator->reference_cue.rate = " + _vec3("input->rate") + ";",
            *controller.act,
            f"const {moved.type.name} moved = {moved.text};",
            f"const vec9 mean = {mean.text};",
            *controller.moved,
            "simulator->setpoint = moved.motion;",
            "simulator->setpoint_acceleration = mean;",
            "simulator->limits = moved.limits;",
            *_set_points(),
        ],
        time_step=TIME_STEP,
        tables=controller.tables,
        ahead=tuple((k + 1) * controller.spacing for k in range(controller.ahead)),
        initial={"position": tuple(start), "legs": tuple(legs_of_pose(machine.hexapod, start[2:8]))},
    )


def _set_points() -> list[str]:
    lines = []
    for name, actuators, hexapod, turning in (
        ("position", "position", "displacement", "beta"),
        ("velocity", "rate", "velocity", "beta_rate"),
    ):
        lines += [
            f"output->{name}[0] = moved.motion.{actuators}.v[0];",
            f"output->{name}[1] = moved.motion.{actuators}.v[1];",
            "for (int32_t i = 0; i < 3; i++) {",
            f"    output->{name}[2 + i] = moved.motion.{hexapod}.v[i];",
            f"    output->{name}[5 + i] = moved.motion.{turning}.v[i];",
            "}",
            f"output->{name}[8] = moved.motion.{actuators}.v[8];",
        ]
    return [
        *lines,
        *_given("acceleration", "mean.v", 9),
        "for (int32_t i = 0; i < 6; i++) {",
        "    output->legs[i] = moved.motion.position.v[2 + i];",
        "    output->leg_rates[i] = moved.motion.rate.v[2 + i];",
        "}",
        "output->limits = moved.limits;",
    ]


def _fields(signals: Any) -> list[str]:
    """Fields of a struct of C for signals."""
    return [
        f"{one.kind} {one.place}{f'[{one.size}]' if one.size > 1 else ''}; /* {one.unit}; {one.about} */"
        for one in signals
    ]


def _taken(one: Signal) -> str:
    if one.size == 1:
        return f"input->{one.place}"
    return f"(vec{one.size}){{{{" + ", ".join(f"input->{place}" for _, place in one.entries()) + "}}"


def _vec3(place: str) -> str:
    return f"(vec3){{{{{place}[0], {place}[1], {place}[2]}}}}"


def _given(name: str, place: str, size: int) -> list[str]:
    return [f"for (int32_t i = 0; i < {size}; i++) {{", f"    output->{name}[i] = {place}[i];", "}"]


def _zeroed(name: str, size: int) -> list[str]:
    return [f"for (int32_t i = 0; i < {size}; i++) {{", f"    {name}[i] = 0.0f;", "}"]


# Agents in the whole step: the environment's observation and action around the network.


@controller_of.register
def _(policy: Agent, machine: Platform, to: Translator) -> Controller:
    _bind_machine(machine, to)
    to.numbers["TIME_STEP"] = _time_step(to, TIME_STEP)
    policy = policy.on(machine)
    _check_task(policy, machine)
    base = _base_of(policy, machine, to)
    own = _Environment(policy, machine, to, "agent", "")
    lines: list[str] = []
    state: list[str] = []
    tables: list[str] = []
    types: list[Type] = []
    for part in (base, own):
        if part is not None:
            state, tables, types = state + part.state, tables + part.tables, types + part.types
            lines = lines + part.act
    parts = [one for one in (base, own) if one is not None]
    ahead = max(one.ahead for one in parts)
    # Both may read the machine's sensors.
    environments = [one for one in parts if isinstance(one, _Environment)]
    sensed = tuple(dict.fromkeys(line for one in environments for line in one.sensed()))
    at_rest = tuple(dict.fromkeys(line for one in environments for line in one.at_rest()))
    added = "base" if base is not None else f"{own.zero}()"
    lines.append(f"const vec9 acceleration = {own.applied(added)};")
    return Controller(
        about=f"{policy.name}, an agent",
        state=["int32_t count; /* Time steps so far. */", *state],
        types=types,
        begin=[],
        act=[*own.drive(), *lines, "state->begun = true;", "state->count++;"],
        tables=tables,
        ahead=ahead,
        spacing=policy.task.observation.preview_spacing,
        moved=sensed,
        beginning=at_rest,
    )


def _check_task(policy: Agent, machine: Platform) -> None:
    seen = policy.task.observation
    if seen.simulator_cue == "machine" and machine_parameters(machine, TIME_STEP).has_dynamics:
        why = "it sees the true motion, which lags behind the set-points on this machine; export it by itself"
        raise _refusal(policy, why)
    if policy.task.action.mode == "gains":
        raise _refusal(policy, "its actions are a washout's gains; export it by itself")
    for option in ("perceived", "true_motion", "against_base", "controls", "road"):
        if getattr(seen, option):
            raise _refusal(policy, f"its observation.{option} is not made in C; export it by itself")


@dataclass
class _Part:
    """A policy under or above another in the whole step."""

    state: list[str]
    tables: list[str]
    types: list[Type]
    act: list[str]
    ahead: int = 0


def _base_of(policy: Agent, machine: Platform, to: Translator) -> Any:
    """The base policy: C that declares ``vec9 base``."""
    under = policy.base_policy
    if under is None:
        return None
    return _under(under, machine, to)


@singledispatch
def _under(policy: Policy, machine: Platform, to: Translator) -> Any:
    raise _refusal(policy, "an agent's base in C is a washout or an agent")


@_under.register(WashoutPolicy)
def _(policy: WashoutPolicy[Any], machine: Platform, to: Translator) -> Any:
    washout = controller_of(policy, machine, to)
    lines = [one for one in washout.act if "acceleration" not in one and "begun = true" not in one]
    return _Part(washout.state, [], washout.types, [*lines, "const vec9 base = answer.action;"])


@_under.register
def _(policy: Agent, machine: Platform, to: Translator) -> Any:
    part = _Environment(policy, machine, to, "base", "base_")
    part.act = [*part.act, "const vec9 base = state->base_acceleration;"]
    return part


class _Environment:
    """The environment of one agent in C: observation, network, action.

    Args:
        policy: The agent.
        machine: Its machine.
        to: Takes the functions.
        role: "agent" or "base", for names of tables.
        prefix: Before the fields of the state.
    """

    def __init__(self, policy: Agent, machine: Platform, to: Translator, role: str, prefix: str) -> None:
        self._policy, self._to, self._prefix, self._role = policy, to, prefix, role
        task = policy.task
        self._seen = seen = task.observation
        self._repeat = task.action.repeat
        self.ahead = seen.preview
        layout = policy.layout
        rules = rules_of(task, layout, [machine], TIME_STEP, "cpu")
        # The preview comes sample by sample in the input.
        rules.view.preview_stride = 1
        rules.view.force_noise = rules.view.rate_noise = 0.0
        self._view, self._action = f"{role.upper()}_VIEW", f"{role.upper()}_ACTION"
        to.bind(self._view, rules.view)
        to.bind(self._action, rules.action)
        episode: Any = task_observation.Episode()
        episode.force_gain = episode.rate_gain = 1.0
        to.bind("EPISODE", episode)
        self.network, self._memory = network_code(policy.network, f"{role}_network")
        bounds = np.stack([layout.bounds, layout.gains], axis=1)
        self._bounds = f"{role.upper()}_BOUNDS"
        entries = ", ".join(
            "{" + array_text("", pair, "float", True).split("= ", 1)[1].rstrip(";") + "}" for pair in bounds
        )
        for kind in (float_rows, pair_array, real_rows):
            to.helpers.use(type_of(kind))
        to.helpers.use(type_of(pair_array.dtype))
        self.tables = [f"static const vec2f {self._bounds}[{layout.size}] = {{{entries}}};", *self.network]
        self.types = [type_of(vec9)]
        size, count, lows = layout.size, policy.action_size, 6 * len(seen.memory)
        self._size, self._count, self._lows = size, count, lows
        self.state = [
            f"float {prefix}observation[{size}];",
            f"float {prefix}action[{count}]; /* Its last action, clipped. */",
            f"float {prefix}action_before[{count}]; /* The one before. */",
            f"vec9 {prefix}own; /* Accelerations of its action. */",
        ]
        if role == "base":
            self.state.append("vec9 base_acceleration; /* Of the machine's axes. */")
        if lows:
            self.state.append(f"real {prefix}past[{lows}]; /* Low-passed cues. */")
        if self._memory:
            self.state.append(f"float {prefix}memory[{self._memory}]; /* Of its network. */")
        self.zero = to.helpers.need("zero", type_of(vec9))
        self.act = self._act()

    def drive(self) -> list[str]:
        """The drive as kernels see it: the cues now, then those ahead."""
        to = self._to
        to.use(simulator.Drives, "force", "rate", "first", "length")
        ahead = self.ahead
        lines = [
            "static const int32_t first[1] = {0};",
            f"static const int32_t length[1] = {{{ahead + 1}}};",
            f"vec3 force[{ahead + 1}];",
            f"vec3 rate[{ahead + 1}];",
            "force[0] = simulator->reference_cue.force;",
            "rate[0] = simulator->reference_cue.rate;",
        ]
        if ahead:
            lines += [
                f"for (int32_t k = 0; k < {ahead}; k++) {{",
                f"    force[k + 1] = {_vec3('input->force_ahead[k]')};",
                f"    rate[k + 1] = {_vec3('input->rate_ahead[k]')};",
                "}",
            ]
        names = to.fields(simulator.Drives)
        values = ", ".join(f".{name} = {name}" for name in names)
        return [*lines, f"const Drives drives = {{{values}}};", "(void)drives;"]

    def sensed(self) -> list[str]:
        """What the machine's sensors give after a step."""
        if self._seen.simulator_cue == "model":
            return []
        to = self._to
        to.use(State, "simulator_cue", "acceleration")
        cues = to.call(
            simulator.simulator_cues, _MACHINE_CODE, Code("moved.motion", type_of(Motion), variable=True),
            Code("mean", type_of(vec9)),
        )  # fmt: skip
        return ["simulator->acceleration = mean;", f"simulator->simulator_cue = {cues.text};"]

    def at_rest(self) -> tuple[str, ...]:
        """What the machine's sensors give before the first step."""
        if self._seen.simulator_cue == "model":
            return ()
        setpoint = Code("state->simulator.setpoint", type_of(Motion), variable=True)
        zero = Code(f"{self.zero}()", type_of(vec9))
        cues = self._to.call(simulator.simulator_cues, _MACHINE_CODE, setpoint, zero)
        return (f"state->simulator.simulator_cue = {cues.text};",)

    def applied(self, base: str) -> str:
        """C of the accelerations of the axes, with those of a base policy."""
        to, prefix = self._to, self._prefix
        setpoint = Code("simulator->setpoint", type_of(Motion), variable=True)
        own = Code(f"state->{prefix}own", type_of(vec9), variable=True)
        scale = Code(self._action, type_of(task_action.ActionScale), path=self._action)
        return to.call(
            task_action.applied_accelerations, scale, setpoint, own, Code(base, type_of(vec9))
        ).text

    def _act(self) -> list[str]:
        """Statements that renew the agent's own accelerations."""
        to, p, role = self._to, self._prefix, self._role
        state = Code("state->simulator", type_of(State), variable=True)
        setpoint = Code("simulator->setpoint", type_of(Motion), variable=True)
        dt, zero = Code("TIME_STEP", REAL), Code("0", INT)
        rows = {
            name: Code(f"{role}_{name}", type_of(kind))
            for name, kind in (("fixed", real_rows), ("now", float_rows), ("before", float_rows),
                               ("memory", float_rows), ("seen", float_rows), ("wish", float_rows))
        }  # fmt: skip
        base = (
            Code("base", type_of(vec9))
            if role == "agent" and self._policy.base is not None
            else Code(f"{self.zero}()", type_of(vec9))
        )
        drives = Code("drives", type_of(simulator.Drives), variable=True)
        view = Code(self._view, type_of(task_observation.View), path=self._view)
        scale = Code(self._action, type_of(task_action.ActionScale), path=self._action)
        # Controls and road are refused, so that the array after the memory is never read.
        written = to.call(
            task_observation.write_frame, view, drives, zero,
            Code("EPISODE", type_of(task_observation.Episode), path="EPISODE"), zero, _MACHINE_CODE, state,
            rows["fixed"], rows["now"], Code(f"state->{p}own", type_of(vec9)), base, rows["memory"],
            rows["memory"],
            Code(self._bounds, type_of(pair_array)), rows["seen"], zero,
        )  # fmt: skip
        to.use(State, "setpoint_acceleration")
        bound = float(np.float32(self._policy.task.action.bound))
        taken = to.call(
            task_action.take_action,
            rows["wish"],
            rows["now"],
            rows["before"],
            Code(f"{bound!r}f", FLOAT),
            zero,
        )
        own = to.call(
            task_action.own_accelerations, scale, zero, setpoint, rows["now"], rows["before"], zero,
            Code(f"{role}_share", REAL), Code(f"state->{p}own", type_of(vec9)), dt,
        )  # fmt: skip
        frame, stack = self._policy.layout.frame, self._policy.layout.stack
        lines = [
            *self._low_passes(),
            f"real {role}_fixed_data[{OBSERVATION_SIZE}] = {{{'0.0f' if to.single else '0.0'}}};",
            f"float {role}_wish_data[{self._count}];",
            self._rows(f"{role}_fixed", "real_rows", f"{role}_fixed_data", OBSERVATION_SIZE),
            self._rows(f"{role}_now", "float_rows", f"state->{p}action", self._count),
            self._rows(f"{role}_before", "float_rows", f"state->{p}action_before", self._count),
            self._rows(f"{role}_wish", "float_rows", f"{role}_wish_data", self._count),
            self._rows(f"{role}_seen", "float_rows", f"state->{p}observation", self._size),
        ]
        inner = []
        if stack > 1:
            shifted = to.call(task_observation.shift_frames, rows["seen"], zero, Code(str(frame), INT))
            repeated = to.call(task_observation.repeat_frame, rows["seen"], zero, Code(str(frame), INT))
            inner.append(f"{shifted.text};")
        inner.append(f"(void){written.text};" if written.type.kind != "void" else f"{written.text};")
        if stack > 1:
            inner += ["if (!state->begun) {", f"    {repeated.text};", "}"]
        memory = f"state->{p}memory, " if self._memory else ""
        inner += [
            f"{role}_network({memory}state->{p}observation, {role}_wish_data);",
            f"(void){taken.text};",
        ]
        passed = "1" if role == "base" else f"state->count % {self._repeat} + 1"
        share = f"(real)({passed}) / (real){self._repeat}"
        if f"{role}_share" in own.text:
            lines.append(f"const real {role}_share = {share};")
        lines += [
            f"if (state->count % {self._repeat} == 0) {{",
            *[f"    {one}" for one in inner],
        ]
        if role == "base":
            # Its accelerations are held as long as its action, in the machine's frame.
            held = f"    state->base_acceleration = {self.applied(f'{self.zero}()')};"
            return [*lines, f"    state->{p}own = {own.text};", held, "}"]
        return [*lines, "}", f"state->{p}own = {own.text};"]

    def _low_passes(self) -> list[str]:
        """Low-passed cues, exact for inputs that are held."""
        if not self._lows:
            return []
        role, p, to = self._role, self._prefix, self._to
        poles = [number(np.exp(-TIME_STEP / one), to.single) for one in self._seen.memory]
        one, gravity = number(1.0, to.single), number(GRAVITY, to.single)
        scale = number(SCALES["reference_force"], to.single)
        return [
            f"static const real {role}_poles[{len(poles)}] = {{{', '.join(poles)}}};",
            f"float {role}_memory_data[{self._lows}];",
            f"const real {role}_cues[6] = {{",
            f"    input->force[0] / {scale}, input->force[1] / {scale},",
            f"    (input->force[2] + {gravity}) / {scale},",
            "    input->rate[0], input->rate[1], input->rate[2],",
            "};",
            f"for (int32_t k = 0; k < {self._lows}; k++) {{",
            f"    const real pole = {role}_poles[k / 6];",
            f"    const real before = state->begun ? state->{p}past[k] : {role}_cues[k % 6];",
            f"    state->{p}past[k] = pole * before + ({one} - pole) * {role}_cues[k % 6];",
            f"    {role}_memory_data[k] = (float)state->{p}past[k];",
            "}",
            self._rows(f"{role}_memory", "float_rows", f"{role}_memory_data", self._lows),
        ]

    @staticmethod
    def _rows(name: str, kind: str, data: str, size: int) -> str:
        return f"const {kind} {name} = {{{data}, {{1, {size}}}}};"
