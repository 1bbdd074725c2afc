"""Expected cues in place of the true ones ahead, and the file of a predictor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.cues import CueScale
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.expected import ExpectedCues, held
from motion_cueing.envs.maneuvers import random_drives
from motion_cueing.envs.task.batch import Batch
from motion_cueing.envs.task.kernels.observation import ObservationOptions
from motion_cueing.envs.task.options import TaskOptions
from motion_cueing.envs.task.predictor import Predictor, PredictorOptions, cues_of, inputs_of, with_preview

SEEN = ObservationOptions(preview=4, preview_spacing=0.25, controls=True)
LEADS = 0.25 * np.arange(1, 5)


@pytest.fixture(scope="module")
def drive():
    return random_drives(1, 12.0, 5, "urban")[0]


def truth(drive):
    """The true cues as expected ones."""
    cues = cues_of(drive)
    ahead = np.arange(len(drive))[:, None] + np.round(LEADS / 0.01).astype(int)
    return ExpectedCues(LEADS, cues[np.minimum(ahead, len(drive) - 1)])


def seen(drive, samples=400):
    """Observations of a machine that stands still, and the layout."""
    batch = Batch(1, TaskOptions(observation=SEEN), drives=[drive])
    everywhere = np.ones(1, dtype=bool)
    batch.seed(everywhere, [0])
    batch.begin(everywhere)
    batch.observe(everywhere)
    rows = [batch.arrays.observation.pull()[0].copy()]
    for _ in range(samples):
        batch.write(np.zeros((1, batch.action_size)))
        batch.step()
        rows.append(batch.arrays.observation.pull()[0].copy())
    return np.array(rows), batch.layout.slices


def test_true_cues_as_expected_ones_are_the_true_preview(drive):
    true, _ = seen(drive)
    same, _ = seen(replace(drive, expected=truth(drive)))
    np.testing.assert_allclose(same, true, atol=1e-6)


def test_held_cues_are_the_present_ones(drive):
    rows, where = seen(with_preview(drive, "held"))
    now = np.hstack((rows[:, where["reference_force"]], rows[:, where["reference_rate"]]))
    np.testing.assert_allclose(rows[:, where["preview"]], np.tile(now, 4), atol=1e-6)
    # The rows of the controls lie where they lay.
    true, _ = seen(drive)
    np.testing.assert_array_equal(rows[:, where["speed"]], true[:, where["speed"]])


def test_some_drives_with_expected_cues_are_refused(drive):
    with pytest.raises(ConfigurationError, match="all drives must carry expected cues, or none"):
        Batch(1, TaskOptions(observation=SEEN), drives=[drive, with_preview(drive, "held")])


def test_expected_cues_keep_time_step_and_scale(drive):
    known = with_preview(drive, "held")
    with pytest.raises(DataError, match="keeps its time step"):
        known.resampled(0.02)
    with pytest.raises(DataError, match="cannot be scaled"):
        known.scaled(CueScale.parse("0.5"))


def test_between_leads_cues_are_linear():
    now, later = np.zeros((1, 6)), np.arange(1.0, 7.0)[None]
    known = ExpectedCues(np.array([1.0]), later[:, None, :])
    found = known.at(now, np.array([0.25, 1.0, 5.0]))
    np.testing.assert_allclose(found[0], [0.25 * later[0], later[0], later[0]])
    np.testing.assert_array_equal(held(later).at(later, np.array([2.0]))[0, 0], later[0])


def predictor(drive):
    """One that has learned nothing: it holds the cue, with a spread of 1."""
    options = PredictorOptions()
    size = inputs_of(drive, options).shape[1]
    outputs = 2 * 6 * len(options.leads)
    return Predictor(
        options,
        np.zeros(size, np.float32),
        np.ones(size, np.float32),
        (np.zeros((outputs, size), np.float32),),
        (np.zeros(outputs, np.float32),),
        {"seed": 0},
    )


def test_a_file_comes_back_and_answers_alike(drive, tmp_path):
    first = predictor(drive)
    first.save(tmp_path / "one.safetensors")
    second = Predictor.load(tmp_path / "one.safetensors")
    assert second.options == first.options
    assert second.record == {"seed": 0}
    np.testing.assert_array_equal(second(drive).mean, first(drive).mean)
    np.testing.assert_allclose(first(drive).mean[:, 3], cues_of(drive))
    np.testing.assert_allclose(first(drive).spread[0, 0], [1.0, 1.0, 1.0, 0.1, 0.1, 0.1])


def test_what_is_no_predictor_is_refused(tmp_path):
    with pytest.raises(DataError, match="no such file"):
        Predictor.load(tmp_path / "none.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"no arrays")
    with pytest.raises(DataError, match="cannot be read"):
        Predictor.load(tmp_path / "bad.safetensors")


def test_inputs_know_nothing_of_the_future(drive):
    options = PredictorOptions(road=())
    before = inputs_of(drive, options)
    changed = np.array(drive.specific_force)
    changed[600:] += 1.0
    channels = {name: np.where(np.arange(len(drive)) < 600, v, 0.0) for name, v in drive.channels.items()}
    after = inputs_of(replace(drive, specific_force=changed, channels=channels), options)
    np.testing.assert_array_equal(before[:600], after[:600])
    assert not np.array_equal(before[600], after[600])


def test_another_scale_is_refused(drive):
    with pytest.raises(ConfigurationError, match="needs a drive at scale 1"):
        predictor(drive)(drive.scaled(CueScale.parse("0.5")))
