"""The view in a real browser: the machine stands as the trajectory says, and no mouse is needed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motion_cueing.envs.cues import CueTrace
from motion_cueing.envs.platform import get_platform
from motion_cueing.evaluation.metrics import measure
from motion_cueing.evaluation.policies import make_policy
from motion_cueing.evaluation.reporting.view import pack_view, save_view
from motion_cueing.evaluation.rollout import rollout

from ....browser import chromium, opened

pytestmark = pytest.mark.slow

MARKUP = "<img src=x onerror=\"document.title='broken'\">"
MACHINES = ("paper", "dim-hexapod", "24-inch")


def weave(name: str = "weave") -> CueTrace:
    """A car that weaves and brakes for 8 s, with the place it is at."""
    time = 0.01 * np.arange(801)
    sway = 3.0 * np.sin(2.0 * np.pi * 0.3 * time)
    force = np.column_stack([-2.0 * (time > 4.0), sway, np.full_like(time, -9.81)])
    rate = np.column_stack([0.02 * sway, np.zeros_like(time), 0.1 * sway])
    return CueTrace(name, time, force, rate, channels={"speed_m_s": np.full_like(time, 20.0)})


def driven(platform, policy="classical"):
    return replace(rollout(make_policy(policy, platform), weave(), platform=platform), policy=policy)


@pytest.fixture(scope="module")
def browser():
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def drives():
    """By machine: two policies, one of them with markup for a name; on small machines one."""
    machines = {name: get_platform(name) for name in MACHINES}
    found = {name: {"classical": driven(machine)} for name, machine in machines.items()}
    found["paper"][MARKUP] = replace(driven(machines["paper"], "no-motion"), policy=MARKUP)
    return found


@pytest.fixture(scope="module")
def pages(browser, drives, tmp_path_factory):
    """A page of each machine, with what it complained of."""
    folder = tmp_path_factory.mktemp("view")
    found = {}
    for name, policies in drives.items():
        packed = {"weave": pack_view(policies, weave())}
        if name == "paper":
            packed[f"calm {MARKUP}"] = pack_view({"classical": policies["classical"]})
        save_view(packed, get_platform(name), folder / f"{name}.html")
        page, troubles = opened(browser, (folder / f"{name}.html").as_uri())
        page.wait_for_function("window.motionCueingView?.ready === 0")
        found[name] = page, troubles
    return found


@pytest.fixture
def page(pages):
    """The page of the paper's machine at its begin."""
    page = pages["paper"][0]
    page.set_viewport_size({"width": 1400, "height": 900})
    page.select_option("#drive", "weave")
    page.wait_for_function("motionCueingView.ready === 0")
    page.evaluate(
        "() => { motionCueingView.film.toggle(false); motionCueingView.film.view('outside');"
        " document.activeElement.blur(); motionCueingView.film.seek(0); }"
    )
    return page


def moment(page):
    return page.evaluate("motionCueingView.film.time")


def test_it_opens_without_a_complaint_and_loads_nothing(pages):
    for page, troubles in pages.values():
        assert troubles == []
        assert page.locator("#trouble").is_hidden()
        assert page.locator("canvas").count() > 1


def test_a_name_with_markup_stays_text(page):
    assert page.locator("img").count() == 0
    assert MARKUP in page.locator(".stage .name").all_text_contents()
    assert "broken" not in page.title()
    # Of the page `calm`, which has no car's road, a drive with markup in its name.
    page.select_option("#drive", f"calm {MARKUP}")
    page.wait_for_function("motionCueingView.ready === 1")
    assert page.locator("img").count() == 0
    assert page.locator(".map").is_hidden()


@pytest.mark.parametrize("name", MACHINES)
def test_scrubbing_moves_the_legs_to_the_lengths_of_the_trajectory(pages, drives, name):
    page, drive = pages[name][0], drives[name]["classical"]
    neutral = get_platform(name).hexapod.neutral_lengths
    scrubber = page.get_by_role("slider", name="Moment of the drive, s")
    for row in (0, 333, 520, 800):
        scrubber.fill(f"{drive.time[row]:.2f}")
        drawn, use, place = page.evaluate(
            "() => { const { stage } = motionCueingView.film.stages[0];"
            " const legs = stage.legs.map(({ barrel, rod }) => barrel.scale.z + rod.scale.z);"
            " return [legs, Array.from(stage.use), stage.carriage.position.toArray()]; }"
        )
        np.testing.assert_allclose(drawn, neutral + drive.legs[row], atol=1e-3)
        limits = np.where(
            drive.legs[row] >= 0.0, drive.limits.position_max[2:8], -drive.limits.position_min[2:8]
        )
        np.testing.assert_allclose(use, drive.legs[row] / limits, atol=5e-3)
        np.testing.assert_allclose(place[:2], drive.carriage[row], atol=1e-3)


