"""Populations: who goes on from whom, and what comes of it."""

from __future__ import annotations

import csv
import math
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.settings import from_dict, load
from motion_cueing.train.agents import Agent
from motion_cueing.train.config import Choice, PopulationOptions, TrainingConfig
from motion_cueing.train.experiments.engine import make_engine
from motion_cueing.train.experiments.population import Population, draw, explored, next_generation
from motion_cueing.train.experiments.seeds import TrainingProgress
from motion_cueing.train.logs import read_log
from motion_cueing.train.run import RunFolder
from motion_cueing.train.training import Training

from . import jobs

pytestmark = pytest.mark.slow

SPACE = {
    "rate": Choice(low=1e-4, high=1e-1, log=True),
    "size": Choice(low=1, high=8, integer=True),
    "kind": Choice(choices=("a", "b", "c")),
}
OPTIONS = PopulationOptions()


def random(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.floats(allow_nan=True), min_size=2, max_size=20),
    st.floats(0.01, 0.5),
    st.integers(0, 1000),
)
def test_the_worst_go_on_from_the_best_and_all_others_from_themselves(ratings, replaced, seed):
    options = replace(OPTIONS, replaced=replaced)
    values = [draw(SPACE, random(i)) for i in range(len(ratings))]
    successors = next_generation(ratings, values, SPACE, options, random(seed))
    count = max(1, int(replaced * len(ratings)))
    moved = [i for i, successor in enumerate(successors) if successor.parent != i]
    assert len(moved) == count
    comparable = [rating if math.isfinite(rating) else math.inf for rating in ratings]
    ranked = sorted(comparable)
    for member, successor in enumerate(successors):
        if member in moved:
            assert comparable[member] >= ranked[-count]
            assert comparable[successor.parent] <= ranked[count - 1]
        else:
            assert successor.values == values[member]
    assert successors == next_generation(ratings, values, SPACE, options, random(seed))


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0))
def test_what_is_drawn_or_changed_stays_within_its_range(seed, redrawn):
    generator = random(seed)
    values = draw(SPACE, generator)
    for _ in range(5):
        assert SPACE["rate"].low <= values["rate"] <= SPACE["rate"].high
        assert values["size"] in range(1, 9)
        assert isinstance(values["size"], int)
        assert values["kind"] in "abc"
        values = explored(values, SPACE, replace(OPTIONS, redrawn=redrawn), generator)


def test_a_change_is_by_one_of_the_factors_by_one_at_least_or_to_a_neighbor():
    options = replace(OPTIONS, redrawn=0.0)
    found = [explored({"rate": 1e-2, "size": 2, "kind": "b"}, SPACE, options, random(i)) for i in range(40)]
    assert {round(values["rate"], 12) for values in found} == {0.008, 0.012}
    assert {values["size"] for values in found} == {1, 3}
    assert {values["kind"] for values in found} == {"a", "c"}
    assert len({(v["rate"], v["size"], v["kind"]) for v in found}) == 8


def test_values_at_the_beginning_fill_their_ranges():
    generator = random()
    found = [draw(SPACE, generator) for _ in range(4000)]
    # The middle of the logarithms is the median.
    assert np.median([values["rate"] for values in found]) == pytest.approx(10.0**-2.5, rel=0.2)
    assert {values["size"] for values in found} == set(range(1, 9))
    assert {values["kind"] for values in found} == set("abc")


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> TrainingConfig:
    """Three members, two generations."""
    varied = {"hyperparameters.learning_rate": {"low": 1e-4, "high": 1e-2, "log": True}}
    fields = {"algo": "apg", "search": varied, "population": {"members": 3}}
    chosen = from_dict(TrainingConfig, fields)
    base = jobs.config(tmp_path_factory.mktemp("config"))
    return replace(base, search=chosen.search, population=chosen.population)


def run(population: Population) -> bool:
    with make_engine("local") as engine:
        return population.run(engine, TrainingProgress())


@pytest.fixture(scope="module")
def whole(config, tmp_path_factory) -> Population:
    """A population at its end."""
    population = Population.create(tmp_path_factory.mktemp("population") / "whole", config)
    assert not run(population)
    return population


