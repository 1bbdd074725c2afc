"""Searches for a washout's parameters: the space, what is minimized, and both methods."""

from __future__ import annotations

from dataclasses import replace

import cma
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motion_cueing.baselines.tuning import methods as evolution
from motion_cueing.baselines.tuning import methods as method
from motion_cueing.baselines.tuning import objective as space_module
from motion_cueing.baselines.tuning import search as search_module
from motion_cueing.baselines.tuning.methods import CmaEs, GradientDescent, StepResult, place_gradient
from motion_cueing.baselines.tuning.objective import LIMIT_STEP, Objective, WashoutSpace, penalty
from motion_cueing.baselines.tuning.search import Record, Search, TuningOptions, load_record
from motion_cueing.baselines.washout import (
    FAMILIES,
    Coordinate,
    Family,
    HighPass,
    load_washout,
    washout_presets,
)
from motion_cueing.baselines.washout.families import load_of
from motion_cueing.envs.errors import ConfigurationError, DataError
from motion_cueing.envs.maneuvers import drive_seeds
from motion_cueing.envs.platform import get_platform
from motion_cueing.train.config import TrainingConfig

from ..drives import trace

pytestmark = pytest.mark.slow

PAPER = get_platform("paper")
START = load_washout("classical")
SPACE = WashoutSpace(START)
CLASSICAL = FAMILIES["classical"]
DRIVES = [
    trace(6.0, lambda t: np.column_stack([0.5 * np.sin(t), 1.2 * np.sin(0.8 * t)]), name="weave"),
    trace(6.0, lambda t: np.column_stack([np.where(t > 1.0, 1.0, 0.0), 0.0 * t]), name="step"),
]
OBJECTIVE = Objective(DRIVES, PAPER)
BUDGET = 14 * 10 * 12.0 / 3600.0
"""Ten generations of fourteen sets through a dozen seconds, h."""

places = st.lists(st.floats(0.0, 1.0), min_size=len(SPACE), max_size=len(SPACE)).map(np.array)


def search(path=None, drives=DRIVES, **options) -> Search:
    given = {"start": START, "budget": BUDGET} | options
    return Search(TuningOptions(**given), Objective(drives, PAPER), path=path)


@given(places)
@settings(max_examples=50, deadline=None)
def test_a_place_is_a_parameter_set_and_back(place):
    found = SPACE.decode(place)
    np.testing.assert_allclose(SPACE.encode(found), place, atol=1e-9)
    for coordinate in SPACE.coordinates:
        value = coordinate.value(0.0), coordinate.value(1.0)
        np.testing.assert_allclose(value, (coordinate.low, coordinate.high), rtol=1e-12)


@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_every_end_of_every_range_is_a_washout(name):
    space = WashoutSpace(load_of(name, FAMILIES[name].start))
    for index in range(len(space)):
        for end in (0.0, 1.0):
            places = np.full(len(space), 0.5)
            places[index] = end
            assert space.encode(space.decode(places)) == pytest.approx(places)


@pytest.mark.parametrize("name", washout_presets())
def test_what_a_search_may_not_change_stays(name):
    start = load_washout(name)
    space = WashoutSpace(start)
    found = space.decode(np.full(len(space), 0.5))
    for block in ("hpr", "hps", "hpi"):
        orders = [[part.order for part in getattr(p, block)] for p in (start, found)]
        assert orders[0] == orders[1]
    assert (found.tilt is None, found.lpc is None) == (start.tilt is None, start.lpc is None)
    assert (found.start_carriage, found.turntable_gain) == (start.start_carriage, start.turntable_gain)
    # Every coordinate is one that has an effect: two places differ in it.
    moved = [space.decode(np.where(np.arange(len(space)) == i, 0.6, 0.5)) for i in range(len(space))]
    assert len({str(p) for p in [found, *moved]}) == len(space) + 1


def test_parameters_without_effect_are_not_searched():
    paths = {c.path for c in WashoutSpace(load_washout("lc1")).coordinates}
    assert not any(path.startswith(("tilt", "hpr")) for path in paths)
    assert "hps.0.frequency" in paths  # first order: a frequency, no damping
    assert not paths & {"hps.0.damping", "hps.1.frequency", "hpi.1.frequency"}
    assert {"hpi.2.damping", "lpc.frequency"} <= paths


def test_a_machine_without_a_turntable_is_given_no_share_of_the_rotation():
    platform = get_platform("paper-no-turntable")
    space = WashoutSpace(START, platform)
    assert START.turntable_share > 0.0
    assert space.decode(np.full(len(space), 0.5)).turntable_share == 0.0
    assert "turntable_share" not in {c.path for c in space.coordinates}
    assert len(space) == len(WashoutSpace(START, get_platform("paper"))) - 1 == len(SPACE) - 1


