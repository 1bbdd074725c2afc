"""Films: as long as the drive, at its speed, with its frames; written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.rendering import Renderer
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.reporting.film import check_suffix, film_frames, frame_rows, gif_rate, save_film

from ...evaluation.synthetic import drive, trajectory
from .moments import SIZE


def frames(count: int, width: int = 64, height: int = 48) -> list[np.ndarray]:
    """A bright bar that walks to the right over a dark ground."""
    pictures = [np.full((height, width, 3), 20, dtype=np.uint8) for _ in range(count)]
    for k, picture in enumerate(pictures):
        picture[:, 4 * k : 4 * k + 8] = (240, 200, 60)
    return pictures


def left_edge(picture: np.ndarray) -> int:
    return int(np.argmax(picture[len(picture) // 2, :, 0] > 130))


def test_rows_follow_the_clock_and_never_run_ahead():
    still = trajectory(n=201, dt=0.05)
    rows = frame_rows(still, 30.0, 0.0, None)
    assert (rows[0], rows[-1], len(rows)) == (0, 200, 301)
    times = 0.05 * np.array(rows)
    clock = np.arange(301) / 30.0
    assert np.all((times <= clock + 1e-9) & (times > clock - 0.05 - 1e-9))
    assert frame_rows(still, 10.0, 2.0, 2.5) == [40, 42, 44, 46, 48, 50]
    assert frame_rows(still, 10.0, 9.95, 99.0) == [199]


@pytest.mark.parametrize(
    ("rate", "begin", "end", "field"),
    [(0.0, 0.0, None, "rate"), (-1.0, 0.0, None, "rate"), (10.0, 11.0, None, "begin"),
     (10.0, 5.0, 4.0, "begin"), (10.0, -1.0, None, "begin")],
)  # fmt: skip
def test_moments_outside_the_drive_are_refused(rate, begin, end, field):
    with pytest.raises(ConfigurationError, match=field):
        frame_rows(trajectory(), rate, begin, end)


def test_a_late_frame_knows_the_whole_drive(monkeypatch):
    renderer = Renderer(get_platform("paper"), SIZE)
    seen = []
    monkeypatch.setattr(renderer, "frame", lambda motion, cues: seen.append(cues.cue_error))
    journey = drive()
    list(film_frames(journey, renderer, 1.0, begin=19.0))
    assert seen[-1] == pytest.approx(measure(journey).cue_error, rel=1e-12)


def test_frames_of_a_drive_differ_and_repeat():
    renderer = Renderer(get_platform("paper"), SIZE)
    first, second = film_frames(drive(), renderer, 1.0, 5.0, 6.0)
    (again,) = film_frames(drive(), renderer, 1.0, 5.0, 5.0)
    assert (first != second).any()
    np.testing.assert_array_equal(first, again)


def test_a_png_is_exact(tmp_path):
    (picture,) = frames(1)
    save_film(tmp_path / "a.png", [picture], 30.0)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), picture)


def test_a_gif_has_every_frame_and_runs_at_its_rate(tmp_path):
    save_film(tmp_path / "a.gif", iter(frames(9)), 12.5)
    with Image.open(tmp_path / "a.gif") as film:
        assert (film.n_frames, film.info["loop"]) == (9, 0)
        for k in range(9):
            film.seek(k)
            assert film.info["duration"] == 80
            picture = np.asarray(film.convert("RGB")).astype(int)
            assert left_edge(picture) == 4 * k
            assert np.abs(picture - frames(9)[k]).max() < 20


def test_an_mp4_has_every_frame_and_runs_at_its_rate(tmp_path):
    save_film(tmp_path / "a.mp4", iter(frames(9)), 25.0)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "a.mp4"))
    about = next(reader)
    assert about["fps"] == 25.0
    assert about["size"] == (64, 48)
    pictures = [np.frombuffer(data, np.uint8).reshape(48, 64, 3) for data in reader]
    assert [left_edge(picture) for picture in pictures] == pytest.approx([4 * k for k in range(9)], abs=1)


@pytest.mark.parametrize("suffix", ["png", "gif", "mp4"])
def test_a_film_that_breaks_off_leaves_the_old_file(tmp_path, suffix):
    def breaking():
        if suffix != "png":
            yield from frames(3)
        raise RuntimeError("the drive failed")

    target: Path = tmp_path / f"film.{suffix}"
    target.write_text("old")
    with pytest.raises(RuntimeError, match="the drive failed"):
        save_film(target, breaking(), 25.0)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_what_is_no_film_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"\.gif, \.mp4 or \.png"):
        check_suffix(Path("film.avi"))
    with pytest.raises(DataError, match="at least one frame"):
        save_film(tmp_path / "a.gif", [], 10.0)


@pytest.mark.parametrize("rate", [1.0, 12.5, 15.0, 30.0, 100.0])
def test_a_gif_lasts_whole_hundredths_and_no_less_than_two(rate):
    hundredths = 100.0 / gif_rate(rate)
    assert hundredths == pytest.approx(round(hundredths))
    assert hundredths == pytest.approx(max(100.0 / rate, 2.0), abs=0.5)
