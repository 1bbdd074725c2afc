"""``motion-cueing frequency-response``: what it writes, reads again, and refuses."""

from __future__ import annotations

import csv

import pytest

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.evaluation.command_line import main
from motion_cueing.evaluation.frequency_tables import load_json, response_table


def test_the_command_writes_everything_and_reads_it_again(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["frequency-response", "--policy", "no-motion", "classical", "--frequencies", "15.0", "9.0"]
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
    table = response_table(found[1])
    assert table.header == ("rad/s", "9", "15")
    assert [row[0].split(",")[0] for row in table.rows[::2]] == ["f_y", "w_z", "f_y to w_x"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--policy", "classikal"], "classical"),
        (["--policy", "classical", "--axes", "f_w"], "unknown axis"),
        (["--policy", "classical", "--amplitude", "0"], "--amplitude"),
        (["--policy", "classical", "--frequencies", "1000"], "frequencies"),
        ([], "policy"),
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
