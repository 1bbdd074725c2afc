"""The command line: exit status, one clear line for what is wrong, and never a traceback."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from motion_cueing.baselines.washout import load_washout
from motion_cueing.cli import arguments
from motion_cueing.cli import evaluate as evaluate_command
from motion_cueing.cli.__main__ import with_default
from motion_cueing.cli.arguments import find_maneuvers, find_policies
from motion_cueing.cli.evaluate import EvaluateCommand
from motion_cueing.cli.main import COMMANDS, main, parse
from motion_cueing.envs.car import get_car
from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.errors import MotionCueingError
from motion_cueing.envs.platform import get_platform
from motion_cueing.envs.settings import save, to_dict
from motion_cueing.evaluation.policies import policy_names
from motion_cueing.evaluation.reporting.text import file_names, words_of
from motion_cueing.evaluation.results import Results
from motion_cueing.evaluation.suite import labels
from motion_cueing.evaluation.trajectory import Trajectory

from ..evaluation.synthetic import drive

pytestmark = pytest.mark.slow


@pytest.fixture
def simulator(monkeypatch):
    """A simulator that answers at once: its policies are gains, and `broken` fails."""

    def work(gain, platform, car, cues):
        if cues.name == "fails":
            raise MotionCueingError("the road ends")
        return drive(gain=gain)

    gains = {"classical": 0.8, "no-motion": 0.0}
    monkeypatch.setattr(evaluate_command, "_drive", work)
    monkeypatch.setattr(arguments, "make_policy", lambda name, platform: gains[name])
    monkeypatch.setattr(
        arguments, "find_policies", lambda names, platform: {name: name for name in names or gains}
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
    assert main(["evaluate", "--maneuvers", str(cue_file), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert {file.name for file in out.iterdir()} == {
        "results.json",
        "results.csv",
        "report.html",
        "benchmark.csv",
        "benchmark.md",
        "trajectories",
    }
    results = Results.load_json(out / "results.json")
    assert list(results.maneuvers["bend"]) == ["classical", "no-motion"]
    assert results.provenance.command == f"motion-cueing evaluate --maneuvers {cue_file} --out {out}"
    assert Trajectory.load(out / "trajectories" / "bend--classical.npz").maneuver == "bend"
    for text in ("classical is best", "bend", "perceived J", str(out)):
        assert text in shown


@pytest.mark.usefixtures("undrawn")
def test_a_maneuver_that_fails_leaves_the_others_and_exits_1(simulator, cue_file, tmp_path, capsys):
    fails, out = write_cues(tmp_path / "fails.csv"), tmp_path / "out"
    assert main(["evaluate", "--maneuvers", str(fails), str(cue_file), "--out", str(out)]) == 1
    output = capsys.readouterr()
    assert "Traceback" not in output.out + output.err
    assert "the road ends" in output.out
    results = Results.load_json(out / "results.json")
    assert list(results.maneuvers) == ["bend"]
    assert {failure.maneuver for failure in results.failures} == {"fails"}
    assert "the road ends" in (out / "report.html").read_text()


def test_an_interrupt_ends_with_130(simulator, cue_file, tmp_path, monkeypatch, capsys):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("motion_cueing.evaluation.suite.run_suite", interrupt)
    said = complaint(capsys, ["evaluate", "--maneuvers", cue_file, "--out", tmp_path / "out"], 130)
    assert said == "motion-cueing evaluate: interrupted"


@pytest.mark.parametrize("name", ["compare", "robustness", "demonstrate"])
def test_after_an_interrupt_the_same_command_goes_on(name, monkeypatch, capsys):
    def interrupt(_):
        raise KeyboardInterrupt

    module = import_module(COMMANDS[name].module, "motion_cueing.cli")
    monkeypatch.setattr(module, COMMANDS[name].run, interrupt)
    done = "interrupted; what is done is kept, and the same command"
    assert complaint(capsys, [name], 130) == f"motion-cueing {name}: {done} goes on"
    assert complaint(capsys, [name, "--fresh"], 130).endswith(f"{done} without --fresh goes on")


def test_an_interrupt_while_libraries_load_is_no_traceback(monkeypatch, capsys):
    def pressed(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("motion_cueing.cli.main.import_module", pressed)
    assert complaint(capsys, ["list"], 130) == "motion-cueing list: interrupted"


WRITE = {
    "evaluate": [],
    "frequency-response": ["--policies", "no-motion"],
    "compare": ["--policies", "no-motion"],
    "robustness": ["--policies", "no-motion"],
    "demonstrate": ["--policy", "no-motion", "--drives", "1"],
    "train": ["--algorithm", "ppo"],
    "tune": ["--algorithm", "classical"],
    "export": ["--policy", "learned-preview"],
    "render": [],
    "import": ["log.csv", "--columns", "time=t"],
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
    option = "--out"
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


IMPORT = ("import", "log.csv", "--columns", "time=t", "--out", "cues.csv")


@pytest.mark.parametrize(
    ("argv", "told"),
    [
        (["evalute"], "unknown command 'evalute'. Did you mean evaluate or serve?"),
        (["evaluate", "--polcies", "x"], "unknown option --polcies. Did you mean --policies?"),
        (["evaluate", "--out"], "--out needs a value after it"),
        (["evaluate", "stray"], "'stray' belongs to no option"),
        (["evaluate", "--policy", "a"], "--policy is called --policies now."),
        (["evaluate", "--maneuver=hill"], "--maneuver is called --maneuvers now."),
        (["evaluate", "--policies", "ladder"], "unknown policy 'ladder'; it is called 'benchmark' now"),
        (
            ["evaluate", "--policies", "classical-ceiling"],
            "unknown policy 'classical-ceiling'; it is called 'classical-per-maneuver' now",
        ),
        (["robustness", "--fierceness", "2"], "--fierceness is called --time-scaling now"),
        (["evaluate", "--paper"], "--paper is a command of its own now: motion-cueing paper."),
        (["evaluate", "--car", "sedan", "--car", "bmw-320i"], "--car is given more than once; give it once"),
        (["evaluate", "--maneuvers"], "--maneuvers needs at least one value"),
        (["evaluate", "--policies", "--car", "sedan"], "--policies needs at least one value"),
        (["evaluate", "--policies", ""], "policy: a name is empty"),
        (["evaluate", "--policies="], "policy: a name is empty"),
        (["evaluate", "--maneuvers", "hill", ""], "maneuver: a name is empty"),
        (["evaluate", "--platform", ""], "platform: a name is empty"),
        (["evaluate", "--car", ""], "car: a name is empty"),
        (["export", "--policy", "learned", "--onnx", "a.onnx"], "--onnx is called --out now"),
        (["export", "--policy", "classical", "--out", "a.onnx"], "no trained network"),
        (["export", "--policy", "lerned", "--out", "a.onnx"], "unknown agent 'lerned'. Did you mean learned"),
        (["demonstrate", "--random", "1"], "--random is called --drives now"),
        (["endure", "--only", "1"], "--only is called --seeds now"),
        (["tune", "--algorithm", "classical", "--threads", "2"], "--threads is called --workers now"),
        (["render", "--policies", "a", "--out", "a.png"], "--policies is called --policy here"),
        (["evaluate", "--policies", "no-moton"], "unknown policy 'no-moton'. Did you mean no-motion"),
        (
            ["evaluate", "--maneuvers", "steady-trun"],
            "unknown maneuver 'steady-trun'. Did you mean",
        ),
        (["evaluate", "--platform", "papr"], "unknown platform 'papr'. Did you mean paper?"),
        (["evaluate", "--car", "sedna"], "unknown car 'sedna'. Did you mean sedan?"),
        (["evaluate", "--maneuvers", "missing.csv"], "missing.csv: there is no such file"),
        (["evaluate", "--platform", "missing.yaml"], "missing.yaml: there is no such file"),
        (["evaluate", "--policies", "missing.yaml"], "missing.yaml: there is no such file"),
        (["render", "--begin", "noon", "--out", "a.png"], "--begin takes a number, found 'noon'. See"),
        (
            ["render", "--size", "9", "x", "--out", "a.png"],
            "--size takes 2 whole numbers, found '9 x'. See",
        ),
        (["render", "--out", "a.png", "--rate"], "--rate needs a value after it. See"),
        (["render", "--begin", "1"], "render: --out must be given"),
        (["render", "--camera", "3"], "render: unknown option --camera. Did you mean --car? See"),
        (["import"], "import: --file must be given"),
        ([*IMPORT, "--cutoff-hz", "low"], "import: --cutoff-hz takes a number, found 'low'. See"),
        ([*IMPORT, "--decimals", "1.5"], "--decimals takes a whole number, found '1.5'. See"),
        ([*IMPORT, "--rate-bias-deg-s", "1", "2", "x"], "takes 3 numbers, found 'x'. See"),
        ([*IMPORT, "--gaps", "jump"], "--gaps takes one of refuse, bridge, found 'jump'. See"),
    ],
)
def test_bad_arguments_exit_2_with_one_line(argv, told, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert told in complaint(capsys, argv)


def test_the_label_of_a_compressed_file_is_its_stem(tmp_path):
    for name in ("bend.csv.gz", "bend.v2.csv"):
        write_cues(tmp_path / name)
        (label,) = find_maneuvers([str(tmp_path / name)], get_car("sedan"))
        assert label == CueTrace.from_csv(tmp_path / name).name == name.partition(".csv")[0]


@pytest.mark.usefixtures("undrawn")
def test_maneuvers_with_like_names_have_their_own_files(simulator, tmp_path):
    files = [write_cues(tmp_path / name) for name in ("a b.csv", "a_b.csv", "A b.csv")]
    out = tmp_path / "out"
    argv = ["evaluate", "--policies", "classical", "--figures", "--out", out, "--maneuvers", *files]
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
        (
            HEADER + "0,0,0,-9.81,0,0,0\n0.1,x,0,-9.81,0,0,0\n",
            "line 3, column specific_force_x_m_s2: 'x' is no number",
        ),
    ],
)
def test_bad_cues_exit_2_before_anything_is_driven(content, told, tmp_path, capsys):
    path = tmp_path / "cues.csv"
    path.write_text(content)
    said = complaint(capsys, ["evaluate", "--maneuvers", path, "--out", tmp_path / "out"])
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
    for name in ("no-motion", "steady-turn", "city-drive", "paper", "sedan", "dagger"):
        assert name in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name, capsys):
    assert main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"Usage: motion-cueing {name}" in shown
    assert f"Example:\n  motion-cueing {name}" in shown
    assert "Next: " in shown
    assert "None" not in shown
    assert "[default: ]" not in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_of_a_command_is_one(name):
    assert parse(name, shlex.split(COMMANDS[name].example)) is not None


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
    assert with_default(["--policies", "x"]) == ["evaluate", "--policies", "x"]
    assert with_default(["list"]) == ["list"]
    assert with_default(["--help"]) == ["--help"]


def test_the_recorded_command_gives_the_same_command():
    command = EvaluateCommand(policies=("a", "b"), maneuvers=("hill",), car="volvo-v40")
    words = words_of("evaluate", command)
    assert words[:2] == ["motion-cueing", "evaluate"]
    assert parse("evaluate", words[2:]) == command
    assert words_of("evaluate", EvaluateCommand()) == ["motion-cueing", "evaluate"]
    assert parse("evaluate", []) == EvaluateCommand()


def test_whole_numbers_may_have_an_exponent():
    assert parse("train", ["--steps", "1e6"]).steps == 1_000_000


HEAVY = {"casadi", "matplotlib", "scipy", "torch", "warp"}


@pytest.mark.parametrize("words", [["--help"], ["benchmark", "--help"], ["train", "--polcy"], ["evalute"]])
def test_help_and_complaints_import_no_heavy_library(words):
    script = f"import sys; from motion_cueing.cli.main import main; main({words}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not HEAVY & set(done.stdout.splitlines()[-1].split())


WITHOUT_EXTRAS = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in ("casadi", "daqp", "moviepy", "msgpack", "onnx", "stable_baselines3", "torch"):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Missing())
from motion_cueing.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def test_policies_are_evaluated_without_any_extra(cue_file, tmp_path):
    out = tmp_path / "out"
    words = ["evaluate", "--maneuvers", str(cue_file), "--out", str(out)]
    command = [sys.executable, "-c", WITHOUT_EXTRAS, *words, "--policies", "linear-washout", "learned"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "learned" in json.loads((out / "results.json").read_text())["maneuvers"]["bend"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_is_told_what_there_is(shell, capsys):
    assert main(["--print-completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(word in script for word in [*COMMANDS, "policies", "maneuvers", "fresh"])
    assert main(["--print-completion", "tcsh"]) == 2
    assert "unknown shell 'tcsh'" in capsys.readouterr().err


@pytest.mark.skipif(sys.version_info < (3, 11), reason="Cyclopts 4, for Python 3.10, completes no names")
def test_a_shell_asks_for_names(capsys):
    assert main(["__complete", "evaluate", "--policies", ""]) == 0
    assert "classical-tuned\tclassical at its best" in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_results_are_json_for_other_tools(simulator, cue_file, tmp_path):
    main(["evaluate", "--maneuvers", str(cue_file), "--out", str(tmp_path / "out")])
    values = json.loads((tmp_path / "out" / "results.json").read_text())
    assert values["maneuvers"]["bend"]["classical"]["cue_error"] > 0.0


@pytest.mark.parametrize("words", [["help", "evaluate"], ["-h", "evaluate"], ["--help", "evaluate"]])
def test_help_of_a_command_is_found_either_way(words, capsys):
    assert main(words) == 0
    found = capsys.readouterr().out
    assert main(["evaluate", "--help"]) == 0
    assert found == capsys.readouterr().out


def test_help_without_a_command_is_the_overview_and_of_no_command_a_complaint(capsys):
    assert main(["help"]) == 0
    assert "commands:" in capsys.readouterr().out
    assert main(["help", "evalute"]) == 2
    assert "Did you mean evaluate" in capsys.readouterr().err


def test_the_help_of_a_command_without_options_shows_none(capsys):
    assert main(["list", "--help"]) == 0
    assert "LISTCOMMAND" not in capsys.readouterr().out.upper()


@pytest.mark.usefixtures("undrawn")
def test_means_say_over_how_many_drives_they_are(simulator, cue_file, tmp_path, capsys):
    words = [
        "evaluate",
        "--policies",
        "classical",
        "no-motion",
        "--out",
        str(tmp_path / "out"),
        "--maneuvers",
    ]
    assert main([*words, str(cue_file)]) == 0
    assert "One drive" in capsys.readouterr().out
    second = tmp_path / "second.csv"
    second.write_bytes(cue_file.read_bytes())
    assert main([*words, str(cue_file), str(second)]) == 0
    told = capsys.readouterr().out
    assert "All 2 drives" in told
    assert "Over all 2 drives:" in told
    assert "whole suite" not in told
