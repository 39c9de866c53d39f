"""The checklist for a real arm: what the robot reports completes each step, also on the page."""

import pytest
from msgspec.structs import replace
from tests.conformance.served import PATIENCE, Served
from tests.places import free_endpoint, own_address
from tests.view.browser import Page

from tvist_controller.api.robot import LoopbackHost, info_of
from tvist_lab.in_process import free_setup
from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_view.described import ObservedArm


@pytest.fixture(scope="module")
def info():
    return info_of(LoopbackHost(free_setup()).controller)


class Seen:
    """The fields of a state that the checklist reads."""

    def __init__(self, mode=RobotMode.RUNNING, safety=SafetyMode.NORMAL, speed=0.0):
        self.robot_mode, self.safety_mode, self.target_qd = mode, safety, [speed] * 6


def done(way, info, state, io=None):
    return [step[0] for step in way.steps(info, state, io)]


def test_checklist_of_a_watched_robot(info):
    assert done(ObservedArm(), info, Seen()) == []  # a simulated robot has none
    way, there = ObservedArm(), replace(info, watched="ur://robot")
    assert done(way, there, Seen(RobotMode.DISCONNECTED, SafetyMode.UNDEFINED)) == [False] * 5
    assert done(way, there, Seen(RobotMode.POWER_OFF)) == [True, *[False] * 4]
    assert done(way, there, Seen(speed=0.2)) == [True, True, True, False, False]
    own = replace(info.calibration, shipped=False)
    assert done(way, replace(there, calibration=own), Seen()) == [True, True, True, True, False]


def test_checklist_of_a_moved_robot(info):
    way, there = ObservedArm(), replace(info, moved="ur://robot")
    assert done(way, there, Seen(RobotMode.POWER_OFF)) == [False] * 7
    assert done(way, there, Seen()) == [True, *[False] * 6]
    way.seen |= {"motion_done", "motion_stopped", "safety_stop"}
    assert done(way, there, Seen(RobotMode.POWER_OFF)) == [False, False, True, True, False, False, False]
    way.seen.add("compared")
    assert done(way, there, Seen()) == [True, False, True, True, True, True, False]


def test_checklist_shows_the_speed_cap_and_the_reason_of_a_stop(info):
    slow = replace(info.limits, velocity=[0.5] * 6)
    stop = StopReason(tick=1, code=None, why="its program was paused")
    there = replace(info, moved="ur://robot", limits=slow, stop=stop)
    steps = ObservedArm().steps(there, Seen(RobotMode.POWER_OFF), None)
    assert steps[0][2] == "its program was paused"
    assert "0.5 rad/s" in steps[2][1]


@pytest.mark.nightly
@pytest.mark.realtime
def test_page_leads_through_the_checklist_and_disables_what_has_no_effect(chromium):
    host, endpoint = own_address(73), free_endpoint()
    robot = ("--ur", "--ur-address", host, "--hidden", "1001", "--profile", "real", "--shaper", "none")
    with (
        Served(*robot),
        Served("--plant", f"ur://{host}", name="arm", endpoint=endpoint) as arm,
        Page(endpoint, "--name", "arm") as page,
    ):
        tab = chromium.new_page(viewport={"width": 1280, "height": 800})
        tab.set_default_timeout(PATIENCE * 1000.0)
        tab.goto(page.url)
        tab.get_by_text("Real arm, step 3 of 5").wait_for()
        for name in ("STOP", "Take control"):
            button = tab.get_by_role("button", name=name)
            assert button.is_disabled()
            assert "only watched" in button.get_attribute("title")
        assert tab.get_by_role("button", name="Hold it").is_hidden()
        assert arm.end() == 0
        tab.get_by_text("The page waits for it").wait_for()
        moving = ("--plant", f"ur://{host}", "--enable-motion")
        with Served(*moving, name="arm", endpoint=endpoint):
            tab.get_by_text("of 7", exact=False).wait_for()
            assert tab.get_by_role("button", name="STOP").is_enabled()
            assert "0.5 rad/s" in tab.get_by_role("list").inner_text()
