"""Files of Stable-Baselines3: models (``model.save``) and the statistics of VecNormalize.

Both are pickles: loading one executes the code in it. Load only files that you trust.
"""

from __future__ import annotations

import json
import pickle
import zipfile
from pathlib import Path
from typing import Any, Final

from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from ....envs.errors import DataError, look_up
from .policy import CLASSES
from .sb3 import OURS, parameters

_UNUSED: Final[dict[str, Any]] = {
    "learning_rate": 0.0,
    "lr_schedule": lambda remaining: 0.0,
    "clip_range": 0.2,
    "buffer_size": 1,
}
"""Stand in for what learning alone needs: schedules are code of one version of Python, buffers are large."""


def load_model(path: str | Path, algorithm: str | None = None) -> BaseAlgorithm:
    """A saved model, to convert and not to train; loading it executes code in it.

    Args:
        path: Its ``.zip`` file.
        algorithm: One of :data:`~.policy.CLASSES`; None to find out.

    Raises:
        DataError: the file is missing or broken, or no model of such an algorithm.
        UnknownNameError: no algorithm has this name.
    """
    found = algorithm_in(path)
    if algorithm is None and found is None:
        raise DataError(
            f"{path}: a model of none of {', '.join(CLASSES)}; name the algorithm if it is one of them"
        )
    name = found if algorithm is None else algorithm
    kind = look_up("algorithm", str(name), CLASSES)
    try:
        return kind.load(path, device="cpu", custom_objects=_UNUSED)
    except Exception as error:
        # Whatever is in a pickle can raise whatever it likes.
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise DataError(f"{path}: cannot be loaded as a model of {name} ({reason})") from None


def algorithm_in(path: str | Path) -> str | None:
    """The algorithm of a saved model, by the names of its hyperparameters; nothing in it is executed.

    Raises:
        DataError: the file is missing or no model of Stable-Baselines3.
    """
    try:
        with zipfile.ZipFile(path) as file:
            held = json.loads(file.read("data"))
            recurrent = RecurrentActorCriticPolicy.__module__ == held["policy_class"]["__module__"]
    except FileNotFoundError:
        raise DataError(f"{path}: there is no such file") from None
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, OSError):
        raise DataError(f"{path}: no model of Stable-Baselines3, or broken; model.save writes one") from None
    # Every algorithm has names that no other one has; early versions lack n_steps off policy.
    needed = {name: parameters(kind, OURS).keys() - {"n_steps"} for name, kind in CLASSES.items()}
    fitting = [name for name, names in needed.items() if names <= held.keys()]
    if recurrent:
        # It has the hyperparameters of PPO.
        return "recurrent-ppo" if "recurrent-ppo" in fitting else None
    return max(fitting, key=lambda name: len(needed[name]), default=None)


def load_statistics(path: str | Path) -> VecNormalize:
    """What ``VecNormalize.save`` wrote, without an environment; loading it executes code in it.

    Raises:
        DataError: the file is missing or broken, or something else.
    """
    try:
        with open(path, "rb") as file:
            loaded = pickle.load(file)
    except FileNotFoundError:
        raise DataError(f"{path}: there is no such file") from None
    except Exception:
        # Whatever is in a pickle can raise whatever it likes.
        loaded = None
    if not isinstance(loaded, VecNormalize):
        raise DataError(f"{path}: no statistics of VecNormalize, or broken; VecNormalize.save writes them")
    return loaded
