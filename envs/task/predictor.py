"""Predictor: a network that forecasts a car's cues for the next 3 s, with their spread.

It sees the last 2 s of cues and controls, the car's state, and the road ahead: nothing of the future. It is
one file, like an agent's: arrays, and its options as JSON. ``motion-cueing train --algo predict`` makes one.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from ..cues import GRAVITY, CueTrace
from ..errors import ConfigurationError, DataError
from ..expected import ExpectedCues, Preview, held
from ..limits import LARGEST_AGENT, check_size
from ..road import ROAD_TIMES
from ..settings import Positive, configuration, from_dict, to_dict
from ..simulator.simulator import TIME_STEP
from ..storage import write_bytes
from .kernels.observation import ObservationOptions
from .knowledge import KnownRows, MapErrors, known_of

Floats = NDArray[np.float64]
Array = NDArray[np.float32]

REST: Final = np.array([0.0, 0.0, -GRAVITY, 0.0, 0.0, 0.0])
"""Cues of a standing car."""

SCALE: Final = np.repeat([1.0, 0.1], 3)
"""Units of the network's outputs: m/s^2 and rad/s."""

DEFAULT: Final = "road"
"""Name of the predictor that comes with the package."""

_FOLDER: Final = Path(__file__).parent / "predictors"
_FORMAT: Final = "motion-cueing predictor"


@configuration
class PredictorOptions:
    """What a predictor sees and answers.

    Args:
        past: Times ago of the cues and controls it sees, s, beside those now.
        leads: Times ahead of its answers, s.
        controls: Whether it sees the driver's controls and the car's state.
        road: Times ahead at which it sees the road, s; none for no road.
    """

    past: tuple[Positive, ...] = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0)
    leads: tuple[Positive, ...] = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0)
    controls: bool = True
    road: tuple[Positive, ...] = ROAD_TIMES

    @property
    def seen(self) -> ObservationOptions:
        """The rows of controls and road."""
        return ObservationOptions(controls=self.controls, road=self.road, allow_missing=True)


def inputs_of(
    drive: CueTrace, options: PredictorOptions, errors: MapErrors | None = None, seed: int = 0
) -> Array:
    """(n, size) inputs at each sample of a drive of :data:`~.simulator.simulator.TIME_STEP`.

    Args:
        drive: The drive; before it the car is taken to have moved as at its first sample.
        options: What is seen.
        errors: Of what is known of the road; none by default.
        seed: Of these.
    """
    cues = cues_of(drive)
    parts = [(cues - REST) / SCALE]
    known = known_of([drive], options.seen, errors or MapErrors(), seed)
    parts.append(known)
    quick = quick_of(known, options)
    for ago in options.past:
        index = np.maximum(np.arange(len(drive)) - round(ago / TIME_STEP), 0)
        parts += [(cues[index] - cues) / SCALE, quick[index] - quick]
    return np.hstack(parts).astype(np.float32)


_QUICK: Final = 6
"""Entries of the rows of controls whose past is seen: steering wheel to pedals."""


def quick_of(known: Array, options: PredictorOptions) -> Array:
    """The entries of rows of controls (n, size) whose past is seen, too."""
    return known[:, :_QUICK] if options.controls else known[:, :0]


class LivePredictor:
    """A predictor sample by sample, for cues that come one by one.

    Args:
        predictor: The predictor.

    Attributes:
        rows: Makes rows of controls and road.
    """

    def __init__(self, predictor: Predictor) -> None:
        self._predictor = predictor
        options = predictor.options
        self.rows = KnownRows(options.seen)
        self._ago = [round(ago / TIME_STEP) for ago in options.past]
        self._past: list[tuple[Floats, Array]] = []

    def begin(self) -> None:
        """Forget the past: the car is taken to have moved as at the next sample."""
        self._past = []

    def __call__(self, cues: Floats, known: Floats) -> Floats:
        """(m, 6) expected cues at the leads.

        Args:
            cues: (6,) now.
            known: (size,) rows of controls and road now.
        """
        predictor = self._predictor
        row = known.astype(np.float32)
        quick = quick_of(row[None], predictor.options)[0]
        self._past = [(cues, quick), *self._past[: max(self._ago)]]
        parts = [(cues - REST) / SCALE, row]
        for ago in self._ago:
            before, quick_before = self._past[min(ago, len(self._past) - 1)]
            parts += [(before - cues) / SCALE, quick_before - quick]
        out = predictor.outputs(np.concatenate(parts).astype(np.float32)[None])
        return np.asarray(cues + SCALE * out[0, 0].astype(np.float64))


def cues_of(drive: CueTrace) -> Floats:
    """(n, 6) specific force and angular velocity."""
    return np.hstack((drive.specific_force, drive.angular_velocity))


