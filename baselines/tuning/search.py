"""A search for the parameters of a washout: its options, its steps up to a budget, and its file.

The file is written after every step. A search that was interrupted goes through its steps again without
simulating, and ends with the same bits.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from ...envs.cues import CueScale
from ...envs.errors import ConfigurationError, DataError
from ...envs.maneuvers import drive_seeds
from ...envs.maneuvers.sampling import NamedDrives, load_drives
from ...envs.provenance import package_version
from ...envs.settings import Positive, configuration, from_dict, renamed, to_dict
from ...envs.storage import write_text
from ..washout.families import AnyWashout, family_of
from .methods import CmaEs, GradientDescent, Method, StepResult
from .objective import LIMIT_SLOPE, LIMIT_STEP, Measure, Objective, WashoutSpace

TRAIN: Final = "train"
"""Name of the random drives; the standard maneuvers are for evaluation."""
HELD_OUT_SEED: Final = 1_000_000
"""Seed of the random drives that no search sees: those that agents are validated on."""
HELD_OUT: Final = 64
"""Their number."""

ROADS: Final = load_drives("broad")
"""Random drives as cars drive: those that agents are trained on."""

Count = Annotated[int, Field(ge=0, lt=2**32)]


@configuration
class TuningOptions:
    """Options of a search; with its drives and its machine they determine the result.

    Args:
        start: Set to begin with. Orders of filters and blocks that are off stay as in it.
        objective: J, or perceived J.
        method: "cma", or "gradient" through the machine's own equations, for a classical washout.
        maneuvers: "train" for random drives, or names of maneuvers and recordings.
        limits: Drives in which no limit may be met: "all"; "roads", which exempts the random drives on
            tracks and circuits and those at the limit of the tires; or "none". A set that takes the
            hardest of those without a limit is a timid one on every road.
        drives: Number of random drives, if any.
        duration: Length of each, s.
        roads: Distribution of the random drives, or its name.
        drives_seed: Seed of the random drives; the default is that of the agents' training.
        budget: Time to simulate, h.
        seed: Seed of every other draw.
        scale: Motion scale of the drives.
    """

    start: AnyWashout
    objective: Measure = "J"
    method: Literal["cma", "gradient"] = "cma"
    maneuvers: Annotated[tuple[str, ...], Field(min_length=1)] = (TRAIN,)
    limits: Literal["none", "roads", "all"] = "roads"
    drives: Annotated[int, Field(ge=1)] = 256
    duration: Positive = 60.0
    roads: NamedDrives = ROADS
    drives_seed: Count = 0
    budget: Positive = 1000.0
    seed: Count = 0
    scale: CueScale = CueScale()

    def __post_init__(self) -> None:
        if self.method == "gradient" and self.objective != "J":
            raise ConfigurationError("objective perceived has no gradient; use method cma")
        if self.method == "gradient" and family_of(self.start).kernels.act is None:
            raise ConfigurationError(f"{family_of(self.start).title} has no gradient; use method cma")
        seen = drive_seeds(self.drives, self.drives_seed) if TRAIN in self.maneuvers else []
        if set(seen) & set(drive_seeds(HELD_OUT, HELD_OUT_SEED)):
            raise ConfigurationError(f"drives_seed {self.drives_seed} gives drives that are held out")


_ANEW: Final = "begin anew: delete it, or name another --out"


@configuration
class Record:
    """The file of a search: enough to repeat it to the same bits without simulating.

    Args:
        options: Of the search.
        platform: Name or file of the machine.
        car: Name or file of the car.
        inputs: Checksum of everything the results depend on, see :func:`checksum`.
        results: Results of its steps.
        command: Command that began it, for people.
    """

    options: TuningOptions
    platform: str
    car: str
    inputs: str
    results: Annotated[tuple[StepResult, ...], renamed("results", "found")] = ()
    command: str = ""


@dataclass(frozen=True)
class Status:
    """Progress of a search.

    Args:
        hours: Time simulated so far, h.
        best: Lowest cost so far; None before the first.
        steps: Generations, or gradients and trials.
    """

    hours: float
    best: float | None
    steps: int


class Search:
    """A search for the best parameters.

    Args:
        options: Of the search.
        objective: Its objective; the drives are those of the options.
        names: Names of platform and car, as the file holds them.
        path: File that is written after every step; None for none.
        command: Command that begins it, for people.
    """

    def __init__(
        self,
        options: TuningOptions,
        objective: Objective,
        names: tuple[str, str] = ("paper", "sedan"),
        path: Path | None = None,
        command: str = "",
    ) -> None:
        self.options, self.objective, self.path, self.command = options, objective, path, command
        self.space = WashoutSpace(options.start, objective.platform)
        self.results: list[StepResult] = []
        self._method = _method(options, self.space)
        self._names, self._inputs = names, checksum(options, objective, self.space, self._method)

    def resume(self, record: Record) -> None:
        """Go through the steps of an earlier session again, without simulating.

        Raises:
            DataError: drives, machine or the search itself have changed since, or the record does not fit.
        """
        if record.inputs != self._inputs:
            raise DataError(
                "options, drives, machine, ranges or settings of the search, or the version of "
                "motion-cueing-gym or cma have changed since this search was begun; begin it anew, with "
                "another --out"
            )
        try:
            for result in record.results:
                self._take(result)
        except ValueError as error:
            raise DataError(f"the record of this search does not fit its options ({error})") from None

    def run(
        self,
        on_step: Callable[[Status], None] = lambda status: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Search until the budget is spent or the method has converged, up to the next trial.

        Returns:
            Whether ``stop`` ended it.
        """
        on_step(self.status)
        while not (self._at_its_end and self._method.tried):
            if stop():
                return True
            self._take(self._method.evaluate(self.space, self.objective))
            self.save()
            on_step(self.status)
        return False

    def _take(self, result: StepResult) -> None:
        self._method.update(result)
        self.results.append(result)

    @property
    def status(self) -> Status:
        """Progress so far."""
        best = self._method.best
        hours = sum(result.hours for result in self.results)
        return Status(hours, None if best is None else best[0], len(self.results))

    @property
    def _at_its_end(self) -> bool:
        return self.status.hours >= self.options.budget or self._method.converged

    def result(self, name: str, description: str) -> AnyWashout:
        """The best set, or the start before the first trial."""
        best = self._method.best
        place = self.space.encode(self.options.start) if best is None else best[1]
        return self.space.result(place, name, description)

    def save(self) -> None:
        """Write the file, whole or not at all."""
        if self.path is not None:
            record = Record(self.options, *self._names, self._inputs, tuple(self.results), self.command)
            write_text(self.path, json.dumps(to_dict(record)) + "\n")


