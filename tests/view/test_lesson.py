"""The lesson that is served, and the swing of one mass, by which the page without a server is checked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.conformance.served import PATIENCE
from tests.view.browser import Page, browser
from tests.view.one_mass import STEP, swing

frequencies, dampings = st.floats(3.0, 10.0), st.floats(0.0, 0.3)


@given(frequencies, dampings)
def test_the_right_two_impulses_leave_nothing(f_d, zeta):
    unshaped, shaped = swing(f_d, zeta, None), swing(f_d, zeta, (f_d, zeta))
    assert shaped.left < 2e-3 * np.abs(unshaped.deflection).max()
    assert shaped.reference[-1] == pytest.approx(unshaped.reference[-1], abs=1e-9)


@given(frequencies, dampings)
def test_the_swing_is_the_equations_own(f_d, zeta):
    """δ'' + 2ζω δ' + ω² δ = -q̈ by differences, to the change of q̈ within two samples: it is constant within one."""
    one = swing(f_d, zeta, None)
    omega = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    second = np.diff(one.deflection, 2) / STEP**2
    first = (one.deflection[2:] - one.deflection[:-2]) / (2.0 * STEP)
    acceleration = np.diff(one.reference, 2) / STEP**2
    rest = second + 2.0 * zeta * omega * first + omega**2 * one.deflection[1:-1] + acceleration
    assert np.abs(rest).max() < 2.0 * np.abs(np.diff(acceleration)).max()


def test_every_browser_has_sliders_of_its_own():
    with Page("--serve", command="lesson") as served, browser() as chromium:
        first = opened(chromium, served)
        before = words(first)
        first.get_by_role("slider").first.press("End")
        first.get_by_role("button", name="Move the UR5e").click()
        first.wait_for_function("before => !document.body.innerText.includes(before)", arg=before)
        first.close()  # two pages drawn by software would share the processor
        assert words(opened(chromium, served)) == before
        assert len(served.lines) == 1, served.lines  # where the page is


def opened(chromium, served):
    page = chromium.new_context().new_page()
    page.set_default_timeout(PATIENCE * 1000.0)
    page.goto(served.url)
    return page


def words(page):
    return page.get_by_text("They are right for").inner_text()
