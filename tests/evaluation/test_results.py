"""results.json and results.csv, of this version and of the one before."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from motion_cueing.envs.car import get_car
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.metrics import CUE_AXES, measure
from motion_cueing.evaluation.results import SCHEMA, Failure, Provenance, Results, save_rows

from .synthetic import drive


@pytest.fixture(scope="module")
def results() -> Results:
    drives = {"washout": measure(drive()), "no-motion": measure(drive(gain=0.0))}
    origin = Provenance.of(
        ["motion-cueing", "evaluate", "--policy", "a b"],
        get_platform("paper"),
        get_car("sedan"),
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
        "failures",
        "criteria",
        "scores",
        "normalized_scores",
        "skipped",
        "notes",
    ]
    assert values["maneuvers"]["weave"]["no-motion"]["axes"]["f_y"]["correlation"] is None
    assert list(values["maneuvers"]["weave"]["washout"]["axes"]) == list(CUE_AXES)
    assert values["provenance"]["command"] == "motion-cueing evaluate --policy 'a b'"
    assert (
        values["provenance"]["platform"]
        == values["provenance"]["configuration"]["platform"]["name"]
        == "paper"
    )
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
    assert empty.frame().empty


def test_a_frame_has_the_drives_with_their_scores(results):
    frame = results.frame()
    assert frame[["maneuver", "policy"]].to_numpy().tolist() == [["weave", "washout"], ["weave", "no-motion"]]
    means = frame.groupby("policy")["axes.f_y.rmse"].mean()
    assert means["washout"] == results.maneuvers["weave"]["washout"].axes["f_y"].rmse
    assert frame["normalized_score"].isna().all()


def test_rows_keep_whole_numbers_and_empty_cells(tmp_path):
    rows = [{"name": "a, b", "count": 3, "value": 0.1}, {"name": "c", "count": None, "value": 1 / 3}]
    save_rows(rows, tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_text() == ('name,count,value\n"a, b",3,0.1\nc,,0.3333333333333333\n')


BEFORE = Path(__file__).parent / "before" / "results-1.json"


def _without_new(values, old):
    """Nested values without the fields that an old file does not have, which must be undefined."""
    if not isinstance(values, dict):
        return values
    assert all(value is None for name, value in values.items() if name not in old)
    return {name: _without_new(values[name], old[name]) for name in old}


def test_results_of_the_version_before_are_read(tmp_path):
    old, results = json.loads(BEFORE.read_text()), Results.load_json(BEFORE)
    assert (old["schema"], results.schema) == (1, SCHEMA)
    assert [(s.policy, s.normalized_score) for s in results.scores] == [
        (s["policy"], s["share"]) for s in old["standings"]
    ]
    score = results.normalized_scores["braking"]["mpc"]
    assert score.perceived_cue_error == old["shares"]["braking"]["mpc"]["perceived_cue_error"]
    assert results.skipped == {"learned-any": "needs a turntable"}
    assert results.failures == (Failure("hill", "mpc", "stopped"),)
    results.save_json(tmp_path / "results.json")
    assert Results.load_json(tmp_path / "results.json") == results
    written = json.loads((tmp_path / "results.json").read_text())["maneuvers"]
    assert _without_new(written, old["maneuvers"]) == old["maneuvers"]


def test_policies_of_the_version_before_are_judged_alike():
    results = Results.load_json(BEFORE)
    again = Results.of(results.maneuvers, [], results.provenance, results.criteria)
    alone = {verdict.maneuver: verdict for verdict in results.verdicts}
    for maneuver, scores in again.normalized_scores.items():
        for policy, score in scores.items():
            assert score.cue_error == results.normalized_scores[maneuver][policy].cue_error
        assert again.verdicts[0].ranking == tuple(
            name for name in alone["braking"].ranking if name in results.maneuvers["braking"]
        )