def load_record(path: Path) -> Record:
    """The file of a search.

    Raises:
        DataError: there is none, it is broken, or a field of it is wrong.
    """
    try:
        values: Any = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(f"{path}: no search can be read ({error.strerror})") from None
    except ValueError as error:
        raise DataError(f"{path}: no search can be read ({error}); {_ANEW}") from None
    try:
        return from_dict(Record, values, str(path))
    except ConfigurationError as error:
        first, *others = str(error).removeprefix(f"{path}: ").split("; ")
        more = f", and {len(others)} more" if others else ""
        raise DataError(f"{path}: no search of this version ({first}{more}); {_ANEW}") from None


def checksum(options: TuningOptions, objective: Objective, space: WashoutSpace, method: Method) -> str:
    """SHA-256 of everything that the results of a search depend on.

    Every option but the budget, which may be extended; drives and where limits may be met in them, the
    machine, the penalty, every coordinate with its range, the constants of the method, and versions.
    """
    parts = {
        "package": package_version(),
        "options": to_dict(replace(options, budget=1.0)),
        "drives": [drive.digest() for drive in objective.drives],
        "spared": sorted(objective.exempt),
        "machine": to_dict(objective.platform),
        "limits": [LIMIT_STEP, LIMIT_SLOPE],
        "space": [to_dict(coordinate) for coordinate in space.coordinates],
        "method": method.settings,
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def _method(options: TuningOptions, space: WashoutSpace) -> Method:
    begin = space.encode(options.start)
    if options.method == "gradient":
        return GradientDescent(begin, options.seed)
    return CmaEs(begin, options.seed)
