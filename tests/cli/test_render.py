"""The command ``motion-cueing render``."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from motion_cueing.cli.main import main

QUICK = ["--maneuver", "lane-change", "--size", "640", "360"]


def test_a_picture_shows_the_moment_asked_for(tmp_path, capsys):
    pictures = []
    for moment in ("3.0", "3.0", "5.0"):
        file = tmp_path / f"{len(pictures)}.png"
        assert main(["render", "--out", str(file), *QUICK, "--begin", moment]) == 0
        pictures.append(np.asarray(Image.open(file)))
    assert pictures[0].shape == (360, 640, 3)
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert (pictures[0] != pictures[2]).any()
    assert "classical in lane-change, 640 x 360 pixels" in capsys.readouterr().out


def test_a_gif_of_a_part_of_a_drive(tmp_path):
    file = tmp_path / "a.gif"
    assert main(["render", "--out", str(file), *QUICK, "--begin", "2", "--end", "3", "--rate", "10"]) == 0
    with Image.open(file) as film:
        assert (film.n_frames, film.size) == (11, (640, 360))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--out", "a.avi"], "name a file that ends in .gif, .mp4 or .png"),
        (["--out", "a.png", "--end", "3"], "leave --end and --rate out"),
        (["--out", "a.png", "--maneuver", "all"], "name one"),
        (["--out", "a.png", "--maneuver", "lane-chnge"], "Did you mean lane-change"),
        (["--out", "a.png", "--platform", "papr"], "Did you mean paper"),
        (["--out", "a.png", "--size", "20", "10"], "size must be at least"),
        (["--out", "a.png", "--maneuver", "lane-change", "--begin", "1e3"], "the drive goes from 0 to"),
    ],
)
def test_a_wrong_argument_is_told_in_a_sentence_and_nothing_is_written(
    words, sentence, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main(["render", *words]) == 2
    assert sentence in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
