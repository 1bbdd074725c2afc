"""``motion-cueing export``: an agent as an ONNX file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from ..train.agents import find_agent


@dataclass(frozen=True)
class ExportCommand:
    """Write an agent's network with its normalization as ONNX, check it, and time it.

    `motion-cueing list` shows the names of the agents that come with the package.
    """

    policy: Annotated[str, arg(metavar="NAME|FILE.safetensors")]
    """Agent, by name or file."""
    onnx: Annotated[Path, arg(metavar="FILE.onnx")]
    """File to write."""


def run(command: ExportCommand) -> int:
    """Export, and print what was found.

    Raises:
        MotionCueingError: an argument is wrong, a package is missing, or the network computes something else.
    """
    if command.onnx.suffix != ".onnx":
        raise ConfigurationError(f"--onnx {command.onnx}: name a file that ends in .onnx")
    check_file("--onnx", command.onnx)
    agent = find_agent(command.policy)
    from ..train.agents.export import CHECKED, export_onnx

    found = export_onnx(agent, command.onnx)
    network = agent.network
    print(f"{command.onnx}: {agent.name}, {found.size / 1024:.0f} KiB")
    print(f"observation (n, {network.size}) float32, action (n, {network.action_size}) in [-1, 1]")
    print(
        f"largest difference over {CHECKED:,} observations: {found.torch_difference:.1e} from PyTorch, "
        f"{found.numpy_difference:.1e} from NumPy"
    )
    print(
        f"one observation, one thread: mean {1e6 * found.mean:.1f} us, p99 {1e6 * found.p99:.1f} us, "
        f"max {1e6 * found.longest:.1f} us"
    )
    return 0
