"""The report of a run: what it says, and that files of before are read."""

from __future__ import annotations

import json

import pytest

from motion_cueing.envs.errors import DataError
from motion_cueing.realtime import State
from motion_cueing.realtime.report import SCHEMA, LoopReport, report_of, show, summary_lines, timing_table
from motion_cueing.realtime.timing import Histogram, Pace, TimingSummary


class Run:
    """The results of a server or a client, made by hand."""

    def __init__(self) -> None:
        self.duration, self.pace = 1.5, Pace(1000)
        self.pace.overrun, self.pace.skipped = 3, 1
        self.timings = {"wake": Histogram(), "latency": Histogram()}
        for microseconds in (1, 2, 3, 10):
            self.timings["wake"].add(1000 * microseconds)


@pytest.fixture
def report():
    packets, states = {"used": 7, "not_finite": 2, "late": 0}, {State.NEUTRAL: 0, State.RUNNING: 5}
    return report_of(["motion-cueing", "serve"], Run(), 399, packets, states, ["RuntimeError: a mistake"])


def test_it_says_what_happened_and_leaves_zeros_out(report):
    assert summary_lines(report, "steps") == [
        "399 periods in 1.5 s; deadlines missed: 4 (1.0000 %), 3 late and 1 skipped",
        "packets: used 7, not finite 2",
        "steps: running 5",
        "RuntimeError: a mistake",
    ]


def test_times_are_shown_in_microseconds(report):
    table = timing_table(report)
    assert table.header == ("time, us", "count", "mean", "p50", "p90", "p99", "p99.9", "max")
    wake, latency = table.rows
    assert wake[:3] == ("wake", "4", "4.0")
    assert float(wake[3]) == pytest.approx(2.0, rel=1 / 32)
    assert wake[-1] == "10.0"
    assert latency[1:] == ("0", *6 * ["–"])


def test_a_file_is_read_as_it_was_written(report, tmp_path, capsys):
    show(report, "steps", tmp_path / "report.json")
    assert LoopReport.load_json(tmp_path / "report.json") == report
    assert "deadlines missed: 4" in capsys.readouterr().out
    values = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert values["schema"] == SCHEMA == 1
    values["schema"] = 2
    (tmp_path / "later.json").write_text(json.dumps(values), encoding="utf-8")
    with pytest.raises(DataError, match=r"later\.json"):
        LoopReport.load_json(tmp_path / "later.json")


def test_a_file_of_version_0_1_0_is_read(tmp_path):
    timing = {"count": 2, "mean": 1e-6, "p50": 1e-6, "p90": 2e-6, "p99": 2e-6, "p99_9": 2e-6, "max": 2e-6}
    values = {
        "schema": 1,
        "command": "motion-cueing serve --policy no-motion",
        "created": "2026-11-30T13:20:29+00:00",
        "versions": {"motion-cueing-gym": "0.1.0", "python": "3.11.7"},
        "hardware": "2 cores",
        "duration": 0.3,
        "periods": 291,
        "overrun": 13,
        "skipped": 15,
        "packets": {"used": 5, "malformed": 0, "foreign": 0, "lost": 1, "unsent": 0},
        "timings": {"wake": {**timing, "buckets": [[1e-6, 1], [2e-6, 1]]}},
        "states": {"neutral": 30, "running": 0, "holding": 0, "braking": 0},
        "faults": [],
    }
    (tmp_path / "old.json").write_text(json.dumps(values), encoding="utf-8")
    report = LoopReport.load_json(tmp_path / "old.json")
    assert report.timings["wake"] == TimingSummary(**timing, buckets=((1e-6, 1), (2e-6, 1)))
    assert summary_lines(report, "steps")[1:] == ["packets: used 5, lost 1", "steps: neutral 30"]
