"""The page in a real browser: it shows the robot, moves it, and lets it go."""

import signal

import pytest
from tests.conformance.served import PATIENCE, Served, free_endpoint
from tests.conformance.wire import TICK, Wire

from .browser import Page, browser

pytestmark = pytest.mark.realtime

Q3 = 2
STOPPED = 1
MS = PATIENCE * 1000.0
"""How long the page may take to show something [ms]: its graphics are computed, beside the other tests."""
ON_PHONE = """element => { const box = element.getBoundingClientRect();
return box.x >= 0 && box.right <= 390 && box.y >= 0 && box.bottom <= 844; }"""


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture(scope="module")
def served():
    with Served("--truth") as robot:
        yield robot


@pytest.fixture(scope="module")
def view(served):
    with Page(served.endpoint, "--magnify", "100") as page:
        yield page


@pytest.fixture
def tab(chromium, view):
    page = chromium.new_page(viewport={"width": 800, "height": 600})
    page.set_default_timeout(MS)
    page.goto(view.url)
    page.get_by_text("RUNNING, NORMAL").wait_for()
    yield page
    page.close()


@pytest.fixture
def wire(served):
    with Wire(served.endpoint) as wire:
        wire.listen("state", "event")
        yield wire


def take(tab):
    tab.get_by_role("button", name="Take control").click()
    tab.get_by_text("This tab has control.").wait_for()


def moving(wire, *, since=0):
    return wire.wait("state", lambda state: max(map(abs, state["target_qd"])) > 0.05, since=since)


def silence(wire, stopped):
    """From the last set-point that was played to the stop [s]: ticks, since a browser may take its time."""
    played = [state for state in wire.received["state"] if state["setpoint_sequence"] is not None]
    newest = max(state["setpoint_sequence"] for state in played)
    last = min(state["tick"] for state in played if state["setpoint_sequence"] == newest)
    return (stopped["tick"] - last) * TICK


def test_the_page_draws_the_robot_and_asks_nothing_of_the_network(chromium, view):
    page = chromium.new_page(viewport={"width": 800, "height": 600})
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(view.url)
    page.get_by_text("RUNNING, NORMAL").wait_for(timeout=MS)
    page.get_by_role("button", name="STOP").wait_for(timeout=MS)
    page.locator("canvas").first.wait_for(timeout=MS)
    assert all(url.startswith((view.url, "data:", "blob:")) for url in asked), asked
    page.close()


def test_a_motion_of_the_page_moves_the_arm(tab, wire, served):
    take(tab)
    assert wire.info()["control"].startswith("view-")
    tab.get_by_role("button", name="Q1 → Q3").click()
    moving(wire)
    target = wire.info()["poses"]["Q3"]
    wire.wait(
        "state", lambda state: max(abs(a - b) for a, b in zip(state["target_q"], target, strict=True)) < 1e-9
    )
    tab.get_by_role("button", name="Give back control").click()
    tab.get_by_text("Nobody has control.").wait_for()
    while wire.info()["control"] is not None:
        pass


def test_closing_the_tab_in_a_jog_stops_the_arm_within_260_ms_of_the_last_set_point(chromium, view, wire):
    page = chromium.new_page(viewport={"width": 800, "height": 600})
    page.set_default_timeout(MS)
    page.goto(view.url)
    take(page)
    page.get_by_text("Joints", exact=True).click()
    button = page.get_by_role("button", name="+ hold to jog")
    button.scroll_into_view_if_needed()
    button.hover()
    page.mouse.down()
    moving(wire)
    page.close()
    stopped = wire.wait("event", lambda event: event["kind"] == "stream_stopped")
    assert silence(wire, stopped) <= 0.26
    wire.wait("state", lambda state: state["tick"] > stopped["tick"] and state["runtime_state"] == STOPPED)
    while wire.info()["control"] is not None:
        pass


def test_letting_the_jog_button_go_stops_the_arm(tab, wire):
    take(tab)
    tab.get_by_text("Joints", exact=True).click()
    button = tab.get_by_role("button", name="− hold to jog")
    button.scroll_into_view_if_needed()
    button.hover()
    tab.mouse.down()
    moving(wire)
    tab.mouse.up()
    stopped = wire.wait("event", lambda event: event["kind"] == "stream_stopped")
    assert silence(wire, stopped) <= 0.26
    tab.get_by_role("button", name="Give back control").click()
    tab.get_by_text("Nobody has control.").wait_for()


@pytest.mark.nightly
def test_one_tab_has_control_the_other_watches_and_may_stop(chromium):
    """The robot is in slow motion, since software draws two pages slowly."""
    with (
        Served("--truth", "--speed", "0.1") as robot,
        Page(robot.endpoint) as view,
        Wire(robot.endpoint) as wire,
    ):
        wire.listen("state", "event")
        tab, other = (chromium.new_page(viewport={"width": 500, "height": 400}) for _ in range(2))
        for page in (tab, other):
            page.set_default_timeout(MS)
            page.goto(view.url)
        take(tab)
        other.get_by_text("Another tab has control").wait_for()
        assert other.get_by_role("button", name="Q1 → Q2").is_disabled()
        tab.get_by_role("button", name="Q1 → Q2").click()
        moving(wire)
        other.get_by_role("button", name="STOP").click()
        wire.wait("event", lambda event: event["kind"] == "motion_stopped")
        tab.get_by_role("button", name="Give back control").click()
        other.get_by_text("Nobody has control.").wait_for()
        tab.close()
        other.close()


def test_on_a_phone_the_first_screen_has_a_plot_and_stop(chromium, view):
    phone = chromium.new_page(viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True)
    phone.goto(view.url)
    for what in (phone.get_by_role("button", name="STOP"), phone.get_by_text("Tool acceleration")):
        what.wait_for(timeout=MS)
        # The sheet with the controls slides in from below.
        phone.wait_for_function(ON_PHONE, arg=what.element_handle(), timeout=MS)
    phone.close()


def test_where_there_is_no_robot_the_page_and_the_terminal_say_so_and_wait(chromium):
    endpoint = free_endpoint()
    with Page(endpoint) as view:
        view.said("no server answers.*waiting for the robot")
        page = chromium.new_page()
        page.goto(view.url)
        page.get_by_text("No robot.").wait_for(timeout=MS)
        with Served("--name", "ur5e", name=None, endpoint=endpoint):
            page.get_by_text("RUNNING, NORMAL").wait_for(timeout=MS)
            page.get_by_text("tvist serve --truth").wait_for(timeout=MS)
        page.get_by_text("The robot has gone.").wait_for(timeout=MS)
        page.close()
        view.process.send_signal(signal.SIGINT)
        assert view.process.wait(PATIENCE) == 130
