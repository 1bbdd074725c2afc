"""Trainings that take a second or two."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from motion_cueing.train.config import TrainingConfig, load_config, merge

ALGORITHMS = ("ppo", "trpo", "recurrent-ppo", "sac", "td3", "tqc", "crossq")

_COMMON: dict[str, Any] = {
    "n_envs": 4,
    "group": 1,
    "steps": 320,
    "log_every": 100,
    "task": {
        "preset": None,
        "observation": {"preview": 2},
        "action": {"mode": "acceleration", "repeat": 5},
        "episode": {"library": 2, "drive_duration": 6.0, "duration": 1.0},
    },
    "validation": {"every": 160, "drives": 2, "duration": 5.0},
    "checkpoints": {"every": 160},
    "search": {"hyperparameters.gamma": {"choices": [0.9, 0.95]}},
}
_NORMALIZED = {"observation": True, "reward": True}
_NET = {"policy_kwargs": {"net_arch": [8, 8]}}
_GRADIENT = {"net_arch": [8]}
_ON_POLICY = {"n_steps": 16, "batch_size": 32, **_NET}
_FEW_EPOCHS = merge(_ON_POLICY, {"n_epochs": 3})
_PPO = {**_FEW_EPOCHS, "policy": "MlpPolicy"}
_RECURRENT = merge(_FEW_EPOCHS, {"policy_kwargs": {"lstm_hidden_size": 6}})
_OFF_POLICY = {"learning_starts": 60, "batch_size": 16, "buffer_size": 240, "gradient_steps": 1, **_NET}


def values(algo: str, /, **fields: Any) -> dict[str, Any]:
    """Fields of a tiny configuration."""
    hyperparameters = {
        "ppo": _PPO,
        "trpo": _ON_POLICY,
        "recurrent-ppo": _RECURRENT,
        "apg": _GRADIENT,
    }.get(algo, _OFF_POLICY)
    normalize = {"normalize": _NORMALIZED} if algo in ALGORITHMS else {}
    return merge({**_COMMON, **normalize, "hyperparameters": hyperparameters}, fields)


def config_file(folder: Path, algo: str, /, **fields: Any) -> Path:
    """A tiny configuration as a file."""
    path = folder / f"{algo}-tiny.yaml"
    path.write_text(yaml.safe_dump(values(algo, **fields)), encoding="utf-8")
    return path


def config(folder: Path, algo: str, /, **fields: Any) -> TrainingConfig:
    """A tiny configuration."""
    return load_config(algo, config_file(folder, algo, **fields))