def test_rods_end_in_the_joints_and_the_driver_sits_where_the_kinematics_say(page, drives):
    """The head's place by rotation matrices of its own: Rx(roll) Ry(pitch) Rz(yaw + turntable)."""
    drive, platform = drives["paper"]["classical"], get_platform("paper")
    row = 520
    page.evaluate(f"motionCueingView.film.seek({drive.time[row]})")
    roll, pitch, yaw = drive.hexapod[row, 3:]

    def turned(axis, angle):
        a, b = [k for k in range(3) if k != axis]
        matrix = np.eye(3)
        matrix[a, a] = matrix[b, b] = np.cos(angle)
        sign = -1.0 if axis != 1 else 1.0
        matrix[a, b], matrix[b, a] = sign * np.sin(angle), -sign * np.sin(angle)
        return matrix

    base = turned(0, roll) @ turned(1, pitch) @ turned(2, yaw)
    origin = np.array([*drive.carriage[row], 0.0]) + platform.hexapod.neutral + drive.hexapod[row, :3]
    upper = np.array(platform.hexapod.upper_joints) @ base.T + origin
    cab = np.array(platform.cab.reference_point) + platform.cab.head
    head = base @ turned(2, drive.turntable[row]) @ cab + origin
    joints, eye = page.evaluate(
        "() => { const { stage } = motionCueingView.film.stages[0];"
        " return [stage.legs.map(({ joint }) => joint.position.toArray()),"
        " stage.turntable.localToWorld(new THREE.Vector3(...stage.scene.head)).toArray()]; }"
    )
    np.testing.assert_allclose(joints, upper, atol=1e-3)
    np.testing.assert_allclose(eye, head, atol=1e-3)


def test_the_picture_shows_the_machine_and_the_camera_of_the_head_another_one(page):
    """What is drawn is no empty canvas: many colors, and others from the driver's head."""

    def colors():
        return page.evaluate(
            "() => { const { stage } = motionCueingView.film.stages[0]; stage.render();"
            " const c = document.createElement('canvas'); c.width = 64; c.height = 64;"
            " const x = c.getContext('2d'); x.drawImage(stage.canvas, 0, 0, 64, 64);"
            " return Array.from(x.getImageData(0, 0, 64, 64).data); }"
        )

    outside = np.array(colors()).reshape(-1, 4)
    assert len(np.unique(outside, axis=0)) > 200
    page.get_by_role("button", name="Driver's head").click()
    inside = np.array(colors()).reshape(-1, 4)
    assert np.abs(outside - inside).mean() > 10.0
    page.get_by_role("button", name="Outside").click()
    np.testing.assert_allclose(np.array(colors()).reshape(-1, 4), outside, atol=30)


def test_the_cue_error_of_each_policy_is_beside_its_name(page, drives):
    shown = page.locator(".stage .score").all_text_contents()
    for text, drive in zip(shown, drives["paper"].values(), strict=True):
        assert float(text.removeprefix("J ")) == pytest.approx(measure(drive).cue_error, rel=0.01)


def test_the_keyboard_moves_plays_and_changes_the_camera(page):
    page.keyboard.press("ArrowRight")
    assert moment(page) == pytest.approx(1.0 / 30.0)
    page.keyboard.press("Shift+ArrowRight")
    assert moment(page) == pytest.approx(1.0 + 1.0 / 30.0)
    page.keyboard.press("End")
    assert moment(page) == 8.0
    page.keyboard.press("Home")
    assert moment(page) == 0.0
    page.keyboard.press("Space")
    page.wait_for_function("motionCueingView.film.time > 0.2")
    assert page.get_by_role("button", name="Pause").is_visible()
    page.keyboard.press("Space")
    before = moment(page)
    page.wait_for_timeout(200)
    assert moment(page) == before
    page.keyboard.press("c")
    assert page.get_by_role("button", name="Driver's head").get_attribute("aria-pressed") == "true"


def test_both_machines_are_seen_from_the_same_place_and_at_the_same_time(page, drives):
    page.evaluate("motionCueingView.film.seek(5)")
    page.keyboard.press("d")
    places = page.evaluate(
        "() => motionCueingView.film.stages.map(({ stage }) =>"
        " stage.camera.position.clone().sub(stage.controls.target).toArray())"
    )
    np.testing.assert_allclose(places[0], places[1], atol=1e-6)
    carriages = page.evaluate(
        "() => motionCueingView.film.stages.map(({ stage }) => stage.carriage.position.toArray())"
    )
    for place, drive in zip(carriages, drives["paper"].values(), strict=True):
        np.testing.assert_allclose(place[:2], drive.carriage[500], atol=1e-3)


def test_a_click_in_a_plot_goes_to_its_moment(page):
    over = page.locator(".charts .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 30)
    assert moment(page) == pytest.approx(4.0, abs=0.05)


@pytest.mark.parametrize("width", [1400, 420])
def test_it_passes_the_accessibility_check_at_any_width(page, width):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page.set_viewport_size({"width": width, "height": 900})
    found = axe.Axe().run(page)
    assert found.violations_count == 0, found.generate_report()
    assert page.evaluate("document.documentElement.scrollWidth") == width
