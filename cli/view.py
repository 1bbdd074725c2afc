"""``motion-cueing view``: a machine in a drive, in three dimensions, in a browser."""

from __future__ import annotations

import sys
import webbrowser
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from ..envs.errors import ConfigurationError, DataError
from ..envs.storage import check_file
from . import arguments
from .arguments import CarName, Whole, option, several

if TYPE_CHECKING:
    from ..envs.cues import CueTrace
    from ..envs.platform import Platform
    from ..evaluation.reporting.packing import PackedDrive
    from ..evaluation.reporting.view.server import PageServer
    from ..evaluation.trajectory import Trajectory

_MANEUVER: Final = "double-lane-change"
_PLATFORM: Final = "paper"
AGENT: Final = "best.safetensors"
"""Of a training, in its folder."""


@dataclass(frozen=True, kw_only=True)
class ViewCommand:
    """Show drives in a browser: the machine in three dimensions, the car on its road, and the cues.

    Without --out it serves the page on this machine until Ctrl-C. Give policies to drive a maneuver with, or
    trajectories that were driven already, or the folder of an evaluation, a benchmark or a training.
    """

    runs: Annotated[tuple[str, ...], several("POLICY|FILE.npz|FOLDER ...")] = field(
        default=("classical-tuned",), kw_only=False
    )
    """Policies, trajectories, or folders of results; two are shown beside each other."""
    maneuver: Annotated[str | None, option("NAME|FILE")] = None
    """Maneuver or recording, by name or cue CSV file; of trajectories: the one to show, default: all; of
    policies: default double-lane-change."""
    platform: Annotated[str | None, option("NAME|FILE")] = None
    """Motion base, by name or YAML file; default: that of the trajectories, of policies: paper."""
    car: CarName = "sedan"
    out: Annotated[Path | None, option("FILE.html")] = None
    """File to write instead of serving: it needs no network, and nothing beside it."""
    port: Whole = 0
    """Port on this machine to serve the page at; 0 for any that is free."""
    browser: bool = False
    """Open the page in the browser of the system as well."""


def run(command: ViewCommand) -> int:
    """Drive or read, and write the page or serve it."""
    from ..evaluation.reporting.view import render_view, save_view
    from ..evaluation.reporting.view.server import PageServer, Routes

    if command.out is not None:
        if command.out.suffix != ".html":
            raise ConfigurationError(f"--out {command.out}: name a file that ends in .html")
        check_file("--out", command.out)
    platform, drives = pack_drives(command)
    if command.out is not None:
        save_view(drives, platform, command.out)
        print(f"{command.out}: {', '.join(drives)} on {platform.name}")
        return 0
    page = render_view(drives, platform)
    return serve(PageServer(Routes(lambda: page), command.port), command.browser)


def serve(server: PageServer, browser: bool) -> int:
    """Serve a page until Ctrl-C."""
    print(f"{server.url}  (Ctrl-C ends)", flush=True)
    if browser:
        webbrowser.open(server.url)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        print("", file=sys.stderr)
    finally:
        server.server_close()
    return 0


def pack_drives(command: ViewCommand) -> tuple[Platform, dict[str, PackedDrive]]:
    """The machine, and the drives of each maneuver, packed.

    Raises:
        DataError: a folder has nothing to show, or no trajectory is of the maneuver.
        ConfigurationError: the trajectories are of several machines.
    """
    from ..evaluation.reporting.view import pack_view

    policies, files = _sorted(command.runs)
    drives = _recorded(files, command.maneuver)
    machines = sorted({one.platform for group in drives.values() for one in group.values()})
    if len(machines) > 1:
        raise ConfigurationError(f"the trajectories are of {', '.join(machines)}; view those of one machine")
    platform = arguments.find_platform(command.platform or (machines or [_PLATFORM])[0])
    if machines and platform.name != machines[0]:
        raise ConfigurationError(
            f"the trajectories are of the motion base {machines[0]!r}, not {platform.name!r}; leave "
            "--platform out, or name the file of that machine"
        )
    names = [command.maneuver or _MANEUVER] if policies and not drives else list(drives)
    packed: dict[str, PackedDrive] = {}
    for name in names:
        cues = _cues(name, command.car, needed=bool(policies))
        label = cues.name if cues is not None and name not in drives else name
        shown = {**drives.get(name, {}), **(_driven(policies, platform, command.car, cues) if cues else {})}
        packed[label] = pack_view(
            {policy: replace(one, maneuver=label) for policy, one in shown.items()}, cues
        )
    return platform, packed


def _sorted(runs: tuple[str, ...]) -> tuple[list[str], list[Path]]:
    """Policies, and files of trajectories."""
    policies: list[str] = []
    files: list[Path] = []
    for run in runs:
        path = Path(run)
        if path.suffix == ".npz":
            files.append(path)
        elif path.is_dir():
            found = sorted((path / "trajectories").glob("*.npz")) or sorted(path.glob("*.npz"))
            if found:
                files += found
            elif (path / AGENT).is_file():
                policies.append(str(path / AGENT))
            else:
                raise DataError(f"{run}: no trajectories and no {AGENT} there; name a folder of results")
        else:
            policies.append(run)
    return policies, files


def _recorded(files: list[Path], maneuver: str | None) -> dict[str, dict[str, Trajectory]]:
    """Saved trajectories by maneuver and policy."""
    from ..evaluation.suite import labels
    from ..evaluation.trajectory import Trajectory

    drives: dict[str, dict[str, Trajectory]] = {}
    for file in files:
        drive = Trajectory.load(file)
        if maneuver in (None, drive.maneuver):
            others = drives.setdefault(drive.maneuver, {})
            name = [*labels([*others, str(file)], [*others, drive.policy]).values()][-1]
            others[name] = drive
    if files and not drives:
        raise DataError(f"no trajectory of {maneuver!r} among the {len(files)} files")
    return drives


def _cues(name: str, car: str, needed: bool) -> CueTrace | None:
    """The cues of a maneuver; None where they are of no need and the name is not known."""
    from ..envs.errors import MotionCueingError

    try:
        label, source = arguments.find_maneuver(name, arguments.find_car(car))
        return replace(source(), name=label)
    except MotionCueingError:
        if needed:
            raise
        return None


def _driven(policies: list[str], platform: Platform, car: str, cues: CueTrace) -> dict[str, Trajectory]:
    from ..evaluation.rollout import rollout

    return {
        label: replace(
            rollout(
                arguments.make_policy(name, platform), cues, platform=platform, car=arguments.find_car(car)
            ),
            policy=label,
        )
        for label, name in (arguments.find_policies(policies, platform) if policies else {}).items()
    }
