"""``motion-cueing export``: an agent as an ONNX file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..envs.errors import ConfigurationError
from ..envs.storage import check_file
from .arguments import option

if TYPE_CHECKING:
    from ..train.agents import Agent


@dataclass(frozen=True, kw_only=True)
class ExportCommand:
    """Write an agent's network with its normalization as ONNX, check it, and time it.

    `motion-cueing list` shows the names of the agents that come with the package.
    """

    policy: Annotated[str, option("NAME|FILE.safetensors")]
    """Agent, by name or file."""
    out: Annotated[Path, option("FILE.onnx")]
    """File to write."""


def run(command: ExportCommand) -> int:
    """Export, and print accuracy, size and speed."""
    if command.out.suffix != ".onnx":
        raise ConfigurationError(f"--out {command.out}: name a file that ends in .onnx")
    check_file("--out", command.out)
    agent = _agent(command.policy)
    from ..train.agents.export import CHECKED, export_onnx

    exported = export_onnx(agent, command.out)
    network = agent.network
    print(f"{command.out}: {agent.name}, {exported.size / 1024:.0f} KiB")
    print(f"observation (n, {network.size}) float32, action (n, {network.action_size}) in [-1, 1]")
    print(
        f"largest difference over {CHECKED:,} observations: {exported.torch_difference:.1e} from PyTorch, "
        f"{exported.numpy_difference:.1e} from NumPy"
    )
    print(
        f"one observation, one thread: mean {1e6 * exported.mean:.1f} us, p99 {1e6 * exported.p99:.1f} us, "
        f"max {1e6 * exported.longest:.1f} us"
    )
    return 0


def _agent(name: str) -> Agent:
    """The agent of a name or file."""
    from ..evaluation.policies import find_agent, is_agent, policy_names
    from ..train.agents import agent_names

    if not is_agent(name) and (name in policy_names() or Path(name).suffix in (".yaml", ".yml")):
        raise ConfigurationError(
            f"--policy {name} is no trained network, but a washout or a predictive controller; "
            f"what can be exported: {', '.join(agent_names())}, or the .safetensors file of an agent"
        )
    return find_agent(name)
