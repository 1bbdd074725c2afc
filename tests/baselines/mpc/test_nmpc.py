"""The nonlinear controller, and machine code."""

from __future__ import annotations

import casadi as cs
import numpy as np
import pytest

from motion_cueing.baselines import symbolic as compiled_module
from motion_cueing.baselines.mpc import Margins
from motion_cueing.baselines.mpc import solver as planner_module
from motion_cueing.baselines.mpc.prediction import N_CUES, MachineModel
from motion_cueing.baselines.mpc.solver import Plan, Planner
from motion_cueing.baselines.symbolic import compiled
from motion_cueing.envs.maneuvers import get_maneuver
from motion_cueing.evaluation import measure

from .machines import NODES, PAPER, quick
from .test_policy import SLALOM, driven

pytestmark = pytest.mark.slow

NONE = np.zeros(0, dtype=np.intp)


def plan(iterations: int, tolerance: float = 1e-6) -> tuple[Plan, np.ndarray]:
    """A plan for a machine under way in a slalom, and the car's cues at its nodes."""
    planner = Planner(PAPER, quick(nonlinear=True, iterations=iterations, tolerance=tolerance))
    position = np.array([4.0, -9.0, 0.1, -0.2, 0.05, 0.1, -0.05, 0.05, 1.0])
    rate = np.array([1.0, -3.0, 0.1, 0.2, 0.0, 0.1, 0.1, 0.0, 0.3])
    cues = get_maneuver("slalom").drive()
    rows = 700 + np.round(np.array(NODES) * 100).astype(int)
    wanted = np.hstack([cues.specific_force[rows], cues.angular_velocity[rows]])
    return planner(position, rate, wanted, np.zeros((len(NODES), 9)), NONE), wanted


def test_a_converged_plan_keeps_the_exact_limits():
    planned, _ = plan(50, tolerance=5e-3)
    assert planned.solved
    assert planned.converged
    linearized = MachineModel(PAPER, len(NODES), Margins(), compile=False)
    exact = linearized(planned.motion.position, planned.motion.rate, planned.motion.acceleration)
    limits = exact.values[:, N_CUES:]
    assert np.all(limits <= linearized.upper + 1e-4)
    assert np.all(limits >= linearized.lower - 1e-4)
    assert np.any(np.abs(limits) > 0.9)  # it is near some


def test_the_search_ends_where_a_new_program_changes_nothing():
    first, _ = plan(50)
    again, wanted = plan(1)
    assert not np.allclose(first.motion.acceleration, again.motion.acceleration, atol=1e-3)
    planner = Planner(PAPER, quick())
    motion = first.motion
    # From the same state and about the converged plan, one more program stays there.
    position = np.array([4.0, -9.0, 0.1, -0.2, 0.05, 0.1, -0.05, 0.05, 1.0])
    rate = np.array([1.0, -3.0, 0.1, 0.2, 0.0, 0.1, 0.1, 0.0, 0.3])
    more = planner(position, rate, wanted, motion.acceleration, first.active)
    assert np.abs(more.motion.acceleration - motion.acceleration).max() < 1e-3


def test_a_plan_no_share_of_whose_change_helps_is_not_at_its_end(monkeypatch):
    assert plan(50, tolerance=0.05)[0].converged
    # No public part has this fate: a search along the step that never succeeds.
    monkeypatch.setattr(planner_module, "_backtrack", lambda *arguments: 0.0)
    stuck, _ = plan(50, tolerance=0.05)
    assert stuck.solved
    assert not stuck.converged
    assert stuck.iterations == 1  # the same program again would say the same
    assert not np.any(stuck.motion.acceleration)


def test_one_iteration_is_the_linear_controller():
    linear = driven(SLALOM, preview=1.0, every=4)
    nonlinear = driven(SLALOM, preview=1.0, every=4, nonlinear=True, iterations=1)
    assert np.array_equal(linear.action, nonlinear.action)


def test_it_drives_within_limits_and_as_well_as_the_linear_one():
    trajectory = driven(SLALOM, preview=1.0, every=4, nonlinear=True)
    linear = measure(driven(SLALOM, preview=1.0, every=4)).cue_error
    assert measure(trajectory).cue_error < 1.1 * linear + 0.01
    assert not np.any(trajectory.limits_active)
    assert int(trajectory.metadata["mpc_iterations"]) > int(trajectory.metadata["mpc_solves"])
    assert trajectory.metadata["mpc_failures"] == "0"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MOTION_CUEING_CACHE", str(tmp_path))
    return tmp_path


def function() -> cs.Function:
    """Something to compile."""
    x = cs.SX.sym("x", 3)
    return cs.Function("something", [x], [cs.sin(x) * cs.norm_2(x)])


X = np.array([0.3, -1.2, 2.0])
EXPECTED = np.sin(X) * np.linalg.norm(X)


def test_machine_code_gives_the_same_numbers_and_is_kept(cache):
    assert np.allclose(np.array(compiled(function())(X))[:, 0], EXPECTED, rtol=1e-14)
    if compiled_module.find_compiler() is None:
        assert list(cache.glob("*")) == []
        return
    library = next(cache.glob("*.so"))
    made, whole = library.stat().st_mtime_ns, library.read_bytes()
    assert compiled(function()).class_name() == "External"
    assert library.stat().st_mtime_ns == made
    # A torn library is not loaded but made again.
    library.unlink()
    library.write_bytes(whole[:1000])
    assert np.allclose(np.array(compiled(function())(X))[:, 0], EXPECTED, rtol=1e-14)
    assert len(library.read_bytes()) > 1000


def test_a_product_and_a_sum_are_rounded_twice_whatever_the_processor(cache, monkeypatch, tmp_path):
    compiler = compiled_module.find_compiler()
    if compiler is None:
        return
    native = tmp_path / "native-cc"
    native.write_text(f'#!/bin/sh\nexec "{compiler}" -march=native "$@"\n')
    native.chmod(0o755)
    monkeypatch.setenv("CC", str(native))
    x, y, z = (cs.SX.sym(name) for name in "xyz")
    made = compiled(cs.Function("product_and_sum", [x, y, z], [x * y + z]))
    assert made.class_name() == "External"
    # Rounded once, it is -2^-60.
    assert float(made(1.0 + 2.0**-30, 1.0 - 2.0**-30, -1.0)) == 0.0


@pytest.mark.parametrize("command", [None, "/bin/false"])
def test_without_a_compiler_the_function_stays_as_it_is(cache, monkeypatch, command):
    monkeypatch.setattr(compiled_module, "find_compiler", lambda: command)
    plain = function()
    assert compiled(plain) is plain
    assert list(cache.glob("*.so")) == []


def test_compiled_derivatives_are_those_of_the_symbols(cache):
    x = 0.1 * np.random.default_rng(1).normal(size=(3, 2, 9))
    found = [MachineModel(PAPER, 2, Margins(), compile=compile)(*x) for compile in (False, True)]
    assert np.allclose(found[0].slopes, found[1].slopes, rtol=0.0, atol=1e-12)
    assert np.allclose(found[0].values, found[1].values, rtol=0.0, atol=1e-12)
