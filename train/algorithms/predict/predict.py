"""Training of a predictor: mean and spread of the cues of the next 3 s, on random drives.

The loss is the negative log-likelihood of a normal distribution, where each sample counts with its variance
to the power of one half (beta-NLL, Seitzer et al. 2022): otherwise what is hard to forecast is given up.
"""

from __future__ import annotations

import json
import platform as computer
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import nn

from ....envs.cues import CueTrace
from ....envs.errors import ConfigurationError
from ....envs.maneuvers.sampling import NamedDrives, RandomDrives
from ....envs.settings import Positive, configuration, from_dict, merge, read_yaml, save, to_dict
from ....envs.simulator.simulator import TIME_STEP
from ....envs.storage import write_text
from ....envs.task.episode import library_of
from ....envs.task.knowledge import MapErrors
from ....envs.task.options import Count, EpisodeOptions, PositiveCount, RandomizationOptions
from ....envs.task.predictor import SCALE, Predictor, PredictorOptions, cues_of, inputs_of
from ...training import warm_cosine

Floats = NDArray[np.float64]
Share = Annotated[float, Field(gt=0.0, lt=1.0)]

PRESET: Final = Path(__file__).parents[2] / "presets" / "predict.yaml"

_BETA: Final = 0.5
_SPREADS: Final = (-4.0, 3.0)
"""Bounds of the logarithm of a spread, in units of :data:`SCALE`."""


@configuration
class PredictConfig:
    """Everything that can be chosen about the training of a predictor.

    Args:
        seed: Of weights and order.
        predictor: What it sees and answers.
        random: The random drives.
        library: How many of them.
        library_seed: Of their seeds.
        drive_duration: Of each, s.
        every: Time between the samples that are learned from, s.
        road: Errors of what is known of the road.
        held_back: Share of the drives that are validated on, not learned from.
        net_arch: Units of each hidden layer.
        learning_rate: Largest, of Adam; it rises and falls as that of ``apg``.
        batch_size: Samples of an update.
        epochs: Passes over the samples.
        threads: Of PyTorch.
    """

    seed: Count = 0
    predictor: PredictorOptions = PredictorOptions()
    random: NamedDrives = RandomDrives()
    library: PositiveCount = 512
    library_seed: Count = 0
    drive_duration: Positive = 60.0
    every: Positive = 0.15
    road: MapErrors = MapErrors()
    held_back: Share = 0.1
    net_arch: tuple[PositiveCount, ...] = (256, 256)
    learning_rate: Positive = 2e-3
    batch_size: PositiveCount = 1024
    epochs: PositiveCount = 30
    threads: PositiveCount = 1


def load_predict_config(file: str | Path | None = None, **fields: Any) -> PredictConfig:
    """The preset, with the fields of a file and further ones over it.

    Raises:
        DataError: the file cannot be read.
        ConfigurationError: a field is unknown or wrong.
    """
    values: Any = read_yaml(PRESET)
    if file is not None:
        own = read_yaml(file)
        if not isinstance(own, dict):
            raise ConfigurationError(f"{file}: expected fields of PredictConfig")
        values = merge(values, own)
    given = {name: value for name, value in fields.items() if value is not None}
    return from_dict(PredictConfig, {**values, **given}, str(file or PRESET))