def test_a_result_has_few_digits_and_says_where_it_stands_at_a_bound():
    place = SPACE.encode(START)
    place[0] = 1.0
    found = SPACE.result(place, "mine", "for a test")
    assert (found.name, found.description) == ("mine", "for a test")
    # 3 deg/s are 0.0523598... rad/s.
    assert found.tilt is not None
    assert found.tilt.rate == 0.05236
    assert "force_scale.0" in SPACE.at_bounds(found)
    assert "hps.0.frequency" not in SPACE.at_bounds(found)


@given(st.floats(-1.0, 2.0), st.booleans())
def test_values_outside_of_a_range_lie_at_its_ends(value, log):
    coordinate = Coordinate("force_scale.0", 0.2, 1.2, log)
    assert coordinate.value(coordinate.place(value)) == pytest.approx(min(max(value, 0.2), 1.2))


def test_a_set_with_other_blocks_has_no_place():
    with pytest.raises(ConfigurationError, match="lc1 has other blocks than classical"):
        SPACE.encode(load_washout("lc1"))
    with pytest.raises(ConfigurationError, match="36 finite numbers"):
        SPACE.decode(np.zeros(3))


def test_a_limit_costs_more_than_it_gains():
    np.testing.assert_allclose(
        penalty(np.array([0.0, 0.001, 0.01])), [0.0, LIMIT_STEP + 1.0, LIMIT_STEP + 10.0]
    )
    hard = trace(6.0, lambda t: np.column_stack([np.where(t > 1.0, -9.0, 0.0), 0.0 * t]))
    open_ = replace(START, force_scale=(1.0, 1.0, 1.0), hps=(HighPass(), HighPass()))
    both = Objective([DRIVES[0], hard], PAPER)
    whole, alone = both.evaluate([START, open_]), both.evaluate([START, open_], [0])
    assert whole.limited[1, 1] > 0.0
    assert whole.at_limit[1] == pytest.approx(whole.limited[1].mean())
    np.testing.assert_array_equal(alone.cost, alone.cue_error)
    # A guard counts for limits, not for J.
    guarded = both.evaluate([START, open_], [0], guards=[1])
    np.testing.assert_array_equal(guarded.cue_error, alone.cue_error)
    assert guarded.cost[1] == alone.cost[1] + penalty(guarded.at_limit)[1] > alone.cost[1] + LIMIT_STEP
    assert guarded.violation[1] == guarded.at_limit[1]


def test_limits_may_be_met_in_drives_that_are_spared():
    hard = trace(6.0, lambda t: np.column_stack([np.where(t > 1.0, -9.0, 0.0), 0.0 * t]))
    open_ = replace(START, force_scale=(1.0, 1.0, 1.0), hps=(HighPass(), HighPass()))
    strict, spared = (
        Objective([DRIVES[0], hard], PAPER, exempt=which).evaluate([open_]) for which in ((), (1,))
    )
    assert strict.at_limit[0] == spared.at_limit[0] > 0.0
    assert strict.violation[0] == pytest.approx(strict.at_limit[0])
    assert (spared.violation[0], spared.limited.max()) == (0.0, 0.0)
    assert spared.cost[0] == spared.cue_error[0] == strict.cue_error[0] < strict.cost[0]
    assert Objective([hard], PAPER, exempt=[0]).evaluate([open_]).violation[0] == 0.0


def test_hours_are_those_of_the_drives():
    assert OBJECTIVE.hours() == pytest.approx(2 * 6.0 / 3600.0, rel=2e-3)
    assert OBJECTIVE.hours([1]) == OBJECTIVE.hours() / 2


def test_the_objective_is_j_or_its_perceived_twin():
    scores = OBJECTIVE.evaluate([START])
    assert scores.cost[0] == scores.cue_error[0] != scores.perceived_error[0]
    assert Objective(DRIVES, PAPER, "perceived").evaluate([START]).cost[0] == scores.perceived_error[0]


def test_a_small_search_improves_on_its_start_and_gives_the_same_again():
    first, again, other = search(), search(), search(seed=1, budget=1e-3)
    for one in (first, again, other):
        assert not one.run()
    assert first.results == again.results
    assert first.results[:2] != other.results[:2]
    assert first.status.hours >= BUDGET
    found = OBJECTIVE.evaluate([first.result("found", ""), START])
    assert found.cost[0] < 0.8 * found.cost[1]
    assert found.at_limit[0] == 0.0
    assert first.status.best == pytest.approx(found.cost[0], rel=1e-3)