@dataclass(frozen=True, eq=False)
class Predictor:
    """A trained predictor: a multilayer perceptron with ``tanh`` units on normalized inputs.

    The mean is the cue now plus what the network adds to it; the spread is the exponential of its other half.

    Args:
        options: What it sees and answers.
        mean: (size,) of the inputs.
        deviation: (size,) of the inputs.
        weights: Of each layer, (outputs, inputs).
        biases: Of each layer.
        record: How it was made.
    """

    options: PredictorOptions
    mean: Array
    deviation: Array
    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    record: Mapping[str, Any]

    @cached_property
    def leads(self) -> Floats:
        """(m,) times ahead, s."""
        return np.array(self.options.leads)

    def outputs(self, inputs: Array) -> Array:
        """(n, 2, m, 6) change of the cue in :data:`SCALE`, and the logarithm of its spread, likewise."""
        x = np.clip((inputs - self.mean) / self.deviation, -10.0, 10.0)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.tanh(x @ weight.T + bias)
        out = x @ self.weights[-1].T + self.biases[-1]
        return np.asarray(out.reshape(len(inputs), 2, len(self.options.leads), 6))

    def __call__(self, drive: CueTrace) -> ExpectedCues:
        """The expected cues at each sample of a drive.

        Raises:
            ConfigurationError: the drive is at another motion scale than 1, or has no speed.
        """
        if not drive.scale.neutral:
            raise ConfigurationError(
                f"{drive.name}: a predictor needs a drive at scale 1, found {drive.scale}"
            )
        drive = drive.resampled(TIME_STEP)
        out = self.outputs(inputs_of(drive, self.options)).astype(np.float64)
        mean = cues_of(drive)[:, None, :] + SCALE * out[:, 0]
        return ExpectedCues(self.leads, mean, SCALE * np.exp(out[:, 1]))

    def save(self, path: str | Path) -> None:
        """Write the file; whole or not at all."""
        arrays = {"mean": self.mean, "deviation": self.deviation}
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            arrays |= {f"layers.{k}.weight": weight, f"layers.{k}.bias": bias}
        about = {"options": to_dict(self.options), "record": dict(self.record), "layers": len(self.weights)}
        metadata = {"format": _FORMAT, "contents": json.dumps(about)}
        write_bytes(path, save({name: np.ascontiguousarray(a) for name, a in arrays.items()}, metadata))

    @classmethod
    def load(cls, path: str | Path) -> Predictor:
        """Read a file.

        Raises:
            DataError: it is missing, broken or no predictor.
        """
        path = Path(path)
        if not path.is_file():
            raise DataError(f"{path}: no such file")
        check_size(path, LARGEST_AGENT)
        try:
            with safe_open(path, "numpy") as file:
                metadata = file.metadata() or {}
                arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (SafetensorError, OSError) as error:
            raise DataError(f"{path}: cannot be read ({error})") from None
        if metadata.get("format") != _FORMAT:
            raise DataError(f"{path}: not a predictor; `motion-cueing train --algo predict` makes one")
        try:
            about = json.loads(metadata["contents"])
            layers = range(int(about["layers"]))
            return cls(
                from_dict(PredictorOptions, about["options"], str(path)),
                arrays["mean"],
                arrays["deviation"],
                tuple(arrays[f"layers.{k}.weight"] for k in layers),
                tuple(arrays[f"layers.{k}.bias"] for k in layers),
                about["record"],
            )
        except (KeyError, TypeError, ValueError) as error:
            raise DataError(f"{path}: the file is damaged ({error})") from None


@lru_cache(maxsize=4)
def find_predictor(name: str = DEFAULT) -> Predictor:
    """A predictor by the name of one of the package, or from its file.

    Raises:
        DataError: the file is missing, broken or no predictor.
    """
    return Predictor.load(name if Path(name).suffix else _FOLDER / f"{name}.safetensors")


def with_preview(drive: CueTrace, preview: Preview, predictor: str = DEFAULT) -> CueTrace:
    """A drive whose preview comes from somewhere.

    Args:
        drive: The drive.
        preview: "true" for the drive itself, "held" for the present cue, "predicted" for a predictor.
        predictor: Name or file of the predictor.

    Raises:
        ConfigurationError: the drive is at another motion scale than 1, or has no speed.
    """
    drive = drive.resampled(TIME_STEP)
    if preview == "true":
        return replace(drive, expected=None)
    known = held(cues_of(drive)) if preview == "held" else find_predictor(predictor)(drive)
    return replace(drive, expected=known, source=f"{drive.source or drive.name}, preview {preview}")
