"""Trainings in this process, in others, and on Ray: the same bits, whatever happens to a process."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from motion_cueing.envs.errors import ConfigurationError, DataError, UnknownNameError
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import TrainingConfig
from motion_cueing.train.experiments import engine as engine_module
from motion_cueing.train.experiments import seeds as studies
from motion_cueing.train.experiments.engine import Engine, RayEngine, make_engine, run_jobs
from motion_cueing.train.experiments.job import TrainingJob
from motion_cueing.train.run import RunFolder, checkpoints_in
from motion_cueing.train.training import Training

from . import jobs
from .light import Counting

pytestmark = pytest.mark.slow

ELSEWHERE = ("processes", "ray")


@pytest.fixture(scope="module")
def ray() -> Iterator[Engine]:
    """Ray on this machine: it takes seconds to begin."""
    with make_engine("ray", 2) as engine:
        yield engine


@pytest.fixture(scope="module")
def processes() -> Iterator[Engine]:
    with make_engine("local", 2) as engine:
        yield engine


@pytest.fixture
def engine(request) -> Engine:
    return request.getfixturevalue(request.param)


elsewhere = pytest.mark.parametrize("engine", ELSEWHERE, indirect=True)


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    return jobs.config(tmp_path_factory.mktemp("config"))


@pytest.fixture(scope="module")
def undisturbed(config, tmp_path_factory) -> list[TrainingJob]:
    """Two seeds, one after the other in this process."""
    trainings = jobs.seeds(tmp_path_factory.mktemp("local") / "runs", config, 2)
    with make_engine("local") as engine:
        endings, interrupted = run_jobs(engine, trainings, jobs.Heard())
    assert not interrupted
    assert [ending.error for ending in endings.values()] == [None, None]
    return trainings


def assert_same(found: list[TrainingJob], expected: list[TrainingJob]) -> None:
    """The same agents bit for bit, the same validations, the same log."""
    for one, other in zip(found, expected, strict=True):
        for name in ("final", "best"):
            agents = [Agent.load(job.path / f"{name}.safetensors") for job in (one, other)]
            for a, b in zip(agents[0].network.weights, agents[1].network.weights, strict=True):
                np.testing.assert_array_equal(a, b)
            assert agents[0].record.validation == agents[1].record.validation
        assert (one.path / "log.csv").read_text() == (other.path / "log.csv").read_text()


def test_a_training_in_another_process_comes_to_the_same_bits(processes, config, undisturbed, tmp_path):
    trainings, heard = jobs.seeds(tmp_path / "runs", config, 1), jobs.Heard()
    endings, interrupted = run_jobs(processes, trainings, heard)
    assert not interrupted
    assert endings["seed-0"].result.status.steps == config.steps
    assert heard.statuses["seed-0"][-1] == config.steps
    assert_same(trainings, undisturbed[:1])
    first, second = (Agent.load(job.path / "final.safetensors").network.weights[0] for job in undisturbed)
    assert not np.array_equal(first, second)


def test_a_job_that_is_stopped_goes_on_to_the_same_bits(config, undisturbed, tmp_path):
    (job,) = jobs.seeds(tmp_path / "runs", config, 1)
    outcome = job.run(lambda status: 2 * status.steps >= status.total)
    assert outcome.interrupted
    (*_, last) = checkpoints_in(job.path / "checkpoints")
    assert last.stem == f"step-{config.steps // 2:012d}"
    assert not job.run(lambda status: False).interrupted
    assert_same([job], undisturbed[:1])


@elsewhere
def test_a_job_whose_process_is_killed_goes_on_from_its_files(engine, tmp_path):
    killed, other = Counting(tmp_path / "a", killed_at=2), Counting(tmp_path / "b", total=2)
    endings, interrupted = run_jobs(engine, [killed, other], jobs.Heard())
    assert not interrupted
    assert endings["a"].result == (3, 4, False)
    assert endings["b"].result == (1, 2, False)


@elsewhere
def test_ctrl_c_stops_every_job_and_no_other_begins(engine, tmp_path):
    several = [Counting(tmp_path / name, waits_at=2) for name in "abc"]
    endings, interrupted = run_jobs(engine, several, jobs.Heard(press_after=2))
    assert interrupted
    assert {name: ending.result for name, ending in endings.items()} == dict.fromkeys("ab", (1, 2, True))
    endings, interrupted = run_jobs(engine, [Counting(job.path) for job in several], jobs.Heard())
    assert not interrupted
    assert [endings[name].result for name in "abc"] == [(3, 4, False), (3, 4, False), (1, 4, False)]


@elsewhere
def test_a_listener_stops_one_job(engine, tmp_path):
    class Choosy(jobs.Heard):
        def update(self, job, status):
            super().update(job, status)
            return job.name == "a"

    several = [Counting(tmp_path / "a", waits_at=2), Counting(tmp_path / "b")]
    endings, interrupted = run_jobs(engine, several, Choosy())
    assert not interrupted
    assert endings["a"].result == (1, 2, True)
    assert endings["b"].result == (1, 4, False)


@elsewhere
def test_jobs_that_fail_say_why_and_others_go_on(engine, tmp_path, monkeypatch):
    monkeypatch.setattr(engine_module, "RETRIES", 0)
    several = [
        Counting(tmp_path / "mortal", mortal=True),
        Counting(tmp_path / "wrong", wrong=True),
        Counting(tmp_path / "whole"),
    ]
    endings, interrupted = run_jobs(engine, several, jobs.Heard())
    assert not interrupted
    assert str(endings["mortal"].error).startswith("its process died 1 times")
    assert endings["wrong"].error == "one by nothing"
    assert endings["whole"].error is None


def test_ray_listens_on_loopback_only(ray):
    import ray as library

    assert isinstance(ray, RayEngine)
    node = library.get_runtime_context().get_node_id()
    (here,) = [found for found in library.nodes() if found["NodeID"] == node]
    assert here["NodeManagerAddress"] == "127.0.0.1"
    assert library.cluster_resources()["CPU"] == 2
    assert os.environ["RAY_USAGE_STATS_ENABLED"] == "0"


def test_a_training_asks_ray_for_what_it_needs(ray, config, monkeypatch):
    asked = {}

    class Task:
        def options(self, **options):
            asked.update(options)
            return self

        def remote(self, *arguments):
            return SimpleNamespace(future=lambda: None)

    monkeypatch.setattr(ray, "_perform", Task())
    job = TrainingJob("seed-0", Path("somewhere"), replace(config, threads=64, device="cuda:0"))
    ray._submit(job)
    # As many cores as there are, or it would wait for ever.
    assert (asked["num_cpus"], asked["num_gpus"]) == (2.0, 1)
    ray._submit(replace(job, config=config))
    assert (asked["num_cpus"], asked["num_gpus"]) == (1.0, 0)


def test_a_folder_that_is_not_there_is_refused(config, tmp_path):
    job = TrainingJob("seed-0", tmp_path / "elsewhere" / "seed-0", config)
    with pytest.raises(DataError, match="on a disk that all machines share"):
        job.run(lambda status: False)


def test_what_is_missing_is_told(monkeypatch):
    with pytest.raises(UnknownNameError, match=r"unknown engine 'rey'. Did you mean ray\?"):
        make_engine("rey")
    monkeypatch.setattr(engine_module, "find_spec", lambda name: None)
    with pytest.raises(ConfigurationError, match=r"needs ray: pip install 'motion-cueing-gym\[ray\]'"):
        make_engine("ray")


def test_a_ray_that_does_not_start_is_told_and_leaves_nothing(monkeypatch):
    given = []

    def init(**arguments):
        given.append(arguments)
        assert Path(arguments["_temp_dir"]).is_dir()
        raise RuntimeError("too\nbusy")

    library = SimpleNamespace(init=init, shutdown=lambda: None, __spec__="any")
    monkeypatch.setitem(sys.modules, "ray", library)
    with pytest.raises(DataError, match=r"Ray does not start \(too busy\)"), RayEngine(3):
        pass
    # On a busy machine it may take more than one attempt.
    assert [(one["num_cpus"], one["include_dashboard"]) for one in given] == [(3, False)] * 3
    assert not any(Path(one["_temp_dir"]).exists() for one in given)


def test_ctrl_c_while_ray_starts_leaves_nothing(monkeypatch):
    given = []

    def init(**arguments):
        given.append(arguments)
        raise KeyboardInterrupt

    library = SimpleNamespace(init=init, shutdown=lambda: None, __spec__="any")
    monkeypatch.setitem(sys.modules, "ray", library)
    with pytest.raises(KeyboardInterrupt), RayEngine(3):
        pass
    assert len(given) == 1
    assert not Path(given[0]["_temp_dir"]).exists()


def test_a_cluster_is_joined_only_where_one_listens(monkeypatch):
    joined = []
    library = SimpleNamespace(
        init=lambda **given: joined.append(given), shutdown=lambda: None, __spec__="any"
    )
    monkeypatch.setitem(sys.modules, "ray", library)
    monkeypatch.setattr(RayEngine, "_begin", lambda engine: None)
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with RayEngine(3, address):
            pass
    with (
        pytest.raises(DataError, match=f"--address {address}: no Ray cluster answers"),
        RayEngine(3, address),
    ):
        pass
    with pytest.raises(ConfigurationError, match="expected HOST:PORT"), RayEngine(3, "somewhere"):
        pass
    # Names no host can have, which Python finds out before the system does.
    for wrong in (f"{64 * 'a'}.b:1", "127.0.0.1:²"):
        with pytest.raises(DataError, match="no Ray cluster answers"), RayEngine(3, wrong):
            pass
    assert [one["address"] for one in joined] == [address]
    assert "num_cpus" not in joined[0]


def test_an_unexpected_error_leaves_its_trace(config, tmp_path, monkeypatch):
    def broken(training: Training) -> None:
        raise ZeroDivisionError("one by nothing")

    monkeypatch.setattr(Training, "train", broken)
    with pytest.raises(ZeroDivisionError):
        TrainingJob("seed-0", tmp_path / "seed-0", config).run(lambda status: False)
    assert "in broken" in (tmp_path / "seed-0" / "error.txt").read_text()


def test_a_single_training_runs_on_ray(ray, config, undisturbed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(studies, "make_engine", lambda *place: nullcontext(ray))
    folder = RunFolder.create(tmp_path / "runs" / "one", config)
    assert studies.run_training(folder, studies.Place("ray")) == 0
    told = capsys.readouterr()
    assert f"final.safetensors: the agent after {config.steps:,} steps" in told.out
    assert told.err.count("(washout ") == 3
    assert_same([TrainingJob("one", folder.path, config)], undisturbed[:1])
