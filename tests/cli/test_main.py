"""The command line: exit status, one clear line for what is wrong, and never a traceback."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.baselines.washout import load_washout
from motion_cueing.cli import evaluate as evaluate_command
from motion_cueing.cli.__main__ import with_default
from motion_cueing.cli.evaluate import EvaluateCommand, command_line
from motion_cueing.cli.main import COMMANDS, main
from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import MotionCueingError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save, to_dict
from motion_cueing.evaluation.policies import policy_names
from motion_cueing.evaluation.reporting.text import file_names
from motion_cueing.evaluation.results import Results
from motion_cueing.evaluation.selection import find_maneuvers, find_policies
from motion_cueing.evaluation.suite import labels
from motion_cueing.evaluation.trajectory import Trajectory

from .synthetic import drive


@pytest.fixture
def simulator(monkeypatch):
    """A simulator that answers at once: its policies are gains, and `broken` fails."""

    def drive_with(name, platform, car):
        gains = {"no-motion": 0.0, "classical": 0.8}

        def work(cues):
            if cues.name == "fails":
                raise MotionCueingError("the road ends")
            return drive(gain=gains[name])

        return work

    monkeypatch.setattr(evaluate_command, "_drive_with", drive_with)
    monkeypatch.setattr(
        evaluate_command,
        "find_policies",
        lambda names, platform: {n: n for n in names or ["classical", "no-motion"]},
    )


@pytest.fixture
def cue_file(tmp_path):
    """A good cue CSV."""
    return write_cues(tmp_path / "bend.csv")


def write_cues(path):
    time = 0.01 * np.arange(50)
    force = np.tile([0.0, 0.0, -9.81], (50, 1))
    CueTrace("bend", time, force, np.zeros((50, 3))).to_csv(path)
    return path


def complaint(capsys, argv, status=2):
    """What the command line says on stderr: one line."""
    assert main([str(word) for word in argv]) == status
    text = capsys.readouterr().err
    assert "Traceback" not in text
    lines = [line for line in text.splitlines() if line.startswith("motion-cueing")]
    assert len(lines) == 1
    return lines[0]


def test_evaluate_writes_everything(simulator, cue_file, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["evaluate", "--maneuver", str(cue_file), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert {file.name for file in out.iterdir()} == {
        "results.json",
        "results.csv",
        "report.html",
        "bend.png",
        "ladder.csv",
        "ladder.md",
        "ladder.png",
        "trajectories",
    }
    results = Results.load_json(out / "results.json")
    assert list(results.maneuvers["bend"]) == ["classical", "no-motion"]
    assert results.provenance.command == f"motion-cueing evaluate --maneuver {cue_file} --out {out}"
    assert Trajectory.load(out / "trajectories" / "bend--classical.npz").maneuver == "bend"
    for text in ("classical is best", "bend", "perceived J", str(out)):
        assert text in shown


def test_a_maneuver_that_fails_leaves_the_others_and_exits_1(simulator, cue_file, tmp_path, capsys):
    fails, out = write_cues(tmp_path / "fails.csv"), tmp_path / "out"
    assert main(["evaluate", "--maneuver", str(fails), str(cue_file), "--out", str(out)]) == 1
    output = capsys.readouterr()
    assert "Traceback" not in output.out + output.err
    assert "the road ends" in output.out
    results = Results.load_json(out / "results.json")
    assert list(results.maneuvers) == ["bend"]
    assert {failure.maneuver for failure in results.failures} == {"fails"}
    assert "the road ends" in (out / "report.html").read_text()


def test_an_interrupt_ends_with_130(simulator, cue_file, tmp_path, monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(evaluate_command, "run_suite", interrupt)
    said = complaint(capsys, ["evaluate", "--maneuver", cue_file, "--out", tmp_path / "out"], 130)
    assert said == "motion-cueing evaluate: interrupted"


@pytest.mark.parametrize("name", ["compare", "robustness", "demonstrate"])
def test_after_an_interrupt_the_same_command_goes_on(name, monkeypatch, capsys):
    def interrupt(_):
        raise KeyboardInterrupt

    module = import_module(COMMANDS[name].module, "motion_cueing.evaluation")
    monkeypatch.setattr(module, "run", interrupt)
    done = "interrupted; drives that are done are kept, and the same command"
    assert complaint(capsys, [name], 130) == f"motion-cueing {name}: {done} goes on"
    if name != "demonstrate":
        assert complaint(capsys, [name, "--fresh"], 130).endswith(f"{done} without --fresh goes on")


PRESSED = """
import sys
class Pressed:
    def find_spec(self, name, path=None, target=None):
        if name == "motion_cueing.evaluation.metrics":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Pressed())