def rates(path: Path) -> float:
    """The learning rate of a member."""
    return load(TrainingConfig, path / "config.yaml").hyperparameters["learning_rate"]


def test_members_go_on_from_their_parents_with_other_values(whole, config):
    assert [len(members) for members in whole.generations] == [3, 3]
    for number, members in enumerate(whole.generations, start=1):
        before = whole.generations[number - 2]
        ratings = [member.rating for member in members]
        assert None not in ratings
        if number == 1:
            continue
        worst = max(range(3), key=lambda i: before[i].rating)
        best = min(range(3), key=lambda i: before[i].rating)
        assert [member.parent for member in members] == [best if i == worst else i for i in range(3)]
        for i, member in enumerate(members):
            path = whole.path / f"generation-{number:03d}" / f"member-{i}"
            parent = whole.path / f"generation-{number - 1:03d}" / f"member-{member.parent}"
            rate = member.values["hyperparameters.learning_rate"]
            assert rates(path) == rate
            assert (rate == rates(parent)) == (i != worst)
            # The log is that of its ancestors, and then its own.
            steps = [row["steps"] for row in read_log(parent)]
            assert [row["steps"] for row in read_log(path)][: len(steps)] == steps
            assert read_log(path)[-1]["validation/J"] == pytest.approx(member.rating, rel=1e-8)
            assert RunFolder.open(path).sessions[0]["steps"] == 240 * (number - 1)


def test_the_best_agents_are_kept(whole, config):
    best = min(member.best for member in whole.generations[-1])
    assert best == min(member.rating for members in whole.generations for member in members)
    assert Agent.load(whole.best_agent).record.validation == best
    final = Agent.load(whole.path / "final.safetensors").record
    assert final.validation == min(member.rating for member in whole.generations[-1])
    assert final.steps == config.steps
    # Checkpoints are only for children that are not done.
    assert [path.parent.parent.name for path in whole.path.glob("*/member-0/checkpoints")] == [
        "generation-002"
    ]
    table = list(csv.DictReader((whole.path / "results.csv").open()))
    assert len(table) == 6
    assert float(table[-1]["rating"]) == whole.generations[-1][2].rating


def test_one_that_is_stopped_goes_on_to_the_same_bits(whole, config, tmp_path, monkeypatch):
    population, boundary = Population.create(tmp_path / "again", config), Training._boundary

    def pressed(training: Training) -> None:
        if training.run.path.name == "member-2" and training.learner.steps == 360:
            signal.raise_signal(signal.SIGINT)
        boundary(training)

    with monkeypatch.context() as patched:
        patched.setattr(Training, "_boundary", pressed)
        assert run(population)
    assert [member.rating for member in population.generations[1]] == [None] * 3
    again = Population.open(population.path)
    assert not run(again)
    assert again.generations == whole.generations
    for name in ("best", "final"):
        one, other = (Agent.load(each.path / f"{name}.safetensors").network for each in (again, whole))
        for a, b in zip(one.weights, other.weights, strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_member_that_fails_ends_it_and_a_broken_state_is_told(config, tmp_path, monkeypatch):
    population, train = Population.create(tmp_path / "one", config), Training.train

    def fail_once(training: Training):
        if training.run.path.name == "member-1":
            raise ValueError("not finite")
        return train(training)

    with monkeypatch.context() as patched:
        patched.setattr(Training, "train", fail_once)
        with pytest.raises(DataError, match=r"failed: member-1 \(not finite\); the same command tries again"):
            run(population)
    (population.path / "population.json").write_text("[[{}]]")
    with pytest.raises(DataError, match="not the state of a population"):
        Population.open(population.path)


def test_a_generation_without_a_finite_rating_ends_it(config, tmp_path, monkeypatch):
    monkeypatch.setattr("motion_cueing.train.experiments.population.rating", lambda score, measure: math.nan)
    population = Population.create(tmp_path / "one", replace(config, steps=240))
    with pytest.raises(DataError, match="generation 1: no member's validation is finite"):
        run(population)
