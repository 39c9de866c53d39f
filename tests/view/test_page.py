"""The page in a real browser: it shows the robot, moves it, and lets it go."""

import io
import json
import re
import signal

import numpy as np
import pytest
from PIL import Image
from tests.conformance.served import PATIENCE, Served, finished, free_endpoint
from tests.conformance.wire import STOPPED, TICK, Wire

from .browser import Page

pytestmark = pytest.mark.realtime

FIRST, SECOND = "ur5e-1", "ur5e-2"
SMALL = {"width": 400, "height": 400}  # window: drawing takes a processor
MS = PATIENCE * 1000.0
"""How long the page may take to show something [ms]: its graphics are computed, beside the other tests."""
SIZES = {"wide": {"width": 1280, "height": 800}, "phone": {"width": 390, "height": 844}}
HIGH = """() => { const seen = tvist.stage.scene.filled(); return seen && (seen.y[1] - seen.y[0]) / 2; }"""
"""Share of the scene's height that the arm takes, by the page's own projection."""


@pytest.fixture(scope="module")
def served():
    with Served("--robots", "ur5e*2", name=None) as robots:
        yield robots


@pytest.fixture(scope="module")
def view(served):
    with Page(served.endpoint, "--name", FIRST) as page:
        yield page


@pytest.fixture(scope="module")
def tab(chromium, view):
    page = opened(chromium, view)
    page.get_by_text("RUNNING, NORMAL").wait_for()
    yield page
    page.close()


@pytest.fixture
def wire(served):
    with Wire(served.endpoint, FIRST) as wire:
        wire.listen("state", "event")
        yield wire


def opened(chromium, view, **options):
    page = chromium.new_page(**({"viewport": SMALL} | options))
    page.set_default_timeout(MS)
    page.asked = []
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(view.url)
    return page


def take(tab):
    tab.get_by_role("button", name="Take control").click()
    tab.get_by_text("This tab has control.").wait_for()


def is_fast(state):
    return max(map(abs, state["target_qd"])) > 0.05


def press(tab, wire):
    """Press until the arm moves or its stream ends; return its state, and the events and states before."""
    events, states = len(wire.received["event"]), len(wire.received["state"])

    def has_ended():
        return any(event["kind"] == "stream_stopped" for event in wire.received["event"][events:])

    tab.mouse.down()
    return wire.wait("state", lambda state: is_fast(state) or has_ended(), since=states), events, states


def jog(tab, sign, wire):
    """Hold a button until the arm moves; return how many events and states came before.

    If a process stops for 0.25 s, so does the stream, until the button is pressed again.
    """
    take(tab)
    if tab.locator("#more").is_hidden():
        tab.get_by_role("button", name="more").click()
    button = tab.get_by_role("button", name=f"{sign} hold to jog")
    button.scroll_into_view_if_needed()
    button.hover()
    while True:
        state, events, states = press(tab, wire)
        if is_fast(state):
            return events, states
        tab.mouse.up()
        wire.until(state["tick"] + round(1.0 / TICK))  # until the server of the page has noticed


def silence(wire, stopped, states):
    """Return the time from the last played set-point to the stop [s], in ticks, since browsers may be slow."""
    wire.until(stopped["tick"])  # events overtake states
    played = [state for state in wire.received["state"][states:] if state["setpoint_sequence"] is not None]
    newest = max(state["setpoint_sequence"] for state in played)
    last = min(state["tick"] for state in played if state["setpoint_sequence"] == newest)
    return (stopped["tick"] - last) * TICK


@pytest.mark.parametrize(
    "text",
    ["{", '{"do":"nothing"}', '{"do":"move","first":"Q1","last":"Q9"}', '{"do":"jog","joint":99,"direction":1}',
     '{"do":"speed","fraction":7}', '{"do":"carry","mass":"x"}', '{"do":"robot","name":""}', "[1]",
     '{"do":"stop","x":1}'],
)  # fmt: skip
def test_invalid_message_of_a_tab_is_refused_without_effect(view, wire, text):
    from websockets.sync.client import connect

    before = wire.info()
    with connect(view.url.replace("http", "ws"), max_size=None) as tab:
        tab.send(text)
        while (told := json.loads(tab.recv(PATIENCE)))["type"] != "notice":
            pass
    assert told["text"]
    after = wire.info()
    assert (after["control"], after["payload"]) == (before["control"], before["payload"])


def test_page_draws_the_robot_without_other_requests(tab, view):
    tab.get_by_role("button", name="STOP").wait_for()
    tab.locator("canvas").first.wait_for()
    assert all(url.startswith((view.url, "data:", "blob:")) for url in tab.asked), tab.asked


def test_motion_of_the_page_moves_the_arm(tab, wire):
    take(tab)
    assert wire.info()["control"].startswith("view-")
    tab.get_by_role("button", name="front → left").click()
    wire.wait("state", is_fast)
    target = wire.info()["poses"]["Q2"]
    wire.wait("state", lambda state: state["target_q"] == pytest.approx(target, abs=1e-9))
    tab.get_by_role("button", name="Give back control").click()
    tab.get_by_text("Nobody has control.").wait_for()
    while wire.info()["control"] is not None:
        pass


