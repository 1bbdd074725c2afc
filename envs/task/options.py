"""Options of the environment, as frozen dataclasses that load from YAML; whole tasks by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, Field

from ..cues import CueScale
from ..errors import ConfigurationError, suggest
from ..maneuvers import RandomDrives, maneuver_names, recording_names
from ..maneuvers.sampling import NamedDrives
from ..perception.models import vestibular_model_names
from ..platform.machines import Platform
from ..platform.presets import ablation_names, load_platform, platform_names
from ..platform.randomization import PlatformRanges
from ..settings import (
    NonNegative,
    Positive,
    check_names,
    check_range,
    configuration,
    from_dict,
    merge,
    preset_names,
    read_yaml,
    renamed,
    to_dict,
)
from .kernels.action import ActionOptions
from .kernels.observation import ObservationOptions
from .kernels.reward import RewardOptions
from .knowledge import MapErrors
from .sensors import CarSensors

Count = Annotated[int, Field(ge=0)]
PositiveCount = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(ge=0.0, lt=1.0)]


def _scale_of(scale: object) -> object:
    """A motion scale given as a number or as text."""
    return CueScale.parse(str(scale)) if isinstance(scale, str | int | float) else scale


@configuration
class EpisodeOptions:
    """What is driven, from where to where.

    Args:
        drives: Maneuvers and recordings by name, one drawn for each episode; none for random drives.
        random: The random drives, and the cars that drive them and the maneuvers; fields, the name of a
            distribution, such as ``broad``, or its YAML file.
        library: Random drives to draw from. They are made when the environment is.
        library_seed: Of the random drives, and of the machines and cars of the randomization.
        drive_duration: Of a random drive, s.
        duration: Longest episode, s; None for the whole drive.
        random_start: Whether an episode begins anywhere in its drive that leaves ``duration`` to go.
        platform_offset: The machine begins anywhere within this share of its travel.
        terminate_on_failure: Whether an end of travel or a nearly singular pose ends an episode.
        scale: Motion scale of the reference, as a policy sees it and as it is rewarded.
    """

    drives: tuple[str, ...] = ()
    random: NamedDrives = RandomDrives()
    library: PositiveCount = 16
    library_seed: Count = 0
    drive_duration: Positive = 60.0
    duration: Positive | None = None
    random_start: bool = False
    platform_offset: Share = 0.0
    terminate_on_failure: bool = False
    scale: Annotated[CueScale, BeforeValidator(_scale_of)] = CueScale()

    def __post_init__(self) -> None:
        check_names("drive", self.drives, [*maneuver_names(None), *recording_names()])
        if self.random_start and self.duration is None:
            raise ValueError("random_start needs a duration, shorter than the drives")


@configuration
class RandomizationOptions:
    """What differs from episode to episode; nothing by default. Cars are ``episode.random.cars``.

    Args:
        friction: Range of a factor on the tires' friction, drawn for each drive of the library.
        natural_frequency: Range of the actuators' lag, rad/s; None leaves the platform's own.
        dead_time: Range of the actuators' dead time, s; None leaves the platform's own.
        platform: How the platforms themselves differ; None leaves the given one as it is.
        platforms: Platforms to draw from, if they, their lag or their dead time are drawn.
        actuator_gain: Largest relative error of the acceleration of each axis.
        sensor_gain: Largest relative error of the cab's accelerometers and gyroscopes.
        force_noise: Standard deviation of the noise of the cab's accelerometers, m/s^2.
        rate_noise: Standard deviation of the noise of its gyroscopes, rad/s.
        car_sensors: Errors of the car's cues as they are seen; the reward knows the true ones.
        road: Errors of what is known of the road ahead.
    """

    friction: tuple[Positive, Positive] = (1.0, 1.0)
    natural_frequency: tuple[Positive, Positive] | None = None
    dead_time: tuple[NonNegative, NonNegative] | None = None
    platform: Annotated[PlatformRanges | None, renamed("platform", "build")] = None
    platforms: Annotated[PositiveCount, renamed("platforms", "machines")] = 16
    actuator_gain: Share = 0.0
    sensor_gain: Share = 0.0
    force_noise: NonNegative = 0.0
    rate_noise: NonNegative = 0.0
    car_sensors: CarSensors = CarSensors()
    road: MapErrors = MapErrors()

    def __post_init__(self) -> None:
        for name in ("friction", "natural_frequency", "dead_time"):
            if getattr(self, name) is not None:
                check_range(name, getattr(self, name))


def _from_file(platform: object) -> object:
    """A platform given as the name of a YAML file, so that what is saved needs the file no more."""
    if isinstance(platform, str) and platform.endswith((".yaml", ".yml")):
        return load_platform(platform)
    return platform


@configuration
class TaskOptions:
    """The whole environment.

    Args:
        platform: The motion base, its name, or the name of a YAML file with its fields.
        vestibular: Perception model by name.
        observation: What is seen.
        action: What can be done.
        reward: What is good.
        episode: What is driven.
        randomization: What differs from episode to episode.
    """

    platform: Annotated[Platform | str, BeforeValidator(_from_file)] = "paper"
    vestibular: str = "zacharias"
    observation: ObservationOptions = ObservationOptions()
    action: ActionOptions = ActionOptions()
    reward: RewardOptions = RewardOptions()
    episode: EpisodeOptions = EpisodeOptions()
    randomization: Annotated[RandomizationOptions, renamed("randomization", "randomisation")] = (
        RandomizationOptions()
    )

    def __post_init__(self) -> None:
        if isinstance(self.platform, str):
            check_names("platform", [self.platform], [*platform_names(), *ablation_names()])
        check_names("vestibular model", [self.vestibular], vestibular_model_names())


_PRESETS: Final = Path(__file__).parent / "presets"


def task_names() -> list[str]:
    """Names of the tasks that come with the package."""
    return preset_names(_PRESETS)


def load_task(task: TaskOptions | str | Path | None = None, **fields: Any) -> TaskOptions:
    """A whole task, with some fields replaced.

    Args:
        task: The task, its name, or its YAML file; None for all defaults. A file may name under ``preset``
            the task it begins with.
        **fields: Fields of :class:`TaskOptions` to replace; in a mapping, the fields it names alone.

    Raises:
        DataError: the file cannot be read or is not YAML.
        ConfigurationError: no task has this name, a field is unknown, of the wrong type or out of range.
    """
    source = "environment options" if task is None or isinstance(task, TaskOptions) else str(task)
    start = from_dict(TaskOptions, {} if task is None else task_values(task), source)
    if not fields:
        return start
    return from_dict(TaskOptions, merged_task(start, fields), source)


def merged_task(start: TaskOptions, fields: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a task with some replaced; in a mapping, the fields it names alone."""
    merged: dict[str, Any] = {field.name: getattr(start, field.name) for field in dataclasses.fields(start)}
    for name, value in fields.items():
        if isinstance(value, Mapping) and dataclasses.is_dataclass(merged.get(name)):
            value = merge(to_dict(merged[name]), value)
        merged[name] = value
    return merged


def _values_of(task: str | Path) -> object:
    if Path(task).suffix in (".yaml", ".yml"):
        return read_yaml(task)
    if str(task) not in task_names():
        raise ConfigurationError(f"unknown task {str(task)!r}. {suggest(str(task), task_names())}")
    return read_yaml(_PRESETS / f"{task}.yaml")


def task_values(values: object) -> Any:
    """A task or plain values of one, for its name or file; values may name a ``preset`` that they change."""
    if isinstance(values, str | Path):
        values = _values_of(values)
    if isinstance(values, Mapping) and "preset" in values:
        rest = {name: value for name, value in values.items() if name != "preset"}
        # None for all defaults, where another file named a preset before.
        return rest if values["preset"] is None else load_task(str(values["preset"]), **rest)
    return values
