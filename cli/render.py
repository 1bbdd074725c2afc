"""``motion-cueing render``: a film or a picture of a machine in a drive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from ..envs.errors import ConfigurationError
from ..envs.progress import progress
from ..envs.storage import check_file
from . import arguments
from .arguments import CarName, ManeuverName, PlatformName, PolicyName, option

if TYPE_CHECKING:
    from ..envs.rendering import Renderer
    from ..evaluation.reporting.film import Picture
    from ..evaluation.trajectory import Trajectory

_FILM_SIZE: Final = (1280, 720)
_GIF_SIZE: Final = (800, 450)
_GIF_RATE: Final = 12.5
"""GIFs are for pages, where a few MiB are much."""


@dataclass(frozen=True, kw_only=True)
class RenderCommand:
    """Draw a drive: the moving machine beside the reference cues and the simulator's cues."""

    out: Annotated[Path, option("FILE.gif|.mp4|.png")]
    """File to write; a png shows one moment."""
    maneuver: ManeuverName = "double-lane-change"
    policy: PolicyName = "classical"
    platform: PlatformName = "paper"
    car: CarName = "sedan"
    begin: float | None = None
    """Time of the first frame, s; of a png the moment shown, default: the middle of the drive."""
    end: float | None = None
    """Time of the last frame, s; default: the end of the drive."""
    size: Annotated[tuple[int, int] | None, option("WIDTH HEIGHT")] = None
    """Width and height, pixels; default 1280 720, of a gif 800 450."""
    rate: float | None = None
    """Frames a second; default 30, of a gif 12.5, whose frames last whole hundredths of a second."""


def run(command: RenderCommand) -> int:
    """Drive, draw and write."""
    from ..envs.rendering import FRAMES_PER_SECOND, Renderer
    from ..evaluation.reporting.film import check_suffix, film_frames, gif_rate, save_film

    suffix = check_suffix(command.out)
    if suffix == ".png" and (command.end is not None or command.rate is not None):
        raise ConfigurationError("a png shows one moment, --begin; leave --end and --rate out")
    check_file("--out", command.out)
    size = command.size or (_GIF_SIZE if suffix == ".gif" else _FILM_SIZE)
    # Made before anything is driven, so that a wrong size or a missing package is reported at once.
    renderer = Renderer(arguments.find_platform(command.platform), size)
    trajectory = drive(command)
    if suffix == ".png":
        moment = 0.5 * float(trajectory.time[-1]) if command.begin is None else command.begin
        save_film(command.out, film_frames(trajectory, renderer, 1.0, moment, moment), 1.0)
    else:
        rate = gif_rate(command.rate or _GIF_RATE) if suffix == ".gif" else command.rate or FRAMES_PER_SECOND
        save_film(command.out, _watched(command, trajectory, renderer, rate), rate)
    print(f"{command.out}: {command.policy} in {command.maneuver}, {size[0]} x {size[1]} pixels")
    return 0


def drive(command: RenderCommand) -> Trajectory:
    """The drive a command asks for."""
    from ..evaluation.rollout import rollout

    platform, car = arguments.find_platform(command.platform), arguments.find_car(command.car)
    label, source = arguments.find_maneuver(command.maneuver, car)
    ((name, policy),) = arguments.find_policies((command.policy,), platform).items()
    trajectory = rollout(arguments.make_policy(policy, platform), source(), platform=platform, car=car)
    return replace(trajectory, maneuver=label, policy=name)


def _watched(
    command: RenderCommand, trajectory: Trajectory, renderer: Renderer, rate: float
) -> Iterator[Picture]:
    """The frames, with a bar on the terminal's error stream."""
    from ..evaluation.reporting.film import film_frames, frame_rows

    begin = command.begin or 0.0
    total = len(frame_rows(trajectory, rate, begin, command.end))
    with progress(total, "frames", "drawing") as bar:
        for frame in film_frames(trajectory, renderer, rate, begin, command.end):
            yield frame
            bar.move(advance=1)
