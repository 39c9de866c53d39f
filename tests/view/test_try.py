"""The interactive shaping page as shipped: it computes the packages' numbers, and its address holds its state."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.view import page_numbers

from tvist_shaping.catalogue import SHAPERS

ROOT = Path(__file__).parents[2]
FILE = ROOT / "view" / "tvist_view" / "try.html"
SOURCES = ROOT / "view" / "page" / "try"
PATIENCE_MS = 60_000.0
PHONE, LAPTOP = {"width": 390, "height": 844}, {"width": 1280, "height": 800}


@pytest.fixture(scope="module")
def page(chromium):
    """The page, offline; fails at the end if it has reported an error."""
    errors = []
    page = chromium.new_context(viewport=PHONE, offline=True).new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.on("pageerror", lambda error: errors.append(str(error)))
    show(page, "")
    press(page, "pause")
    yield page
    page.context.close()
    assert not errors


@pytest.fixture
def own(page):
    """The page's scene in which users type a shaper of their own."""
    show(page, "#scene=own&z=0")
    return page


def show(page, state):
    page.goto(f"{FILE.as_uri()}{state}")


def press(page, name):
    """Press a button without waiting for pictures, which take a processor."""
    page.get_by_role("button", name=name).dispatch_event("click")


def close(found, wanted, most=1e-9):
    assert np.shape(found) == np.shape(wanted)
    assert np.abs(np.array(found) - np.array(wanted)).max() <= most


def test_page_has_every_catalogued_shaper(page):
    assert page.evaluate("tried.missing") == []
    assert page.evaluate("Object.keys(tried.SHAPERS)") == list(SHAPERS)


@pytest.mark.parametrize("name", SHAPERS)
def test_shapers_of_the_page_match_the_library(page, name):
    for mode in page_numbers.MODES:
        true, wanted = page_numbers.of_shaper(name, *mode)
        found = page.evaluate(
            """([name, [f_d, zeta], f]) => { const made = tried.SHAPERS[name](f_d, zeta);
            return { ...made, residual: f.map((one) => tried.residual(one, zeta, made)) }; }""",
            [name, mode, true],
        )
        for key, values in wanted.items():
            close(found[key], values)
    found = page.evaluate("(name) => tried.band(tried.SHAPERS[name](1, 0), 1, 0, 0.05)", name)
    assert found == pytest.approx(SHAPERS[name].band(0.05), abs=1e-9, nan_ok=True)


def test_filter_of_the_page_matches_the_library(page):
    samples, wanted = page_numbers.filtered()
    found = page.evaluate(
        """(samples) => { const mode = tried.following(tried.parameters);
        const one = new tried.Filter(tried.SHAPERS.zvd, mode, [0.1, 2.5], 0.002);
        return samples.map((sample) => one.filter(sample)); }""",
        samples,
    )
    close(found, wanted)


def test_mass_of_the_page_matches_a_linear_simulation(page):
    found = page.evaluate("([its, set]) => tried.swing(...its, tried.SHAPERS.zv(...set))", page_numbers.SWING)
    for key, wanted in page_numbers.swung().items():
        close(found[key], wanted)


@pytest.mark.parametrize("motion", page_numbers.MOTIONS, ids=lambda one: f"{one[0]} {one[1]}")
def test_motion_of_the_page_matches_the_simulated_arm(page, motion):
    wanted = page_numbers.moved(*motion)
    found = page.evaluate(
        """([shaper, estimator, start, target]) => { const arm = tried.parameters;
        const mode = estimator === "following" ? tried.following(arm) : tried.fixed(...tried.modeOf(arm, Math.PI / 2));
        return tried.run(arm, start, target, tried.SHAPERS[shaper], mode, 500).link; }""",
        motion,
    )
    close(found[: len(wanted)], wanted)


def test_every_scene_opens_offline_and_fits_the_window(page):
    for size, button in (PHONE, "play"), (LAPTOP, "pause"):  # the small pictures are drawn, too
        page.set_viewport_size(size)
        press(page, button)
        for scene in ("ur5e", "mass", "arm", "own"):
            show(page, f"#scene={scene}")
            page.locator(f"body[data-scene={scene}]").get_by_text("is left").first.wait_for()
            assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
            box = page.locator("#stage").bounding_box()
            assert box["y"] + box["height"] <= size["height"]
    assert FILE.stat().st_size <= 1.5e6


def test_address_and_sliders_stay_in_step(page):
    show(page, "#scene=mass&e=20")
    left = page.locator("#large").inner_text()
    page.get_by_role("slider", name="model error").press("Home")
    assert "e=-50" in page.url
    shown = page.locator("#large").inner_text()
    assert shown != left
    page.reload()
    press(page, "pause")
    assert page.locator("#large").inner_text() == shown


def test_unknown_parts_of_a_link_are_listed(page):
    show(page, "#scene=mass&f=900&s=nothing&toString=1&__proto__=1")
    assert "f=900, s=nothing, toString=1, __proto__=1" in page.get_by_role("alert").first.inner_text()


@pytest.mark.parametrize(
    ("A", "t", "field", "said"),
    [
        ("0.5, 0.4", "0, 0.3", "A", "add up to 0.9, and must add up to 1"),
        ("0.5, 0.5", "0, -0.1", "t", "no delay may be negative"),
        ("0.5, 0.5", "0.1, 0.3", "t", "must be 0"),
        ("0.3, 0.3, 0.4", "0, 0.3, 0.2", "t", "Delays must rise"),
        ("half, half", "0, 0.3", "A", "“half” is not understood"),
        ("0.5, 0.5", "0, 1/", "t", "ends too early"),
        ("0.5, 0.5", "0", "t", "2 amplitudes and 1 delays"),
        ("", "0", "A", "at least one amplitude"),
        ("1/0, 1", "0, 1", "A", "no finite number"),
    ],
)  # fmt: skip
def test_invalid_shaper_is_explained_beside_its_field(own, A, t, field, said):
    own.locator("#own-A").fill(A)
    own.locator("#own-t").fill(t)
    assert said in own.locator(f".field:has(#own-{field}) .wrong").inner_text()
    assert own.locator(".verdict").is_hidden()


def test_valid_own_shaper_is_judged_at_once(own):
    own.locator("#own-A").fill("1/3, 1/3, 1/3")
    own.locator("#own-t").fill("0, T/3, 2T/3")
    assert own.locator("#large").inner_text() == "0.0 % is left"
    assert "417 ms = 0.67 swings" in own.locator(".judged").inner_text()
    own.locator("#own-A").fill("1, 2, 1")
    own.get_by_role("button", name="divide by the sum").click()
    assert own.locator("#own-A").input_value() == "(1)/4, (2)/4, (1)/4"
    assert own.locator(".verdict").is_visible()


def test_every_word_of_the_page_is_used():
    words = json.loads((SOURCES / "words.json").read_text())
    code = "".join(path.read_text() for path in SOURCES.glob("*.ts"))
    idle = [key for key in words if f'"{key}"' not in code and not key.startswith(("tab_", "head_", "lead_"))]
    assert not idle
