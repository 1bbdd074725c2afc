"""Drives of the benchmark: batches side by side, in processes, each kept as soon as it is done."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from ...envs.cues import CueTrace
from ...envs.errors import DataError, MotionCueingError
from ...envs.platform import Platform
from ...envs.progress import begin_worker
from ...envs.settings import configuration, to_dict
from ...envs.storage import write_text
from ..metrics import METRICS, measure
from ..policies import make_policy
from ..reporting.text import plain_name
from ..results import drive_key, load_drives_done
from ..rollout import batches, rollouts, statistics_of
from ..studies.study import identity
from ..suite import explain
from .results import DriveValues, PolicyResult, RunResult
from .splits import Split

_FOLDER: Final = "drives"


@configuration
class KeptDrive:
    """A drive that is done.

    Args:
        digest: Of its cues.
        metrics: By name.
        notes: What the policy counted.
    """

    digest: str
    metrics: DriveValues
    notes: dict[str, str]


@configuration
class KeptRun:
    """The drives of one run of a policy on one motion base.

    Args:
        key: Of everything that they depend on beside their cues; see :func:`~..results.drive_key`.
        drives: By split and drive.
    """

    key: str
    drives: dict[str, dict[str, KeptDrive]]


class RunStore:
    """Keeps the drives of a run in ``drives`` of the benchmark's folder."""

    def __init__(self, folder: Path, platform: str, policy: str, number: int, key: str) -> None:
        tag = hashlib.sha256(f"{platform}\n{policy}\n{number}".encode()).hexdigest()[:6]
        name = f"{plain_name(platform)}--{plain_name(policy)}-{number}-{tag}.json"
        self._path = folder / _FOLDER / name
        kept = load_drives_done(KeptRun, self._path, "a benchmark") if self._path.exists() else None
        self._run = kept if kept is not None and kept.key == key else KeptRun(key, {})

    def find(self, split: str, drive: CueTrace) -> KeptDrive | None:
        """A drive that is done, if nothing about it has changed."""
        kept = self._run.drives.get(split, {}).get(drive.name)
        return kept if kept is not None and kept.digest == drive.digest() else None

    def keep(self, split: str, drives: Mapping[str, KeptDrive]) -> None:
        """Write drives down at once, whole or not at all."""
        self._run.drives.setdefault(split, {}).update(drives)
        write_text(self._path, json.dumps(to_dict(self._run), allow_nan=False) + "\n")


def forget_kept(folder: Path) -> None:
    """Remove the drives of a benchmark from its folder, and nothing else that lies there."""
    for path in (folder / _FOLDER).glob("*.json"):
        path.unlink()


@dataclass(frozen=True)
class Entrant:
    """A policy of the benchmark.

    Args:
        label: In tables.
        sources: Its name or file; or one a training seed. A policy itself is taken, too.
    """

    label: str
    sources: tuple[Any, ...]


@dataclass(frozen=True, eq=False)
class BenchmarkRequest:
    """The drives of a benchmark.

    Args:
        splits: Their drives.
        platforms: The motion bases.
        entrants: The policies.
        folder: Where finished drives are kept.
        workers: Processes that drive at a time; 1 drives in this one.
        may_skip: Labels that are skipped on a motion base they do not fit; any other must fit one of them.
    """

    splits: Sequence[Split]
    platforms: Sequence[Platform]
    entrants: Sequence[Entrant]
    folder: Path
    workers: int = 1
    may_skip: frozenset[str] = frozenset()


@dataclass(eq=False)
class BenchmarkOutcome:
    """What the benchmark came to.

    Args:
        platforms: Results by motion base and policy.
        skipped: Why policies are not driven, by motion base and policy.
        driven: Number of drives that were driven now; the others were kept.
        finished: Whether every drive was driven, or failed.
    """

    platforms: dict[str, dict[str, PolicyResult]] = field(default_factory=dict)
    skipped: dict[str, dict[str, str]] = field(default_factory=dict)
    driven: int = 0
    finished: bool = True


