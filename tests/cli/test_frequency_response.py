"""``motion-cueing frequency-response``: what it writes, reads again, and refuses."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.evaluation import policies
from motion_cueing.evaluation.frequency_response import reporting as frequency_figure
from motion_cueing.evaluation.frequency_response.reporting import amplitudes, load_json, response_table
from motion_cueing.evaluation.frequency_response.response import FrequencyResponse, FrequencyTest, Sinusoid
from motion_cueing.evaluation.metrics import CUE_AXES

pytestmark = pytest.mark.slow


def test_the_command_writes_everything_and_reads_it_again(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["frequency-response", "--policies", "no-motion", "classical", "--frequencies", "15.0", "9.0"]
    assert (
        main([*argv, "--axes", "f_y", "w_z", "--amplitude", "0.5", "--settling", "1", "--out", str(out)]) == 0
    )
    shown = capsys.readouterr().out
    assert "classical on paper, 0.5 of the test's amplitudes" in shown
    names = {"bode.png", "matrix.png", "frequency-response.csv", "frequency-response.json"}
    assert {file.name for file in out.iterdir()} == names
    found = load_json(out / "frequency-response.json")
    assert [one.policy for one in found] == ["no-motion", "classical"]
    assert found[1].inputs == ("f_y", "w_z")
    assert len(found[1].sinusoids) == 4
    rows = list(csv.DictReader((out / "frequency-response.csv").open()))
    assert len(rows) == 2 * 4 * 6
    assert {row["phase_rad"] for row in rows if row["policy"] == "no-motion"} == {""}
    table = response_table(found[1])
    assert table.header == ("rad/s", "9", "15")
    assert [row[0].split(",")[0] for row in table.rows[::2]] == ["f_y", "w_z", "f_y to w_x"]


def quick(*policies):
    return [
        "frequency-response",
        "--policies",
        *policies,
        "--frequencies",
        "15",
        "--axes",
        "f_y",
        "--settling",
        "0",
    ]


class Tired:
    """Fails on the way."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        raise RuntimeError("tired")


@pytest.fixture
def benchmark(monkeypatch):
    """A benchmark of three: one that can be tested, one that knows its drives alone, one that fails."""
    monkeypatch.setattr(
        "motion_cueing.evaluation.benchmark.table.benchmark_policies",
        lambda known: ["no-motion", "classical-per-maneuver", "adaptive"],
    )
    made = policies.make_policy
    monkeypatch.setattr(
        policies, "make_policy", lambda name, machine: Tired() if name == "adaptive" else made(name, machine)
    )


@pytest.mark.usefixtures("undrawn")
def test_the_benchmark_skips_what_knows_no_sinusoids_and_goes_on_after_a_failure(benchmark, tmp_path, capsys):
    assert main([*quick("benchmark"), "--out", str(tmp_path)]) == 1
    shown = capsys.readouterr().out
    assert "skipped classical-per-maneuver: classical-per-maneuver has a set for each" in shown
    assert "failed adaptive: Tired raised RuntimeError: tired at step 1" in shown
    assert [one.policy for one in load_json(tmp_path / "frequency-response.json")] == ["no-motion"]


def test_a_policy_that_knows_no_sinusoids_is_refused_before_anything_is_measured(tmp_path, capsys):
    assert main([*quick("no-motion", "classical-per-maneuver"), "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "none for sinusoids" in told
    assert "classical-tuned" in told
    assert not (tmp_path / "out").exists()


def response(policy, modulus, phase):
    sizes, phases = dict.fromkeys(CUE_AXES, modulus), dict.fromkeys(CUE_AXES, phase)
    found = [Sinusoid("f_y", w, 1.0, sizes, phases, 1.0, 0.0) for w in (1.0, 2.0)]
    return FrequencyResponse(policy, "paper", FrequencyTest(frequencies=(1.0, 2.0)), tuple(found))


def test_figures_say_what_was_not_measured_and_what_gives_nothing(monkeypatch):
    drawn = []
    monkeypatch.setattr(frequency_figure, "png", lambda figure: drawn.append(figure) or b"")
    responses = [response("no-motion", 0.0, None), response("mine", 0.8, 0.1)]
    frequency_figure.bode_figure(responses)
    frequency_figure.matrix_figure(responses)
    bode, matrix = drawn
    told = [[text.get_text() for text in axes.texts] for axes in bode.axes]
    assert [bool(texts) for texts in told] == [i not in (1, 4) for i in range(12)]
    assert len(matrix.axes) == 6
    lines = [line.get_ydata() for line in bode.axes[1].lines[1:]]
    assert np.isnan(lines[0]).all()
    np.testing.assert_allclose(lines[1], 0.8)
    for figure in drawn:
        labels = [text.get_text() for text in figure.legends[0].get_texts()]
        assert labels == ["no-motion: nothing comes through", "mine"]


def test_a_phase_of_almost_nothing_has_no_sign():
    row = response_table(response("mine", 1.0, -1e-3)).rows[1]
    assert row[1:] == ("0", "0")


def test_titles_say_how_large_the_inputs_are():
    assert amplitudes(1.0) == "the test's amplitudes"
    assert amplitudes(0.01) == "0.01 of the test's amplitudes"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--policies", "classikal"], "classical"),
        (["--policies", "classical", "--axes", "f_w"], "unknown axis"),
        (["--policies", "classical", "--amplitude", "0"], "--amplitude"),
        (["--policies", "classical", "--frequencies", "1000"], "frequencies"),
        ([], "--policies must be given"),
    ],
)
def test_wrong_arguments_are_told_in_one_line(words, told, capsys):
    assert main(["frequency-response", *words]) == 2
    assert told in capsys.readouterr().err


def test_another_version_is_refused(tmp_path):
    path = tmp_path / "x.json"
    for content in ("", '{"schema": 9}', "[]", "null"):
        path.write_text(content)
        with pytest.raises(DataError):
            load_json(path)


def test_what_is_missing_in_a_file_is_told(tmp_path):
    path = tmp_path / "x.json"
    path.write_text('{"schema": 1, "command": "", "versions": {}}')
    with pytest.raises(ConfigurationError, match="responses"):
        load_json(path)
