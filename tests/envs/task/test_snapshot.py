"""A batch put back where another was goes on with the same bits."""

from __future__ import annotations

import numpy as np
import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.environment import task_options

from .tasks import EVERY_OPTION, options

N = 3


def make(name: str, n: int = N) -> Batch:
    fields = options(name)
    return Batch(n, task_options(None, {k: v for k, v in fields.items() if k != "base"}),
                 base=fields.get("base"))  # fmt: skip


def begin(batch: Batch, mask: np.ndarray) -> None:
    batch.begin(mask)
    batch.observe(mask)


def play(batch: Batch, rng: np.random.Generator, steps: int) -> list[np.ndarray]:
    """Everything a learner sees of some random steps, with ends and beginnings."""
    seen = []
    for _ in range(steps):
        batch.write(rng.uniform(-0.5, 0.5, (batch.n, batch.action_size)))
        batch.step()
        arrays = batch.arrays
        seen += [arrays.reward.pull().copy(), arrays.terms.pull().copy(), arrays.truncated.pull().copy()]
        ended = arrays.terminated.pull() | arrays.truncated.pull()
        if ended.any():
            begin(batch, ended)
        seen.append(arrays.observation.pull().copy())
    return seen


@pytest.mark.parametrize("name", EVERY_OPTION)
@pytest.mark.parametrize("before", [7, 50])
def test_it_goes_on_with_the_same_bits(name, before):
    first, second = make(name), make(name)
    everywhere = np.ones(N, dtype=bool)
    first.seed(everywhere, [5, 6, 7])
    begin(first, everywhere)
    play(first, np.random.default_rng(0), before)
    second.restore(first.snapshot())
    assert np.array_equal(second.arrays.observation.view, first.arrays.observation.view)
    expected = play(first, np.random.default_rng(1), 60)
    for got, wanted in zip(play(second, np.random.default_rng(1), 60), expected, strict=True):
        assert np.array_equal(got, wanted)


def test_a_snapshot_does_not_change_with_the_batch():
    batch = make("defaults")
    everywhere = np.ones(N, dtype=bool)
    batch.seed(everywhere, [1, 2, 3])
    begin(batch, everywhere)
    snapshot = batch.snapshot()
    kept = {name: array.copy() for name, array in snapshot.items()}
    play(batch, np.random.default_rng(0), 3)
    assert all(np.array_equal(snapshot[name], kept[name]) for name in kept)
    assert not np.array_equal(batch.snapshot()["simulator.state"], kept["simulator.state"])


@pytest.mark.parametrize("n", [1, 5])
def test_a_snapshot_of_another_batch_is_refused(n):
    with pytest.raises(DataError, match="of another batch or version"):
        make("defaults").restore(make("defaults", n).snapshot())


def test_a_snapshot_that_misses_something_is_refused():
    snapshot = make("defaults").snapshot()
    del snapshot["simulator.state"]
    with pytest.raises(DataError, match=r"state needs .* found nothing"):
        make("defaults").restore(snapshot)