@dataclass(eq=False)
class _Run:
    """A run under way: one policy, or one training seed of it, on one motion base."""

    platform: Platform
    label: str
    source: Any
    information: str
    store: RunStore
    groups: dict[str, list[list[str]]]
    failures: dict[str, dict[str, str]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Batch:
    """Drives that are driven side by side."""

    run: _Run
    split: str
    drives: Sequence[CueTrace]


Progress = Callable[[str, int], None]
"""Called with the motion base and policy at hand, and the number of drives done since the last call."""


class BenchmarkRun:
    """Drives what is missing.

    Args:
        request: What is driven.

    Raises:
        MotionCueingError: there is no such policy, it fits no motion base, or kept drives are damaged.
    """

    def __init__(self, request: BenchmarkRequest) -> None:
        self._request = request
        self._outcome = BenchmarkOutcome()
        self._runs: list[_Run] = []
        for platform in request.platforms:
            self._outcome.skipped[platform.name] = {}
            for entrant in request.entrants:
                try:
                    runs = [self._run(platform, entrant, k) for k in range(len(entrant.sources))]
                except MotionCueingError as error:
                    if entrant.label not in request.may_skip and len(request.platforms) == 1:
                        raise
                    self._outcome.skipped[platform.name][entrant.label] = str(error)
                    continue
                self._runs += runs
        for entrant in request.entrants:
            reasons = [skipped.get(entrant.label) for skipped in self._outcome.skipped.values()]
            if entrant.label not in request.may_skip and all(reasons):
                raise DataError(f"{entrant.label} fits none of the motion bases: {reasons[0]}")

    def _run(self, platform: Platform, entrant: Entrant, number: int) -> _Run:
        source = entrant.sources[number]
        policy = make_policy(source, platform)
        key = drive_key(platform=to_dict(platform), policy=identity(source, policy))
        store = RunStore(self._request.folder, platform.name, entrant.label, number, key)
        groups = {}
        for split in self._request.splits:
            missing = {
                name: cues for name, cues in split.cues.items() if store.find(split.name, cues) is None
            }
            groups[split.name] = batches(policy, missing)
        return _Run(platform, entrant.label, source, policy.information.label, store, groups)

    @property
    def missing(self) -> int:
        """Number of drives that are to be driven."""
        return sum(len(group) for run in self._runs for groups in run.groups.values() for group in groups)

    def drive(
        self,
        progress: Progress = lambda what, drives: None,
        stopped: Callable[[], bool] = lambda: False,
    ) -> BenchmarkOutcome:
        """Drive to the end, or until ``stopped`` says so; finished drives are on disk.

        Args:
            progress: Called after each batch of drives.
            stopped: Called before each batch; what is under way then is finished and kept.
        """
        work = self._driven_here if self._request.workers == 1 else self._driven_in_processes
        for batch, found in work(self._batches(), stopped):
            self._take(batch, found)
            progress(f"{batch.run.platform.name}, {batch.run.label}", len(batch.drives))
        for run in self._runs:
            policies = self._outcome.platforms.setdefault(run.platform.name, {})
            before = policies[run.label].runs if run.label in policies else ()
            policies[run.label] = PolicyResult(run.information, (*before, self._result(run)))
        return self._outcome

    def _batches(self) -> Iterator[_Batch]:
        cues = {split.name: split.cues for split in self._request.splits}
        for run in self._runs:
            for split, groups in run.groups.items():
                for group in groups:
                    yield _Batch(run, split, [cues[split][name] for name in group])

    def _take(self, batch: _Batch, found: Sequence[KeptDrive | str]) -> None:
        """Keep the drives of a batch, and note those that failed."""
        by_name = {drive.name: one for drive, one in zip(batch.drives, found, strict=True)}
        done = {name: one for name, one in by_name.items() if isinstance(one, KeptDrive)}
        failed = {name: one for name, one in by_name.items() if isinstance(one, str)}
        if done:
            batch.run.store.keep(batch.split, done)
            self._outcome.driven += len(done)
        if failed:
            batch.run.failures.setdefault(batch.split, {}).update(failed)

    def _driven_here(
        self, todo: Iterable[_Batch], stopped: Callable[[], bool]
    ) -> Iterator[tuple[_Batch, list[KeptDrive | str]]]:
        for batch in todo:
            if stopped():
                self._outcome.finished = False
                return
            yield batch, drive_batch(batch.run.source, batch.run.platform, batch.drives)

    def _driven_in_processes(
        self, todo: Iterable[_Batch], stopped: Callable[[], bool]
    ) -> Iterator[tuple[_Batch, list[KeptDrive | str]]]:
        left = iter(todo)
        running: dict[Future[list[KeptDrive | str]], _Batch] = {}
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(self._request.workers, context, begin_worker)
        try:
            while True:
                while len(running) < self._request.workers and not stopped():
                    batch = next(left, None)
                    if batch is None:
                        break
                    future = pool.submit(drive_batch, batch.run.source, batch.run.platform, batch.drives)
                    running[future] = batch
                if not running:
                    break
                for future in wait(running, timeout=1.0, return_when=FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
            self._outcome.finished = next(left, None) is None
        except BrokenExecutor:
            raise DataError(
                "a worker died, or ran out of memory; the same command goes on, with fewer --workers"
            ) from None
        except BaseException:
            # A second Ctrl-C does not wait for what is under way.
            for process in multiprocessing.active_children():
                process.kill()
            raise
        finally:
            pool.shutdown(cancel_futures=True)

    def _result(self, run: _Run) -> RunResult:
        result = RunResult(str(run.source if isinstance(run.source, str | Path) else run.label), {}, {}, {})
        for split in self._request.splits:
            found = {name: run.store.find(split.name, cues) for name, cues in split.cues.items()}
            done = {name: kept for name, kept in found.items() if kept is not None}
            result.drives[split.name] = {name: kept.metrics for name, kept in done.items()}
            result.notes[split.name] = {name: kept.notes for name, kept in done.items() if kept.notes}
            result.failures[split.name] = run.failures.get(split.name, {})
        return result


def drive_batch(source: Any, platform: Platform, drives: Sequence[CueTrace]) -> list[KeptDrive | str]:
    """Drive drives side by side, and measure them.

    Args:
        source: Name or file of the policy.
        platform: The machine.
        drives: With equal time steps.

    Returns:
        What each drive came to, or why it failed.
    """
    found: list[KeptDrive | str] = []
    # A policy is a user's code: whatever it raises must not cost the other drives.
    try:
        for cues, driven in zip(
            drives, rollouts(make_policy(source, platform), drives, platform), strict=True
        ):
            metrics = measure(driven)
            values = {name: getattr(metrics, name) for name in METRICS}
            found.append(KeptDrive(cues.digest(), values, statistics_of(driven.metadata)))
    except Exception as error:
        if len(drives) == 1:
            return [explain(error)]
        return [one for cues in drives for one in drive_batch(source, platform, [cues])]
    return found


def run_benchmark(
    request: BenchmarkRequest, progress: Progress = lambda what, drives: None
) -> BenchmarkOutcome:
    """Drive what is missing of a benchmark.

    Args:
        request: What is driven.
        progress: Called after each batch of drives with what is at hand, and the number of drives.
    """
    return BenchmarkRun(request).drive(progress)