sys.argv[0] = sys.argv[1]
import motion_cueing.evaluation
"""


def test_an_interrupt_while_libraries_load_ends_the_command_line_and_no_other_program():
    def load(program):
        return subprocess.run([sys.executable, "-c", PRESSED, program], capture_output=True, text=True)

    for program in ("/usr/bin/motion-cueing", "-m"):
        ended = load(program)
        assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "")
    assert "KeyboardInterrupt" in load("mine.py").stderr


WRITE = {
    "evaluate": [],
    "frequency-response": ["--policy", "no-motion"],
    "compare": ["--policies", "no-motion"],
    "robustness": ["--policies", "no-motion"],
    "demonstrate": ["--policy", "no-motion", "--random", "1"],
    "train": ["--algo", "ppo"],
    "tune": ["classical"],
    "export": ["--policy", "learned-preview"],
    "render": [],
    "import": ["log.csv", "--column", "time=t"],
    "curves": ["run-1"],
}
"""What each command that writes needs beside its output."""
FILES = {"tune": "x.yaml", "export": "x.onnx", "render": "x.png", "import": "x.csv", "curves": "x.png"}


@pytest.mark.parametrize("name", WRITE)
def test_where_nothing_can_be_written_is_told_before_the_work(name, tmp_path, monkeypatch, capsys):
    def denied(folder):
        raise PermissionError(13, "Permission denied", str(folder))

    monkeypatch.chdir(tmp_path)
    (tmp_path / "afile").write_text("mine")
    option = "--onnx" if name == "export" else "--out"
    below = f"afile/{FILES.get(name, 'deep')}"
    assert "afile is a file; name a folder" in complaint(capsys, [name, *WRITE[name], option, below])
    with monkeypatch.context() as locked:
        locked.setattr("motion_cueing.envs.storage.probe", denied)
        there = FILES.get(name, "deep")
        said = complaint(capsys, [name, *WRITE[name], option, there])
        assert f"{option} {there} cannot be written (Permission denied); name another folder" in said
    assert [path.name for path in tmp_path.iterdir()] == ["afile"]


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("evaluate", "results.json"),
        ("frequency-response", "frequency-response.json"),
        ("compare", "study.json"),
        ("robustness", "study.json"),
    ],
)
@pytest.mark.parametrize("content", ["hello", "[]", '{"schema": 1}'])
def test_the_files_of_others_are_not_replaced(name, file, content, tmp_path, capsys):
    (tmp_path / file).write_text(content)
    said = complaint(capsys, [name, *WRITE[name], "--out", tmp_path])
    assert f"{tmp_path / file} was not written by this command; move it away, or name another --out" in said
    assert (tmp_path / file).read_text() == content


def test_a_file_is_not_labeled_as_the_policy_that_ships():
    names = ["my/classical-tuned.yaml", "classical-tuned", "your/classical-tuned.yml", "mine.yaml"]
    stems = [name.rpartition("/")[2].partition(".")[0] for name in names]
    assert list(labels(names, stems, policy_names()).values()) == [
        "classical-tuned-2",
        "classical-tuned",
        "classical-tuned-3",
        "mine",
    ]
    assert labels(["classical-tuned.yaml"], ["classical-tuned"], policy_names()) == {
        "classical-tuned.yaml": "classical-tuned-2"
    }


def test_the_share_refers_to_the_policy_that_ships(tmp_path):
    mine = tmp_path / "classical-tuned.yaml"
    save(load_washout("classical"), mine)
    assert find_policies([str(mine), "optimum"], get_platform("paper")) == {
        "classical-tuned-2": str(mine),
        "optimum": "optimum",
    }


IMPORT = ("import", "log.csv", "--column", "time=t", "--out", "cues.csv")


@pytest.mark.parametrize(
    ("argv", "told"),
    [
        (["evalute"], "unknown command 'evalute'. Did you mean evaluate or serve?"),
        (["evaluate", "--polcy", "x"], "Did you mean --policy?"),
        (["evaluate", "--out"], "--out"),
        (["evaluate", "stray"], "stray"),
        (["evaluate", "--policy", "a", "--policy", "b"], "--policy is given 2 times"),
        (["evaluate", "--maneuver"], "--maneuver needs at least one name"),
        (["evaluate", "--policy"], "--policy needs at least one name"),
        (["evaluate", "--policy", "--paper"], "--policy needs at least one name"),
        (["evaluate", "--policy", ""], "--policy: a name is empty"),
        (["evaluate", "--policy="], "--policy: a name is empty"),
        (["evaluate", "--maneuver", "hill", ""], "--maneuver: a name is empty"),
        (["evaluate", "--platform", ""], "--platform: a name is empty"),
        (["evaluate", "--car", ""], "--car: a name is empty"),
        (["evaluate", "--paper", "--car", "bmw-320i"], "--paper has its own cases"),
        (["evaluate", "--policy", "no-moton"], "unknown policy 'no-moton'. Did you mean no-motion"),
        (
            ["evaluate", "--maneuver", "steady-trun"],
            "unknown maneuver 'steady-trun'. Did you mean",
        ),
        (["evaluate", "--platform", "papr"], "unknown platform 'papr'. Did you mean paper?"),
        (["evaluate", "--car", "sedna"], "unknown car 'sedna'. Did you mean sedan?"),
        (["evaluate", "--maneuver", "missing.csv"], "missing.csv: there is no such file"),
        (["evaluate", "--platform", "missing.yaml"], "missing.yaml: there is no such file"),
        (["evaluate", "--policy", "missing.yaml"], "missing.yaml: there is no such file"),
        (["render", "--begin", "noon", "--out", "a.png"], "--begin takes a number, found 'noon'. See"),
        (
            ["render", "--size", "9", "x", "--out", "a.png"],
            "--size takes 2 whole numbers, found '9' 'x'. See",
        ),
        (["render", "--out", "a.png", "--rate"], "--rate needs a value after it. See"),
        (["render", "--begin", "1"], "render: --out must be given. See"),
        (["render", "--camera", "3"], "render: --out must be given. Unrecognized options: --camera 3. See"),
        (["import"], "import: PATH, --out must be given. See"),
        ([*IMPORT, "--cutoff-hz", "low"], "import: --cutoff-hz takes a number, found 'low'. See"),
        ([*IMPORT, "--decimals", "1.5"], "--decimals takes a whole number, found '1.5'. See"),
        ([*IMPORT, "--rate-bias-deg-s", "1", "2", "x"], "takes 3 numbers, found '1' '2' 'x'. See"),
        ([*IMPORT, "--gaps", "jump"], "invalid choice 'jump' for argument '--gaps'"),
    ],
)
def test_bad_arguments_exit_2_with_one_line(argv, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert told in complaint(capsys, argv)


@pytest.mark.parametrize("encoding", ["ascii", "utf-8"])
def test_the_line_holds_nothing_of_a_frame(encoding):
    code = (
        "from motion_cueing.evaluation.command_line import main; main(['evaluate', '--polcy', 'no-motion'])"
    )
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.stderr == (
        "motion-cueing evaluate: Unrecognized options: --polcy, no-motion. Did you mean --policy? "
        "See `motion-cueing evaluate --help`\n"
    )


def test_the_label_of_a_compressed_file_is_its_stem(tmp_path):
    for name in ("bend.csv.gz", "bend.v2.csv"):
        write_cues(tmp_path / name)
        (label,) = find_maneuvers([str(tmp_path / name)], get_car("sedan"))
        assert label == CueTrace.from_csv(tmp_path / name).name == name.partition(".csv")[0]


def test_maneuvers_with_like_names_have_their_own_files(simulator, tmp_path):
    files = [write_cues(tmp_path / name) for name in ("a b.csv", "a_b.csv", "A b.csv")]
    out = tmp_path / "out"
    argv = ["evaluate", "--policy", "classical", "--out", out, "--maneuver", *files]
    assert main([str(word) for word in argv]) == 0
    assert {file.name for file in out.glob("*.png")} == {"a_b.png", "a_b_2.png", "A_b_3.png"}
    driven = {
        label: Trajectory.load(out / "trajectories" / f"{name}--classical.npz").policy
        for label, name in file_names(["a b", "a_b", "A b"]).items()
    }
    assert list(driven) == ["a b", "a_b", "A b"]


@given(st.lists(st.text(), unique=True), st.lists(st.text(), unique=True))
def test_no_two_drives_share_a_file(maneuvers, policies):
    first, second = file_names(maneuvers), file_names(policies)
    pairs = [f"{a}--{b}".casefold() for a in first.values() for b in second.values()]
    assert len(set(pairs)) == len(maneuvers) * len(policies)
    assert all(re.fullmatch(r"[\w.+-]+", name) for name in first.values())


HEADER = (
    "time_s,specific_force_x_m_s2,specific_force_y_m_s2,specific_force_z_m_s2,"
    "angular_velocity_x_rad_s,angular_velocity_y_rad_s,angular_velocity_z_rad_s\n"
)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "empty"),
        (HEADER, "empty"),
        ("time_s,specific_force_x_m_s2\n0,1\n1,2\n", "missing column specific_force_y_m_s2"),
        (
            HEADER + "0,0,0,-9.81,0,0,0\n0.1,nan,0,-9.81,0,0,0\n",
            "line 3, column specific_force_x_m_s2: not a",
        ),
        (HEADER + "0,0,0,-9.81,0,0,0\n\n0.1,0,0,inf,0,0,0\n", "line 4, column specific_force_z_m_s2: not a"),
        (
            HEADER + "0,0,0,-9.81,0,0,0\n0.1,1e9,0,0,0,0,0\n",
            "x_m_s2: 1e+09 is beyond 1000 m/s^2, which no car",
        ),
        (
            HEADER + "0,0,0,-9.81,0,-300,0\n0.1,0,0,0,0,0,0\n",
            "line 2, column angular_velocity_y_rad_s: -300 is",
        ),
        (HEADER + "0.1,0,0,-9.81,0,0,0\n0,0,0,-9.81,0,0,0\n", "time does not increase at sample 1"),
        (HEADER + "0,0,0,-9.81,0,0,0\n0.1,0,0\n", "line 3 has 3 cells"),
        (HEADER + "0,0,0,-9.81,0,0,0\n0.1,x,0,-9.81,0,0,0\n", "could not convert string to float"),
    ],
)
def test_bad_cues_exit_2_before_anything_is_driven(content, told, tmp_path, capsys):
    path = tmp_path / "cues.csv"
    path.write_text(content)
    said = complaint(capsys, ["evaluate", "--maneuver", path, "--out", tmp_path / "out"])
    assert told in said
    assert "cues" in said
    assert not (tmp_path / "out").exists()


def upside_down():
    """The paper's machine with a height whose sign is wrong."""
    values = to_dict(get_platform("paper"))
    values["hexapod"]["neutral"][2] *= -1.0
    return yaml.safe_dump(values)


