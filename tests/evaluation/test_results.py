"""results.json, results.csv, report.html and the figures."""

from __future__ import annotations

import csv
import json
import re
import struct

import pytest

from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.evaluation.metrics import CUE_AXES, measure
from motion_cueing.evaluation.provenance import plain, provenance
from motion_cueing.evaluation.reporting.figures import maneuver_figure
from motion_cueing.evaluation.reporting.report import render
from motion_cueing.evaluation.reporting.tables import maneuver_table
from motion_cueing.evaluation.reporting.text import number
from motion_cueing.evaluation.results import SCHEMA, Failure, Results

from .synthetic import drive


@pytest.fixture(scope="module")
def results() -> Results:
    drives = {"washout": measure(drive()), "no-motion": measure(drive(gain=0.0))}
    origin = provenance(
        ["motion-cueing", "evaluate", "--policy", "a b"],
        ("base", {"stroke": 0.67}),
        ("sedan", {"mass": 1814.0}),
        {"washout": {"parameters": '{"gain": 1}'}},
    )
    failures = [Failure("hill", "washout", "no <b>road</b>")]
    return Results.of({"weave": drives, "nothing": {}}, failures, origin)


def test_json_round_trip(results, tmp_path):
    results.save_json(tmp_path / "results.json")
    assert Results.load_json(tmp_path / "results.json") == results


def test_json_is_strict_and_documented(results, tmp_path):
    results.save_json(tmp_path / "results.json")
    text = (tmp_path / "results.json").read_text()
    values = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert values["schema"] == SCHEMA
    assert list(values) == [
        "schema",
        "provenance",
        "maneuvers",
        "verdicts",
        "standings",
        "failures",
        "criteria",
        "shares",
        "left_out",
        "notes",
    ]
    assert values["maneuvers"]["weave"]["no-motion"]["axes"]["f_y"]["correlation"] is None
    assert list(values["maneuvers"]["weave"]["washout"]["axes"]) == list(CUE_AXES)
    assert values["provenance"]["command"] == "motion-cueing evaluate --policy 'a b'"
    assert values["provenance"]["configuration"]["policies"]["washout"]["parameters"] == {"gain": 1}
    assert {"python", "numpy", "motion-cueing-gym"} <= set(values["provenance"]["versions"])
    assert values["failures"] == [{"maneuver": "hill", "policy": "washout", "message": "no <b>road</b>"}]


@pytest.mark.parametrize("content", ["", "{", "[]", '{"schema": 99}', "\x00"])
def test_broken_or_other_json_is_refused(tmp_path, content):
    path = tmp_path / "results.json"
    path.write_text(content)
    with pytest.raises(DataError, match=r"results\.json"):
        Results.load_json(path)


def test_json_with_a_wrong_field_is_refused(results, tmp_path):
    path = tmp_path / "results.json"
    results.save_json(path)
    values = json.loads(path.read_text())
    values["maneuvers"]["weave"]["washout"]["cue_error"] = "low"
    path.write_text(json.dumps(values))
    with pytest.raises(ConfigurationError, match="cue_error"):
        Results.load_json(path)


def test_csv_has_a_row_a_drive_with_the_same_numbers(results, tmp_path):
    results.save_csv(tmp_path / "results.csv")
    with open(tmp_path / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["maneuver"], row["policy"]) for row in rows] == [
        ("weave", "washout"),
        ("weave", "no-motion"),
    ]
    metrics = results.maneuvers["weave"]["washout"]
    assert float(rows[0]["cue_error"]) == metrics.cue_error
    assert float(rows[0]["axes.f_y.delay"]) == metrics.axes["f_y"].delay
    assert float(rows[0]["actuators.leg_4.stroke_share"]) == metrics.actuators["leg_4"].stroke_share
    assert rows[1]["axes.f_y.correlation"] == ""
    assert rows[0]["actuators.turntable.stroke_share"] == ""


def test_csv_without_a_drive_has_a_header(results, tmp_path):
    empty = Results.of({}, [], results.provenance)
    empty.save_csv(tmp_path / "results.csv")
    assert (tmp_path / "results.csv").read_text() == "maneuver,policy\n"
    assert empty.overall is None
    assert "Configuration" in render(empty, {})


def test_the_report_is_self_contained_and_escapes(results):
    page = render(results, {"weave": b"\x89PNG"})
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)""", page)
    assert "http://" not in page
    assert "https://" not in page
    assert "data:image/png;base64,iVBORw==" in page
    assert "no &lt;b&gt;road&lt;/b&gt;" in page
    for text in ("weave", "washout", "no-motion", "mass: 1814.0", "indifference_force", "--policy"):
        assert text in page


def test_plain_keeps_json_and_drops_what_is_not_finite():
    assert plain({"a": (1, 2.5, float("inf")), "b": None, "c": "[1, 2]", "d": "{no json"}) == {
        "a": [1, 2.5, None],
        "b": None,
        "c": [1, 2],
        "d": "{no json",
    }


def test_the_table_lists_the_best_first(results):
    table = maneuver_table("weave", results.maneuvers["weave"])
    assert [row[0] for row in table.rows] == ["washout", "no-motion"]
    assert all(len(row) == len(table.header) for row in table.rows)


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.0, "0.00"), (1.2345, "1.23"), (12.345, "12.3"), (123.4, "123"), (0.012345, "0.012")],
)
def test_numbers_have_three_digits(value, text):
    assert number(value) == text


def test_a_figure_is_a_png_and_leaves_no_global_state():
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    image = maneuver_figure({"washout": drive(), "no-motion": drive(gain=0.0, policy="no-motion")})
    assert image.startswith(b"\x89PNG\r\n\x1a\n")
    assert struct.unpack(">II", image[16:24]) == (1430, 1540)
    assert dict(mpl.rcParams) == before
