"""``motion-cueing export``: an agent as an ONNX file, or a policy as C99 or an FMU."""

from __future__ import annotations

import shlex
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file, check_folder
from .arguments import ManeuverName, PlatformName, find_car, find_maneuver, find_platform, named, option

if TYPE_CHECKING:
    from ..envs.platform import Platform
    from ..realtime.export import Source
    from ..train.agents import Agent


@dataclass(frozen=True, kw_only=True)
class ExportCommand:
    """Write a policy for another program, check it against Python, and time it.

    `--out` writes the network of an agent as ONNX. `--c` writes an agent or a washout as C99 that allocates
    nothing and needs no library, `--fmu` as an FMU for co-simulation. They equal `predict`; with
    `--set-points` they equal the simulator's step, from the car's cues to the machine's set-points.
    """

    policy: Annotated[str, option("NAME|FILE", completer=named("Policies"))] = field(kw_only=False)
    """Agent or washout, by name or file."""
    out: Annotated[Path | None, option("FILE.onnx")] = None
    """ONNX file to write, of an agent."""
    c: Annotated[Path | None, option("DIR")] = None
    """Folder for header and code in C99."""
    fmu: Annotated[Path | None, option("FILE.fmu")] = None
    """FMU to write, with its sources and the binary of this machine; needs a C compiler."""
    fmi: Annotated[int, option("2|3")] = 2
    """Version of the FMI standard that the FMU follows."""
    set_points: Annotated[bool, Parameter(help="The whole step, from cues to limited set-points.")] = False
    platform: PlatformName = "paper"
    single: Annotated[bool, Parameter(help="Single precision, for processors without double.")] = False
    name: Annotated[str | None, option("NAME")] = None
    """Name of the files and before every name in the header; default: the policy's."""
    maneuver: ManeuverName = "slalom"


def run(command: ExportCommand) -> int:
    """Export, and print accuracy, size and speed."""
    if command.out is None and command.c is None and command.fmu is None:
        raise ConfigurationError("nothing to write: name --out FILE.onnx, --c DIR or --fmu FILE.fmu")
    if command.out is not None:
        _export_onnx(command, command.out)
    if command.c is not None or command.fmu is not None:
        _export_c(command)
    return 0


def _export_onnx(command: ExportCommand, out: Path) -> None:
    if out.suffix != ".onnx":
        raise ConfigurationError(f"--out {out}: name a file that ends in .onnx")
    check_file("--out", out)
    agent = _agent(command.policy)
    from ..train.agents.export import CHECKED, export_onnx

    exported = export_onnx(agent, out)
    network = agent.network
    print(f"{out}: {agent.name}, {exported.size / 1024:.0f} KiB")
    print(f"observation (n, {network.size}) float32, action (n, {network.action_size}) in [-1, 1]")
    print(
        f"largest difference over {CHECKED:,} observations: {exported.torch_difference:.1e} from PyTorch, "
        f"{exported.numpy_difference:.1e} from NumPy"
    )
    print(
        f"one observation, one thread: mean {1e6 * exported.mean:.1f} us, p99 {1e6 * exported.p99:.1f} us, "
        f"max {1e6 * exported.longest:.1f} us"
    )


def _export_c(command: ExportCommand) -> None:
    if command.c is not None:
        check_folder("--c", command.c)
    if command.fmu is not None:
        if command.fmu.suffix != ".fmu":
            raise ConfigurationError(f"--fmu {command.fmu}: name a file that ends in .fmu")
        if command.fmi not in (2, 3):
            raise ConfigurationError(f"--fmi must be 2 or 3, found {command.fmi}")
        check_file("--fmu", command.fmu)
    from ..evaluation.policies import make_policy
    from ..realtime.export import make_source, write_files

    platform = find_platform(command.platform)
    policy = make_policy(command.policy, platform)
    source = make_source(
        policy,
        platform if command.set_points else None,
        name=command.name or Path(command.policy).stem,
        single=command.single,
        command=shlex.join(["motion-cueing", *sys.argv[1:]]),
    )
    if command.c is not None:
        command.c.mkdir(parents=True, exist_ok=True)
        for path in write_files(source, command.c):
            print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")
    print(f"{source.about}; a step every {1e3 * source.time_step:g} ms")
    if command.fmu is not None:
        from ..realtime.export.fmu import write_fmu

        write_fmu(source, command.fmu, command.fmi)
        print(f"{command.fmu}: FMI {command.fmi}.0, {command.fmu.stat().st_size / 1024:.0f} KiB")
    _check(source, policy, platform, command.maneuver)


def _check(source: Source, policy: Any, platform: Platform, maneuver: str) -> None:
    """Hold an export against Python in a drive, where there is a compiler."""
    from ..realtime.export.check import TOLERANCE, CompilerError, compare, compile_shared, compiler

    try:
        compiler()
    except CompilerError as error:
        print(f"not checked: {error}")
        return
    drive = find_maneuver(maneuver, find_car("sedan"))[1]()
    with tempfile.TemporaryDirectory() as folder:
        found = compare(compile_shared(source, Path(folder)), policy, platform, drive.resampled(0.01))
    print(f"largest difference from Python in {drive.name}: {found.difference:.1e}")
    p50, p99 = (1e6 * value for value in _percentiles(found.seconds))
    print(
        f"one step, one thread: median {p50:.2f} us, p99 {p99:.2f} us, max {1e6 * found.seconds.max():.1f} us"
    )
    bound = TOLERANCE[source.single]
    if not found.difference <= bound:
        raise ConfigurationError(
            f"the export differs from Python by {found.difference:.1e}, at most {bound:.0e} is allowed; "
            "do not use it, and report the command"
        )


def _percentiles(seconds: Any) -> Any:
    import numpy as np

    return np.percentile(seconds, [50.0, 99.0])


def _agent(name: str) -> Agent:
    """The agent of a name or file."""
    from ..evaluation.policies import find_agent, is_agent, policy_names
    from ..train.agents import agent_names

    if not is_agent(name) and (name in policy_names() or Path(name).suffix in (".yaml", ".yml")):
        raise ConfigurationError(
            f"--policy {name} is no trained network, but a washout or a predictive controller; "
            f"what can be exported as ONNX: {', '.join(agent_names())}, or the .safetensors file of an "
            "agent; --c and --fmu export washouts, too"
        )
    return find_agent(name)