def test_releasing_the_jog_button_stops_the_arm(tab, wire):
    events, states = jog(tab, "−", wire)
    tab.mouse.up()
    stopped = wire.wait("event", lambda event: event["kind"] == "stream_stopped", since=events)
    assert silence(wire, stopped, states) <= 0.26
    tab.get_by_role("button", name="Give back control").click()
    tab.get_by_text("Nobody has control.").wait_for()


def test_one_of_several_robots_can_be_selected(tab):
    for name in (SECOND, FIRST):
        tab.get_by_role("combobox", name="robot").select_option(name)
        tab.wait_for_function(f"tvist.info.name === '{name}' && tvist.last")


def test_closing_the_tab_in_a_jog_stops_the_arm_within_260_ms(tab, wire):
    """The last test of this tab."""
    events, states = jog(tab, "+", wire)
    tab.close()
    stopped = wire.wait("event", lambda event: event["kind"] == "stream_stopped", since=events)
    assert silence(wire, stopped, states) <= 0.26
    wire.wait("state", lambda state: state["tick"] > stopped["tick"] and state["runtime_state"] == STOPPED)
    while wire.info()["control"] is not None:
        pass


@pytest.mark.nightly
def test_tab_without_control_watches_and_may_stop(chromium):
    """The robot is in slow motion, since software draws two pages slowly."""
    with Served("--speed", "0.1") as robot, Page(robot.endpoint) as view, Wire(robot.endpoint) as wire:
        wire.listen("state", "event")
        tab, other = (opened(chromium, view) for _ in range(2))
        take(tab)
        other.get_by_text("Another tab has control").wait_for()
        assert other.get_by_role("button", name="front → left").is_disabled()
        tab.get_by_role("button", name="front → left").click()
        wire.wait("state", is_fast)
        other.get_by_role("button", name="STOP").click()
        wire.wait("event", lambda event: event["kind"] == "motion_stopped")
        tab.get_by_role("button", name="Give back control").click()
        other.get_by_text("Nobody has control.").wait_for()
        tab.close()
        other.close()


def in_sight(page):
    """Check that state, STOP, a plot and the magnification are inside the window, and that the arm is large."""
    page.get_by_text("RUNNING, NORMAL").wait_for()
    page.wait_for_function(f"({HIGH})() > 0")
    size = page.viewport_size
    bar = page.locator("#bar")
    for what in (
        bar.get_by_role("button", name="STOP"),
        bar.get_by_text("RUNNING, NORMAL"),
        bar.get_by_text("control"),
        page.get_by_role("figure", name="Tool acceleration"),
        page.get_by_text("bending × 100"),
    ):
        box = what.first.bounding_box()
        assert 0 <= box["x"] <= size["width"] - box["width"], what
        assert 0 <= box["y"] <= size["height"] - box["height"], what
    assert page.evaluate(HIGH) > 0.35
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]


@pytest.mark.nightly
@pytest.mark.parametrize("name", SIZES)
def test_first_screen_shows_arm_state_stop_and_plot(chromium, view, name):
    page = opened(chromium, view, viewport=SIZES[name], color_scheme="dark")
    in_sight(page)
    picture = Image.open(io.BytesIO(page.locator("#scene canvas").screenshot())).convert("L")
    bright = np.flatnonzero((np.asarray(picture) > 140).sum(axis=1) > 2)  # on the dark ground only the arm is
    assert np.ptp(bright) > 0.3 * picture.height
    page.close()


@pytest.mark.nightly
def test_comparison_on_the_page_agrees_with_log_analyze(tmp_path, chromium):
    file = tmp_path / "ab.mcap"
    with (
        Served("--truth", "--record", str(file)) as robot,
        Page(robot.endpoint) as view,
        Wire(robot.endpoint) as wire,
    ):
        page = opened(chromium, view)
        page.get_by_role("button", name="A/B").click()
        card = page.locator(".card")
        card.get_by_text("vibration").wait_for()
        less = float(re.search(r"(\d+) % less", card.inner_text()).group(1))
        assert page.get_by_role("figure", name="Tool acceleration").first.get_by_text("with zv").is_visible()
        page.close()
        while wire.info()["control"] is not None:
            pass
        assert wire.info()["shaper"] == "zv"
    told = json.loads(finished("-m", "tvist_cli", "log", "analyze", file, "--json").stdout)
    before, after = (one["peak_m_s2"] for one in (told["motions"][0], told["motions"][-1]))
    assert less == pytest.approx(100.0 * (1.0 - after / before), abs=1.0)


@pytest.mark.nightly
def test_page_and_terminal_wait_for_a_missing_robot(chromium):
    endpoint = free_endpoint()
    with Page(endpoint) as view:
        view.wait_until_said("waiting for the robot")
        assert "no server answers" in view.said
        page = opened(chromium, view, viewport=SIZES["wide"])
        page.get_by_text("No robot.").wait_for()
        for _ in range(2):  # what comes back looks as it did at first
            with Served("--name", "ur5e", name=None, endpoint=endpoint):
                in_sight(page)
            page.get_by_text("The robot has gone.").wait_for()
        page.close()
        view.process.send_signal(signal.SIGINT)
        assert view.process.wait(PATIENCE) == 130
