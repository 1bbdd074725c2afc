"""The report is one page that needs nothing else."""

from __future__ import annotations

import re

import pytest

from motion_cueing.evaluation.metrics import METRICS, measure
from motion_cueing.evaluation.reporting.packing import pack
from motion_cueing.evaluation.reporting.report import render
from motion_cueing.evaluation.reporting.tables import maneuver_table
from motion_cueing.evaluation.results import Failure, Provenance, Results

from ..examples import GAINS, ORIGIN, results_of
from ..synthetic import drive


@pytest.fixture(scope="module")
def results() -> Results:
    failures = [Failure("hill", "washout", "no <b>road</b>")]
    found = results_of(GAINS, failures=failures)
    origin = Provenance(
        "motion-cueing evaluate --policy a", "2026", {}, "paper", "sedan", {"car": {"mass": 1814.0}}
    )
    return Results.of(found.maneuvers, failures, origin)


def test_the_report_is_self_contained_and_escapes(results):
    drives = {name: drive(gain, policy=name) for name, gain in GAINS.items()}
    page = render(results, {"weave": pack(drives)})
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)""", page)
    # The only addresses are those of uPlot's home and of a vocabulary; neither is loaded.
    addresses = set(re.findall(r"https?://[\w./-]+", page))
    assert addresses == {"https://github.com/leeoniya/uPlot", "http://www.w3.org/2000/svg"}
    assert "no &lt;b&gt;road&lt;/b&gt;" in page
    for text in ("weave", "no-motion", "mass: 1814.0", "indifference_force", "--policy"):
        assert text in page


def test_no_name_can_end_the_script_that_holds_it():
    name = "</script><img src=x onerror=alert(1)>"
    measured = {"weave": {name: measure(drive(policy=name))}}
    page = render(Results.of(measured, [], ORIGIN), {"weave": pack({name: drive(policy=name)})})
    assert "<img" not in page
    assert page.count("</script>") == page.count("<script")


def test_the_report_has_the_benchmark_and_the_metrics_as_declared(results):
    page = render(results)
    assert "Benchmark, means over 2 drives" in page
    assert "(J of optimal-washout-tuned − J of\noptimum)" in page
    assert METRICS["cue_error"].definition in page
    headers = re.findall('<th scope="col">(.*?)</th>', page)
    for one in METRICS.values():
        assert (one.title in headers) == bool(one.tables)


def test_a_report_without_a_drive_has_its_configuration():
    assert "Configuration" in render(Results.of({}, [], ORIGIN))


def test_the_table_lists_the_best_first(results):
    table = maneuver_table("weave", results.maneuvers["weave"])
    assert [row[0] for row in table.rows[:2]] == ["optimum", "optimum-perceived"]
    assert all(len(row) == len(table.header) for row in table.rows)
