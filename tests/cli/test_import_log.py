"""The command ``motion-cueing import``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from motion_cueing.cli.import_log import ImportCommand, run
from motion_cueing.cli.main import main, parse
from motion_cueing.envs import CueTrace
from motion_cueing.envs.errors import ConfigurationError, DataError, MotionCueingError
from motion_cueing.envs.logs.signals import parse_columns

from ..envs.logs.synthetic_log import COLUMNS, Device, drive, write

TEXTS = [f"{signal}={column}" for signal, column in COLUMNS.items()]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write(tmp_path / "log.csv", Device(yaw=0.5).records(drive()))


def parsed(*arguments: str) -> ImportCommand:
    return parse("import", arguments)


def test_columns_once_or_repeated() -> None:
    once = parsed("log.csv", "--columns", "time=t:ms", "speed=v", "--out", "cues.csv")
    repeated = parsed("log.csv", "--columns", "time=t:ms", "--columns", "speed=v", "--out", "cues.csv")
    assert once.columns == ("time=t:ms", "speed=v")
    assert repeated.columns == ("time=t:ms", "speed=v")
    options = parsed(
        "log.csv", "--columns", "a=b", "--out", "x", "--gaps", "bridge", "--yaw-deg", "-90"
    ).conversion
    assert (options.gaps, options.yaw_deg) == ("bridge", -90.0)


def test_column_texts() -> None:
    columns, units = parse_columns(["time=t:ms", "force_x=-a:x:g", "speed=v"])
    assert columns == {"time": "t", "force_x": "-a:x", "speed": "v"}
    assert units == {"time": "ms", "force_x": "g"}
    for text in ("time", "time=", "tme=t"):
        with pytest.raises(MotionCueingError):
            parse_columns([text])
    with pytest.raises(ConfigurationError, match="'time' is given twice"):
        parse_columns(["time=t", "time=u"])


def test_files_and_findings(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, plot = tmp_path / "cues.csv.gz", tmp_path / "plot.png"
    arguments = [str(log), "--columns", *TEXTS, "--out", str(out), "--plot", str(plot), "--decimals", "4"]
    assert main(["import", *arguments]) == 0
    said = capsys.readouterr().out
    assert "yaw 28.6 deg" in said
    assert "no course" in said
    trace = CueTrace.from_csv(out)
    assert trace.name == "cues"
    assert trace.specific_force[:, 2].mean() == pytest.approx(-9.81, abs=1e-2)
    assert np.array_equal(np.round(trace.specific_force, 4), trace.specific_force)
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_a_log_without_speed_still_has_a_picture(log: Path, tmp_path: Path) -> None:
    plot = tmp_path / "plot.png"
    texts = [text for text in TEXTS if not text.startswith("speed")]
    arguments = [str(log), "--columns", *texts, "--out", str(tmp_path / "c.csv"), "--plot", str(plot)]
    assert run(parsed(*arguments, "--yaw-deg", "28.6")) == 0
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_bad_input_writes_nothing(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "cues.csv"
    cases = {
        "--decimals": (["--columns", *TEXTS, "--decimals", "-1"], "decimals is -1; use 0 to 15"),
        "column": (["--columns", "force_x=none"], "no column for force_x"),
        "name": (["--columns", "tim=t"], "Did you mean time"),
        "missing": (["--columns", *TEXTS[1:], "time=stamp"], "missing column stamp"),
        "cutoff": (["--columns", *TEXTS, "--cutoff-hz", "-1"], "--cutoff-hz must be greater than 0"),
    }
    for arguments, message in cases.values():
        assert main(["import", str(log), "--out", str(out), *arguments]) == 2
        captured = capsys.readouterr()
        assert message in captured.err
        assert "Traceback" not in captured.err
    assert not out.exists()


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--cutoff-hz", "0", "--cutoff-hz must be greater than 0, found 0"),
        ("--cutoff-hz", "nan", "--cutoff-hz must be a finite number, found nan"),
        ("--cutoff-hz", "50", "--cutoff-hz must be below half of --rate-hz, 50 Hz, found 50"),
        ("--rate-hz", "0", "--rate-hz must be greater than or equal to 2, found 0"),
        ("--rate-hz", "1e9", "--rate-hz must be less than or equal to 1000, found 1e9"),
        ("--rate-hz", "9", "--cutoff-hz must be below half of --rate-hz, 4.5 Hz, found 5.0"),
        ("--gravity-m-s2", "0", "--gravity-m-s2 must be greater than 0, found 0"),
    ],
)
def test_a_wrong_option_is_told_in_one_plain_line(
    option: str, value: str, message: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "cues.csv"
    assert main(["import", str(log), "--columns", *TEXTS, "--out", str(out), option, value]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert "pydantic" not in said
    assert "validation error" not in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("option", "target", "message"),
    [
        ("--plot", "plot.jpg", "does not end in .png"),
        ("--plot", "plot", "does not end in .png"),
        ("--plot", "file/plot.png", "is a file; name a folder"),
        ("--plot", "file/deeper/plot.png", "is a file; name a folder"),
        ("--plot", "folder.png", "is a folder"),
        ("--plot", "log.png", "is the log or the cues"),
        ("--out", "file/cues.csv", "is a file; name a folder"),
        ("--out", "folder.png", "is a folder"),
    ],
)
def test_targets_that_cannot_be_written_are_refused_first(
    option: str, target: str, message: str, log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "log.png").write_bytes(log.read_bytes())
    before = sorted(tmp_path.rglob("*"))
    paths = {"--out": tmp_path / "cues.csv", "--plot": tmp_path / "plot.png"} | {option: tmp_path / target}
    targets = [word for name, path in paths.items() for word in (name, str(path))]
    assert main(["import", str(tmp_path / "log.png"), "--columns", *TEXTS, *targets]) == 2
    said = capsys.readouterr().err
    assert f"{option} {tmp_path / target}" in said
    assert message in said
    assert sorted(tmp_path.rglob("*")) == before


def test_a_folder_without_permission_is_refused_first(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(folder: Path) -> None:
        if folder.name == "locked":
            raise PermissionError(13, "Permission denied", str(folder / "tmpname"))

    (tmp_path / "locked").mkdir()
    monkeypatch.setattr("motion_cueing.envs.storage.probe", denied)
    arguments = [str(log), "--columns", *TEXTS, "--out", str(tmp_path / "cues.csv")]
    with pytest.raises(DataError, match=r"--plot .*locked/plot.png cannot be written \(Permission"):
        run(parsed(*arguments, "--plot", str(tmp_path / "locked" / "plot.png")))
    assert not (tmp_path / "cues.csv").exists()


def test_the_log_is_never_overwritten(log: Path) -> None:
    before = log.read_bytes()
    with pytest.raises(ConfigurationError, match="is the log itself"):
        run(parsed(str(log), "--columns", *TEXTS, "--out", str(log)))
    assert log.read_bytes() == before
    with pytest.raises(DataError, match="cannot be read"):
        run(parsed("missing.csv", "--columns", *TEXTS, "--out", "cues.csv"))


def plain_log(path: Path, step: float = 0.01, separator: str = ",", header: bool = True) -> list[list[str]]:
    """Rows of a car that stands for 4 s, written to a file."""
    rows = [["t", "ax", "ay", "az", "p", "q", "r"]] if header else []
    rows += [[f"{step * i:g}", "0", "0", "-9.81", "0", "0", "0"] for i in range(400)]
    path.write_text("".join(separator.join(row) + "\n" for row in rows))
    return rows


PLAIN = ["time=t", "force_x=ax", "force_y=ay", "force_z=az", "rate_x=p", "rate_y=q", "rate_z=r"]


@pytest.mark.parametrize(
    ("how", "unit", "told"),
    [
        ({"step": 10.0}, "s", "is its unit s? It looks like ms (time=COLUMN:ms)"),
        ({"step": 1e4}, "s", "It looks like us"),
        (
            {"step": 0.01},
            "ms",
            "the steps of the time are 1e-05 s: is its unit ms? It looks like s",
        ),
        ({"header": False}, "s", "missing column t; found #1, #2"),
    ],
)
def test_a_log_of_another_kind_is_refused_with_what_to_do(how, unit, told, tmp_path, capsys) -> None:
    plain_log(tmp_path / "log.csv", **how)
    words = [f"time=t:{unit}", *PLAIN[1:]]
    out = tmp_path / "cues.csv"
    assert main(["import", str(tmp_path / "log.csv"), "--columns", *words, "--out", str(out)]) == 2
    assert told in capsys.readouterr().err


def test_complaints_name_the_options_of_the_command_line(tmp_path, capsys) -> None:
    log = tmp_path / "log.csv"
    rows = plain_log(log)
    words = ["import", str(log), "--columns", *PLAIN, "--out", str(tmp_path / "cues.csv")]
    rows[20][1] = "abc"
    log.write_text("".join(",".join(row) + "\n" for row in rows))
    assert main(words) == 2
    assert "line 21, column ax: 'abc' is no number" in capsys.readouterr().err
    del rows[20:120]
    log.write_text("".join(",".join(row) + "\n" for row in rows))
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "(--longest-step-s 0.2); set --gaps bridge, or leave it out with --start-s or --end-s" in said
    assert main([*words, "--gaps", "bridge"]) == 2
    assert "give --yaw-deg, or name a column" in capsys.readouterr().err
    assert main(["import", "nowhere.csv", *words[2:]]) == 2
    assert capsys.readouterr().err.endswith("nowhere.csv: cannot be read (there is no such file)\n")


def test_changes_are_printed_written_beside_the_cues_and_drawn(tmp_path, capsys, monkeypatch) -> None:
    table = Device(yaw=0.5).records(drive())
    table["ay"][1000] = 50.0
    out = tmp_path / "cues.csv.gz"
    words = ["import", str(write(tmp_path / "log.csv", table)), "--columns", *TEXTS, "--out", str(out)]
    assert main(words) == 2
    assert "set --spikes median" in capsys.readouterr().err
    assert not (tmp_path / "cues.findings.txt").exists()
    figures = []
    monkeypatch.setattr(
        "motion_cueing.evaluation.reporting.figures.png", lambda one: figures.append(one) or b""
    )
    assert main([*words, "--spikes", "median", "--plot", str(tmp_path / "plot.png")]) == 0
    change = "force_y is 50 m/s2 at data row 1001 (20.000 s)"
    assert change in capsys.readouterr().out
    assert change in (tmp_path / "cues.findings.txt").read_text()
    marks = [line for line in figures[0].axes[6].get_lines() if line.get_gid() == "changed"]
    assert [line.get_xdata()[0] for line in marks] == pytest.approx([20.0])


def test_findings_never_overwrite_the_log(tmp_path: Path) -> None:
    log = write(tmp_path / "cues.findings.txt", Device().records(drive()))
    with pytest.raises(ConfigurationError, match="findings would overwrite the log"):
        run(parsed(str(log), "--columns", *TEXTS, "--out", str(tmp_path / "cues.csv")))