def coinciding():
    """The paper's machine with a platform that is a point."""
    values = to_dict(get_platform("paper"))
    values["hexapod"]["upper_joints"] = [[0.0, 0.0, 0.0]] * 6
    return yaml.safe_dump(values)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("name: x\ndescription: y\nhexapd: {}\n", "unknown field 'hexapd'. Did you mean hexapod?"),
        ("name: [", "not YAML"),
        ("- 1\n", "expected fields of Platform"),
        (upside_down(), "machine.yaml: hexapod.neutral: with z = 2.4396 the platform lies below its base"),
        (coinciding(), "machine.yaml: hexapod.upper_joints: all joints lie in the origin of F_H; give"),
    ],
)
def test_bad_platform_files_exit_2(content, told, tmp_path, capsys):
    path = tmp_path / "machine.yaml"
    path.write_text(content)
    assert told in complaint(capsys, ["evaluate", "--platform", path, "--out", tmp_path / "out"])


def test_an_output_folder_that_is_a_file_is_refused(tmp_path, capsys):
    (tmp_path / "taken").write_text("")
    assert "is a file; name a folder" in complaint(capsys, ["evaluate", "--out", tmp_path / "taken"])


def test_list_shows_every_kind(capsys):
    assert main(["list"]) == 0
    shown = capsys.readouterr().out
    for name in ("no-motion", "steady-turn", "city-drive", "paper", "sedan"):
        assert name in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name, capsys):
    assert main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"usage: motion-cueing {name}" in shown
    assert "None" not in shown
    assert "(default: )" not in shown