@pytest.mark.parametrize("way", ["cma", "gradient"])
def test_a_search_that_is_taken_up_again_ends_with_the_same_bits(way, tmp_path, monkeypatch):
    monkeypatch.setattr(method, "TRY_EVERY", 2)
    options = {"method": way, "budget": (14 if way == "cma" else 1) * 5 * 2.0 / 3600.0}
    short = [trace(1.0, lambda t: np.column_stack([0.5 * np.sin(3.0 * t), 0.0 * t]))] * 2
    whole = search(drives=short, **options)
    whole.run()
    assert len(whole.results) >= 5

    path = tmp_path / "some.search.json"
    begun = search(path, drives=short, **options)
    asked = iter([False, False, False, False, True])
    assert begun.run(stop=lambda: next(asked))
    record = load_record(path)
    assert len(record.results) == 4
    taken_up = Search(record.options, Objective(short, PAPER), path=path)
    taken_up.resume(record)
    assert not taken_up.run()
    assert taken_up.results == whole.results == list(load_record(path).results)
    assert taken_up.result("a", "") == whole.result("a", "")


def test_a_file_of_before_is_read(tmp_path):
    """Its results were called ``found``."""
    path = tmp_path / "some.search.json"
    search(path, budget=1e-9).run()
    new = load_record(path)
    text = path.read_text()
    path.write_text(text.replace('"results"', '"found"'))
    assert path.read_text() != text
    assert load_record(path) == new


def test_drives_that_changed_or_a_record_that_does_not_fit_are_refused(tmp_path):
    path = tmp_path / "some.search.json"
    begun = search(path, budget=1e-9)
    begun.run()
    record = load_record(path)
    with pytest.raises(DataError, match="drives, machine, ranges or settings of the search, or the version"):
        search(drives=DRIVES[:1]).resume(record)
    begun = search()
    begun.run(stop=lambda: len(begun.results) > 1)
    broken = replace(record, results=(begun.results[0], replace(begun.results[1], values=(1.0, 2.0))))
    with pytest.raises(DataError, match="does not fit"):
        search().resume(broken)
    path.write_text("{")
    with pytest.raises(DataError, match=r"no search can be read .*delete it, or name another --out"):
        load_record(path)
    path.write_text('{"options": 3}')
    with pytest.raises(DataError, match=r"\(field 'options'.*, and 3 more\); begin anew: delete it") as told:
        load_record(path)
    assert len(str(told.value).removeprefix(str(path))) < 250
    for changed in (replace(record.options, seed=9), replace(record.options, limits="all")):
        with pytest.raises(DataError, match="options, drives, machine"):
            Search(changed, Objective(DRIVES, get_platform("paper"))).resume(record)


def wider(family: Family) -> tuple[Coordinate, ...]:
    """Its coordinates with another end of the last range."""
    coordinates = family.coordinates
    return (*coordinates[:-1], replace(coordinates[-1], high=2.0 * coordinates[-1].high))


@pytest.mark.parametrize(
    ("where", "name", "value"),
    [
        (space_module, "family_of", lambda start: replace(CLASSICAL, coordinates=wider(CLASSICAL))),
        (
            space_module,
            "family_of",
            lambda start: replace(CLASSICAL, coordinates=CLASSICAL.coordinates[1:]),
        ),
        (evolution, "STEP", 0.2),
        (evolution, "DRIVES", 12),
        (evolution, "GUARDS", 12),
        (method, "TRY_EVERY", 4),
        (search_module, "LIMIT_SLOPE", 1.0),
        (search_module, "package_version", lambda: "99.0"),
        (cma, "__version__", "99.0"),
    ],
)
def test_a_search_is_not_taken_up_by_another_one(monkeypatch, where, name, value):
    begun = search(budget=1e-9)
    begun.run()
    record = Record(begun.options, "paper", "sedan", begun._inputs, tuple(begun.results))
    search().resume(record)
    monkeypatch.setattr(where, name, value)
    with pytest.raises(DataError, match="have changed since this search was begun; begin it anew"):
        search().resume(record)


@pytest.mark.parametrize("name", ["specific_force", "angular_velocity", "angular_acceleration", "time"])
def test_a_search_is_not_taken_up_with_other_cues(name):
    other = {"angular_acceleration": np.array(DRIVES[1].angular_acceleration)}
    other |= {name: getattr(DRIVES[1], name) * (1.0 + 1e-6)}
    if name.startswith("angular"):
        other[name] = other[name] + 1e-9
    changed = search(drives=[DRIVES[0], replace(DRIVES[1], **other)])
    assert changed._inputs != search()._inputs
    assert search(drives=[DRIVES[0], replace(DRIVES[1], name="other")])._inputs == search()._inputs


