"""``motion-cueing convert``: a model of Stable-Baselines3 as an agent."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from ..envs.errors import ConfigurationError, DataError
from ..envs.storage import check_file
from .arguments import named, option, with_flags


@dataclass(frozen=True, kw_only=True)
class ConvertCommand:
    """Turn a model that Stable-Baselines3 or sb3-contrib saved into an agent, a policy of every command.

    Loading such a model, or the statistics of VecNormalize, executes code in the file: convert only files
    that you trust. The agent that comes out is safe to load and needs NumPy alone.
    """

    file: Annotated[Path, option("MODEL.zip")] = field(kw_only=False)
    """Model, as `model.save` wrote it."""
    environment: Annotated[str, option("ID|NAME|FILE.yaml")]
    """Environment that it was trained in: an id such as motion_cueing/CueingPreview-v0, a task such as
    cueing-preview, or the YAML file of one."""
    out: Annotated[Path, option("NAME.safetensors")]
    """Agent to write."""
    normalize: Annotated[Path | None, option("FILE.pkl")] = None
    """Statistics of VecNormalize that it was trained with, as `VecNormalize.save` wrote them."""
    algorithm: Annotated[str | None, option("NAME", completer=named("Training algorithms"))] = None
    """Algorithm that trained it; default: found in the file."""
    base: Annotated[str | None, option("NAME|FILE")] = None
    """Controller that it was trained on top of, where the environment names none."""


def run(command: ConvertCommand) -> int:
    """Load, check, and write the agent."""
    from ..train.agents.names import SUFFIX
    from .train import check_installed

    if command.out.suffix != SUFFIX:
        raise ConfigurationError(f"--out {command.out}: name a file that ends in {SUFFIX}")
    check_file("--out", command.out)
    check_installed()
    from ..train.algorithms.sb3.policy import agent_of
    from ..train.algorithms.sb3.saved import load_model, load_statistics

    normalize = None if command.normalize is None else load_statistics(command.normalize)
    model = load_model(command.file, command.algorithm)
    try:
        agent = agent_of(model, command.environment, command.out.stem, normalize, command.base)
    except DataError as error:
        raise DataError(with_flags(str(error), ["normalize"])) from None
    agent.save(command.out)
    print(f"{command.out}: {agent.description}, after {agent.record.steps:,} actions")
    if normalize is None:
        print("its observation is not normalized; a model trained in VecNormalize needs --normalize FILE.pkl")
    return 0