def test_overview_and_version(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in COMMANDS)
    assert main([]) == 2
    capsys.readouterr()
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("motion-cueing 0.")


def test_the_module_evaluates_by_default():
    assert with_default([]) == ["evaluate"]
    assert with_default(["--policy", "x"]) == ["evaluate", "--policy", "x"]
    assert with_default(["list"]) == ["list"]
    assert with_default(["--help"]) == ["--help"]


def test_the_recorded_command_gives_the_same_command():
    import tyro

    command = EvaluateCommand(policy=("a", "b"), maneuver=("hill",), car="volvo-v40")
    words = command_line(command)
    assert words[:2] == ("motion-cueing", "evaluate")
    assert tyro.cli(EvaluateCommand, args=list(words[2:])) == command
    assert command_line(EvaluateCommand()) == ("motion-cueing", "evaluate")


def test_help_and_evaluate_do_not_import_torch():
    script = (
        "import sys; from motion_cueing.cli.main import main; "
        "main(['evaluate', '--help']); sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", script], capture_output=True).returncode == 0


def test_results_are_json_for_other_tools(simulator, cue_file, tmp_path):
    main(["evaluate", "--maneuver", str(cue_file), "--out", str(tmp_path / "out")])
    values = json.loads((tmp_path / "out" / "results.json").read_text())
    assert values["maneuvers"]["bend"]["classical"]["cue_error"] > 0.0