def train_predictor(
    config: PredictConfig, out: Path, command: str = "", tell: Callable[[str], None] = print
) -> Predictor:
    """Train, and write ``predictor.safetensors``, ``config.yaml`` and ``log.csv`` into a folder.

    Args:
        config: Everything that can be chosen.
        out: The folder; a new or an empty one.
        command: The command line, for the record.
        tell: Receives a line an epoch.

    Raises:
        ConfigurationError: the folder holds something.
    """
    if out.is_dir() and any(out.iterdir()):
        raise ConfigurationError(f"--out {out}: there is something already; name a new folder")
    out.mkdir(parents=True, exist_ok=True)
    save(config, out / "config.yaml")
    began = time.perf_counter()
    torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    inputs, targets, last = samples_of(config)
    count = int(np.searchsorted(last, round(config.library * (1.0 - config.held_back))))
    mean, deviation = inputs[:count].mean(axis=0), np.maximum(inputs[:count].std(axis=0), 1e-3)
    network = _network(inputs.shape[1], config)
    scaled = torch.from_numpy(np.clip((inputs - mean) / deviation, -10.0, 10.0))
    wanted = torch.from_numpy(targets)
    rows, step = ["epoch,training,validation"], 0
    optimizer = torch.optim.Adam(network.parameters(), lr=config.learning_rate)
    total = config.epochs * (count // config.batch_size)
    order = torch.Generator().manual_seed(config.seed)
    for epoch in range(config.epochs):
        sums, parts = 0.0, torch.randperm(count, generator=order).split(config.batch_size)[:-1]  # type: ignore[no-untyped-call]
        for part in parts:
            for group in optimizer.param_groups:
                group["lr"] = config.learning_rate * warm_cosine(step / max(total, 1))
            loss = _loss(network(scaled[part]), wanted[part])
            optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
            sums, step = sums + float(loss.detach()), step + 1
        with torch.no_grad():
            check = _rmse(network(scaled[count:]), wanted[count:])
        rows.append(f"{epoch + 1},{sums / max(len(parts), 1):.5f},{check:.5f}")
        tell(f"epoch {epoch + 1} of {config.epochs}: error on drives held back {check:.4f}")
        write_text(out / "log.csv", "\n".join(rows) + "\n")
    record = {
        "config": json.loads(json.dumps(to_dict(config))),
        "command": command,
        "wall_time": round(time.perf_counter() - began, 1),
        "hardware": computer.processor() or computer.machine(),
        "versions": {"motion-cueing-gym": version("motion-cueing-gym"), "torch": torch.__version__},
        "validation": round(check, 5),
    }
    layers = [module for module in network if isinstance(module, nn.Linear)]
    predictor = Predictor(
        config.predictor,
        mean.astype(np.float32),
        deviation.astype(np.float32),
        tuple(layer.weight.detach().numpy().copy() for layer in layers),
        tuple(layer.bias.detach().numpy().copy() for layer in layers),
        record,
    )
    predictor.save(out / "predictor.safetensors")
    return predictor


def _network(size: int, config: PredictConfig) -> nn.Sequential:
    layers: list[nn.Module] = []
    for units in config.net_arch:
        layers += [nn.Linear(size, units), nn.Tanh()]
        size = units
    head = nn.Linear(size, 2 * 6 * len(config.predictor.leads))
    with torch.no_grad():
        head.weight.mul_(0.1)
    return nn.Sequential(*layers, head)


def _loss(out: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    mean, spread = out.view(len(out), 2, -1).unbind(1)
    spread = spread.clamp(*_SPREADS)
    likelihood = 0.5 * ((wanted - mean) / spread.exp()).square() + spread
    return (likelihood * (2.0 * _BETA * spread).detach().exp()).mean()


def _rmse(out: torch.Tensor, wanted: torch.Tensor) -> float:
    mean = out.view(len(out), 2, -1)[:, 0]
    return float((mean - wanted).square().mean().sqrt())


def samples_of(config: PredictConfig) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.intp]]:
    """Inputs (k, size), changes of the cues at the leads (k, 6 leads) in their scale, and drives (k,)."""
    episode = EpisodeOptions(
        random=config.random,
        library=config.library,
        library_seed=config.library_seed,
        drive_duration=config.drive_duration,
    )
    stride = round(config.every / TIME_STEP)
    inputs, targets, numbers = [], [], []
    for number, drive in enumerate(library_of(episode, RandomizationOptions())):
        rows = np.arange(number % stride, len(drive) - round(max(config.predictor.leads) / TIME_STEP), stride)
        inputs.append(inputs_of(drive, config.predictor, config.road, config.library_seed + number)[rows])
        targets.append(changes_of(drive, config.predictor)[rows].reshape(len(rows), -1))
        numbers.append(np.full(len(rows), number))
    return np.concatenate(inputs), np.concatenate(targets).astype(np.float32), np.concatenate(numbers)


def changes_of(drive: CueTrace, options: PredictorOptions) -> Floats:
    """(n, leads, 6) true change of the cue at each lead, in :data:`SCALE`; held after the end."""
    cues = cues_of(drive)
    ahead = np.arange(len(drive))[:, None] + np.round(np.array(options.leads) / TIME_STEP).astype(int)
    return np.asarray((cues[np.minimum(ahead, len(drive) - 1)] - cues[:, None, :]) / SCALE)