def test_the_gradient_in_the_cube_is_that_of_differences():
    place, h = np.clip(SPACE.encode(START), 0.05, 0.95), 1e-4
    cost, gradient = place_gradient(SPACE, place, OBJECTIVE, [0])
    weave = Objective(DRIVES[:1], PAPER)
    assert cost == pytest.approx(weave.evaluate([SPACE.decode(place)]).cue_error[0], rel=0.01)
    names = [c.path for c in SPACE.coordinates]
    for name in ("force_scale.1", "hps.1.frequency", "hpi.1.damping", "tilt.low_pass.frequency"):
        step = np.where(np.array(names) == name, h, 0.0)
        sides = [weave.evaluate([SPACE.decode(place + s * step)]).cue_error[0] for s in (1.0, -1.0)]
        expected = (sides[0] - sides[1]) / (2.0 * h)
        assert abs(expected) > 1e-3
        # The tape averages over the steps, the score also over the sample before the first.
        assert gradient[names.index(name)] == pytest.approx(expected, rel=0.01)


def test_descent_goes_down_and_never_keeps_what_is_worse():
    goal = np.linspace(0.2, 0.8, 4)
    way = GradientDescent(np.full(4, 0.5), seed=0)

    def bowl(place):
        """In place of a simulation."""
        return float(np.sum((place - goal) ** 2))

    costs = []
    while not way.converged:
        place = way._place
        if way._tries:
            way.update(StepResult(0.0, (bowl(place),), (0.0,)))
            costs.append(way.best[0])
        else:
            way.update(StepResult(0.0, (bowl(place), *(2.0 * (place - goal)).tolist())))
    assert costs == sorted(costs, reverse=True)
    np.testing.assert_allclose(way.best[1], goal, atol=0.01)


def test_descent_goes_back_from_a_set_that_meets_a_limit_however_cheap():
    way = GradientDescent(np.full(2, 0.5), seed=0)
    way.update(StepResult(0.0, (9.0,), (0.0,)))
    for _ in range(method.TRY_EVERY):
        way.update(StepResult(0.0, (9.0, 1.0, -1.0)))
    assert way._place.tolist() != [0.5, 0.5]
    way.update(StepResult(0.0, (1.01,), (1e-5,)))
    assert (way.best[0], way._place.tolist()) == (9.0, [0.5, 0.5])


def test_of_sets_tried_the_best_meets_no_limit_if_any_does_not():
    way = CmaEs(np.full(3, 0.5), seed=0)
    way.update(StepResult(0.0, (5.0, 0.1), (0.1,)))
    assert way.best[0] == 5.0  # there is no other yet

    def tried(costs, violations):
        for _ in range(method.TRY_EVERY):
            way.update(StepResult(0.0, tuple(range(len(way._generation)))))
        way.update(StepResult(0.0, (*costs, 0.0), violations))
        return way.best[0]

    assert tried((8.0, 4.0), (0.0, 1e-5)) == 8.0
    assert tried((1.0, 8.0), (1e-9, 0.0)) == 8.0
    assert tried((9.0, 7.0), (0.0, 0.0)) == 7.0


def test_drives_in_which_limits_are_met_become_guards():
    way = CmaEs(np.full(3, 0.5), seed=0)
    limited = np.zeros(40)
    limited[[3, 7]] = 0.1, 0.2
    way.update(StepResult(0.0, (5.0, *limited), (0.3,)))
    assert way._guards == [7, 3]
    for _ in range(method.TRY_EVERY):
        way.update(StepResult(0.0, tuple(range(len(way._generation)))))
    limited[[3, 7]] = 0.2, 0.0
    way.update(StepResult(0.0, (6.0, 7.0, *limited), (0.1, 0.1)))
    assert way._guards == [3, 7]
    assert way.best[0] == 5.0


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"objective": "perceived", "method": "gradient"}, "no gradient; use method cma"),
        ({"drives_seed": 1_000_000}, "drives that are held out"),
        ({"budget": 0.0}, "budget"),
        ({"drives": 0}, "drives"),
        ({"maneuvers": ()}, "maneuvers"),
        ({"method": "luck"}, "method"),
    ],
)
def test_wrong_options_are_refused(changes, told):
    with pytest.raises(ConfigurationError, match=told):
        TuningOptions(start=START, **changes)
    with pytest.raises(ConfigurationError, match="drives is empty"):
        Objective([], PAPER)


def test_it_tunes_on_what_agents_train_on_and_is_judged_on_what_they_are_validated_on():
    agents, tuning = TrainingConfig(algo="apg"), TuningOptions(start=START)
    assert tuning.drives_seed == agents.task.episode.library_seed
    assert tuning.duration == agents.task.episode.drive_duration
    assert drive_seeds(8, tuning.drives_seed) == drive_seeds(tuning.drives, tuning.drives_seed)[:8]
    assert Record(tuning, "paper", "sedan", "").options == tuning
