"""Maneuvers, platforms, cars and perception models of another package: by a call, and by entry points."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from motion_cueing.envs import car, maneuvers, perception, platform
from motion_cueing.envs.errors import ConfigurationError, UnknownNameError
from motion_cueing.envs.registry import Registry

pytestmark = pytest.mark.slow

PACKAGE = '''
"""Things of another package, made of the project's."""

from dataclasses import replace

from motion_cueing.envs.car import get_car
from motion_cueing.envs.maneuvers.standard import LaneChange
from motion_cueing.envs.perception import get_vestibular_model
from motion_cueing.envs.platform import get_platform


class Swerve(LaneChange):
    """A lane change at walking pace."""

    def __init__(self):
        super().__init__(speed=8.0)


def small_machine():
    return get_platform("dim-hexapod")


kart = replace(get_car("sedan"), mass=2000.0, description="a heavy sedan")
numb = replace(get_vestibular_model("telban"), name="numb")
'''

ENTRY_POINTS = """
[motion_cueing.maneuvers]
swerve = theirs:Swerve
[motion_cueing.platforms]
small = theirs:small_machine
[motion_cueing.cars]
kart = theirs:kart
[motion_cueing.vestibular_models]
numb = theirs:numb
"""

CALLS = """
import theirs
from motion_cueing.envs import car, maneuvers, perception, platform
maneuvers.register("swerve", theirs.Swerve, "slow lane change")
platform.register("small", "theirs:small_machine")
car.register("kart", theirs.kart)
perception.register("numb", theirs.numb)
"""

USE = """
import sys
from motion_cueing.envs.car import car_names, describe_car, get_car
from motion_cueing.envs.maneuvers import get_maneuver, maneuver_names
from motion_cueing.envs.platform import ablation_names, describe_platform, get_platform, platform_names

assert "swerve" in maneuver_names() and "small" in platform_names() and "kart" in car_names()
assert not {"warp", "scipy"} & set(sys.modules) or "theirs" in sys.modules
assert get_platform("small").name == "small" and get_car("kart").name == "kart"
assert describe_platform("small") and describe_car("kart")
assert not any(name.startswith("small") for name in ablation_names())
import gymnasium
import motion_cueing.envs
env = gymnasium.make(
    motion_cueing.envs.ENVIRONMENT_ID,
    platform="small",
    vestibular="numb",
    episode={"drives": ["swerve"], "random": {"cars": ["kart"]}},
)
env.reset(seed=0)
env.step(env.action_space.sample())
assert env.unwrapped.batch.platform.name == "small"
assert env.unwrapped.batch.drives[0].channels["speed_m_s"].max() < 9.0
"""


@pytest.mark.parametrize("way", ["calls", "entry points"])
def test_another_package_adds_to_every_registry(way, tmp_path):
    (tmp_path / "theirs.py").write_text(PACKAGE, encoding="utf-8")
    if way == "entry points":
        about = tmp_path / "theirs-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(ENTRY_POINTS)
    code = (CALLS if way == "calls" else "") + USE
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": paths},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("room", "taken", "get"),
    [
        (maneuvers, "braking", maneuvers.get_maneuver),
        (platform, "paper", platform.get_platform),
        (car, "sedan", car.get_car),
        (perception, "telban", perception.get_vestibular_model),
    ],
)
def test_a_name_is_given_once_and_an_unknown_one_refused(room, taken, get):
    with pytest.raises(ConfigurationError, match=f"'{taken}' is registered already"):
        room.register(taken, get(taken))
    with pytest.raises(ConfigurationError, match="not one word"):
        room.register("no/name", get(taken))
    with pytest.raises(UnknownNameError, match=f"Did you mean .*{taken}"):
        get(taken + "s")


def test_names_are_listed_without_warp_and_scipy():
    code = (
        "import sys\n"
        "from motion_cueing.envs.car import car_names\n"
        "from motion_cueing.envs.maneuvers import describe_maneuver, maneuver_names, recording_names\n"
        "from motion_cueing.envs.platform import ablation_names, platform_names\n"
        "assert all(map(describe_maneuver, maneuver_names())) and recording_names()\n"
        "assert car_names() and platform_names() and ablation_names()\n"
        "assert not {'warp', 'scipy', 'matplotlib', 'torch'} & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_missing_library_is_named_with_the_command_that_installs_it():
    registry = Registry("algorithm", "motion_cueing.nobody", extra="train")
    registry.register("mine", "no_such_library_anywhere:Mine")
    with pytest.raises(ConfigurationError, match=r"needs no_such_library.*gym\[train\]"):
        registry["mine"]
