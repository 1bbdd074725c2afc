"""``motion-cueing identify`` from a file to a motion base that ``--compensate`` can use."""

import pytest

from motion_cueing.cli.main import main
from motion_cueing.envs.platform import load_platform
from motion_cueing.envs.platform.machines import ActuatorDynamics

from ..envs.platform.motion_logs import simulated, write

LATE = ActuatorDynamics(natural_frequency=40.0, dead_time=0.03)


def test_a_log_becomes_a_motion_base(tmp_path, capsys):
    log, out = tmp_path / "motion.csv", tmp_path / "mine.yaml"
    write(log, *simulated(LATE, seconds=12.0))
    assert main(["identify", str(log), "--subsystems", "carriage", "hexapod", "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "hexapod" in shown
    assert "turntable" not in shown
    mine = load_platform(out)
    assert mine.name == "mine"
    for part in (mine.carriage, mine.hexapod):
        assert part.dynamics.lateness == pytest.approx(LATE.lateness, abs=1e-3)
    assert mine.turntable.dynamics == ActuatorDynamics()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["none.csv"], "none.csv: there is no such file"),
        (["none.csv", "--out", "mine.txt"], "--out mine.txt: a motion base's file ends in .yaml"),
        (["none.csv", "--columns", "time=t:h"], "unit 'h' of time is unknown"),
    ],
)
def test_wrong_words_get_one_sentence(words, sentence, capsys):
    assert main(["identify", *words]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("motion-cueing identify: ")
    assert sentence in complaint
    assert complaint.count("\n") == 1
