"""FMUs of exports: valid, run by FMPy, and equal to the code they hold."""

from __future__ import annotations

import shutil
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from motion_cueing.envs.errors import ConfigurationError
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.realtime.export import make_source
from motion_cueing.realtime.export.check import CompilerError, compile_shared
from motion_cueing.realtime.export.fmu import write_fmu

from ...envs.task.tasks import drive
from . import needs_compiler

PAPER = get_platform("paper")


def signals(source, cues) -> np.ndarray:
    """The drive as inputs of an FMU."""
    names = [f"{one.name}[{k + 1}]" for one in source.inputs for k in range(one.size)]
    rows = np.zeros(len(cues.time), dtype=[("time", float), *((name, float) for name in names)])
    rows["time"] = cues.time
    values = np.hstack([cues.specific_force, cues.angular_velocity])
    for k, name in enumerate(names):
        rows[name] = values[:, k]
    return rows


@needs_compiler
@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("name", "single"), [("classical", False), ("learned-ppo-now", False), ("adaptive", True)]
)
def test_it_is_valid_and_computes_what_the_code_does(name, single, version, tmp_path):
    source = make_source(make_policy(name, PAPER), PAPER, single=single)
    file = tmp_path / "a.fmu"
    write_fmu(source, file, version)
    assert validate_fmu(str(file)) == []
    cues = drive(samples=101)
    outputs = [f"position[{k}]" for k in range(1, 10)] + [f"leg_rates[{k}]" for k in range(1, 7)] + ["limits"]
    found = fmpy.simulate_fmu(
        str(file), stop_time=1.0, output_interval=0.01, input=signals(source, cues), output=outputs
    )
    expected, _ = compile_shared(source, tmp_path).drive(
        np.hstack([cues.specific_force, cues.angular_velocity])
    )
    columns = [*range(9), *range(33, 40)]
    # The master interpolates inputs, which rounds them.
    for name, column in zip(outputs, columns, strict=True):
        np.testing.assert_allclose(found[name][1:], expected[:100, column], atol=1e-5 if single else 1e-6)
    np.testing.assert_allclose(found["time"], 0.01 * np.arange(101), atol=1e-12)


@needs_compiler
@pytest.mark.parametrize("version", [2, 3])
def test_steps_of_the_master_are_whole_time_steps(version, tmp_path):
    file = tmp_path / "a.fmu"
    write_fmu(make_source(make_policy("classical", PAPER), PAPER), file, version)
    coarse = fmpy.simulate_fmu(str(file), stop_time=0.2, output_interval=0.05, output=["position[5]"])
    assert len(coarse) == 5
    with pytest.raises(Exception, match="status"):
        fmpy.simulate_fmu(str(file), stop_time=0.2, output_interval=0.004, output=["position[5]"])


@needs_compiler
def test_its_state_can_be_taken_back(tmp_path):
    source = make_source(make_policy("classical", PAPER), PAPER)
    file = tmp_path / "a.fmu"
    write_fmu(source, file)
    description = fmpy.read_model_description(str(file))
    references = {one.name: one.valueReference for one in description.modelVariables}
    unpacked = fmpy.extract(str(file), tmp_path / "unpacked")
    own = fmpy.fmi2.FMU2Slave(
        guid=description.guid, unzipDirectory=unpacked, modelIdentifier=source.name, instanceName="one"
    )
    own.instantiate()
    own.setupExperiment()
    own.enterInitializationMode()
    own.exitInitializationMode()
    forward, surge = references["force[1]"], references["position[1]"]
    own.setReal([forward], [2.0])
    for k in range(5):
        own.doStep(0.01 * k, 0.01)
    state = own.getFMUState()
    places = []
    for _ in range(2):
        own.setFMUState(state)
        for k in range(5, 10):
            own.doStep(0.01 * k, 0.01)
        places.append(own.getReal([surge])[0])
    own.freeFMUState(state)
    own.reset()
    assert places[0] == places[1] != 0.0
    assert own.getReal([surge]) == [0.0]
    own.terminate()
    own.freeInstance()


@needs_compiler
def test_it_holds_its_sources_and_the_same_content_is_the_same_file(tmp_path):
    source = make_source(make_policy("classical", PAPER))
    for version, extra in ((2, set()), (3, {"sources/buildDescription.xml"})):
        files = [tmp_path / f"{k}.fmu" for k in range(2)]
        for file in files:
            write_fmu(source, file, version)
        with zipfile.ZipFile(files[0]) as archive, zipfile.ZipFile(files[1]) as again:
            names = set(archive.namelist())
            assert {
                "modelDescription.xml",
                "sources/classical.c",
                "sources/classical.h",
                "sources/fmu.c",
            } <= names
            assert extra <= names
            assert sum(name.startswith("binaries/") for name in names) == 1
            for name in names:
                if not name.startswith("binaries/"):
                    assert archive.read(name) == again.read(name)
            assert archive.read("sources/classical.c").decode() == source.code


@needs_compiler
def test_it_begins_where_the_machine_stands(tmp_path):
    policy = make_policy("classical", PAPER)
    moved = type(policy)(
        policy.parameters.__class__(**{**vars(policy.parameters), "start_hexapod": (0.1, 0.0, 0.05)})
    )
    source = make_source(moved, PAPER)
    file = tmp_path / "a.fmu"
    write_fmu(source, file)
    found = fmpy.simulate_fmu(
        str(file), stop_time=0.01, output_interval=0.01, output=["position[3]", "position[5]", "legs[1]"]
    )
    assert (found["position[3]"][0], found["position[5]"][0]) == (0.1, 0.05)
    assert abs(found["legs[1]"][1] - found["legs[1]"][0]) < 1e-3 < abs(found["legs[1]"][0])


def test_without_a_compiler_it_says_so(tmp_path, monkeypatch):
    source = make_source(make_policy("classical", PAPER))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(CompilerError, match="no C compiler found: install gcc or clang"):
        write_fmu(source, tmp_path / "a.fmu")
    assert list(tmp_path.iterdir()) == []


def test_other_versions_of_the_standard_are_refused(tmp_path):
    source = make_source(make_policy("classical", PAPER))
    with pytest.raises(ConfigurationError, match="fmi must be one of 2, 3, found 1"):
        write_fmu(source, tmp_path / "a.fmu", 1)
