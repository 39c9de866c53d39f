"""The page for trying shaping, as it is shipped: its numbers are the packages', and it shows what its address says."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.view import page_numbers
from tests.view.browser import browser

from tvist_shaping.catalogue import SHAPERS

ROOT = Path(__file__).parents[2]
FILE = ROOT / "view" / "tvist_view" / "try.html"
SOURCES = ROOT / "view" / "page" / "try"
PATIENCE_MS = 60_000.0


@pytest.fixture(scope="module")
def chromium():
    with browser() as started:
        yield started


@pytest.fixture
def opened(chromium):
    pages, errors = [], []

    def at(state="", width=1280, height=800):
        page = chromium.new_context(viewport={"width": width, "height": height}, offline=True).new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"{FILE.as_uri()}{state}")
        pages.append(page)
        return page

    yield at
    for page in pages:
        page.context.close()
    assert not errors


@pytest.fixture(scope="module")
def numbers(chromium):
    page = chromium.new_page()
    page.goto(FILE.as_uri())
    yield page
    page.close()


def close(found, wanted, most=1e-9):
    assert np.shape(found) == np.shape(wanted)
    assert np.abs(np.array(found) - np.array(wanted)).max() <= most


def test_the_page_has_every_row_of_the_catalogue(numbers):
    assert numbers.evaluate("tried.missing") == []
    assert numbers.evaluate("Object.keys(tried.SHAPERS)") == list(SHAPERS)


@pytest.mark.parametrize("name", SHAPERS)
def test_a_shaper_is_that_of_the_library(numbers, name):
    for mode in page_numbers.MODES:
        true, wanted = page_numbers.of_shaper(name, *mode)
        found = numbers.evaluate(
            """([name, [f_d, zeta], f]) => { const made = tried.SHAPERS[name](f_d, zeta);
            return { ...made, residual: f.map((one) => tried.residual(one, zeta, made)) }; }""",
            [name, mode, true],
        )
        for key, values in wanted.items():
            close(found[key], values)
    found = numbers.evaluate("(name) => tried.band(tried.SHAPERS[name](1, 0), 1, 0, 0.05)", name)
    assert found == pytest.approx(SHAPERS[name].band(0.05), abs=1e-9, nan_ok=True)


def test_the_filter_is_that_of_the_library(numbers):
    samples, wanted = page_numbers.filtered()
    found = numbers.evaluate(
        """(samples) => { const mode = tried.following(tried.parameters);
        const one = new tried.Filter(tried.SHAPERS.zvd, mode, [0.1, 2.5], 0.002);
        return samples.map((sample) => one.filter(sample)); }""",
        samples,
    )
    close(found, wanted)


def test_the_mass_swings_as_the_lesson_says(numbers):
    found = numbers.evaluate(
        "([mode, believed]) => tried.swing(...mode, tried.SHAPERS.zv(...believed))", page_numbers.SWING
    )
    for key, wanted in page_numbers.swung().items():
        close(found[key], wanted)


@pytest.mark.parametrize("motion", page_numbers.MOTIONS, ids=lambda one: f"{one[0]} {one[1]}")
def test_a_whole_motion_is_that_of_the_simulated_arm(numbers, motion):
    wanted = page_numbers.moved(*motion)
    found = numbers.evaluate(
        """([shaper, estimator, start, target]) => { const arm = tried.parameters;
        const mode = estimator === "following" ? tried.following(arm) : tried.fixed(...tried.modeOf(arm, Math.PI / 2));
        return tried.run(arm, start, target, tried.SHAPERS[shaper], mode, 500).link; }""",
        motion,
    )
    close(found[: len(wanted)], wanted)


@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
@pytest.mark.parametrize("scene", ["mass", "arm", "own", "ur5e"])
def test_every_scene_opens_from_a_file_without_a_network(opened, scene, size):
    page = opened(f"#scene={scene}", *size)
    page.get_by_text("is left").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    box = page.locator("#stage").bounding_box()
    assert box["y"] + box["height"] <= size[1]
    assert FILE.stat().st_size <= 1.5e6


def test_a_slider_changes_the_address_and_the_address_the_page(opened):
    page = opened("#scene=mass&e=20")
    left = page.locator("#large").inner_text()
    page.get_by_role("slider", name="model error").press("Home")
    assert "e=-50" in page.url
    assert page.locator("#large").inner_text() != left
    again = opened(page.url.partition("try.html")[2])
    assert again.locator("#large").inner_text() == page.locator("#large").inner_text()


def test_what_of_a_link_is_not_understood_is_said(opened):
    page = opened("#scene=mass&f=900&s=nothing&toString=1&__proto__=1")
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
def test_a_wrong_shaper_is_one_sentence_beside_its_field(opened, A, t, field, said):
    page = opened("#scene=own")
    page.locator("#own-A").fill(A)
    page.locator("#own-t").fill(t)
    error = page.locator(f".field:has(#own-{field}) .wrong")
    assert said in error.inner_text()
    assert page.locator(".verdict").is_hidden()


def test_a_right_shaper_of_ones_own_is_judged_at_once(opened):
    page = opened("#scene=own&z=0")
    page.locator("#own-A").fill("1/3, 1/3, 1/3")
    page.locator("#own-t").fill("0, T/3, 2T/3")
    assert page.locator("#large").inner_text() == "0.0 % is left"
    assert "417 ms = 0.67 swings" in page.locator(".judged").inner_text()
    page.locator("#own-A").fill("1, 2, 1")
    page.get_by_role("button", name="divide by the sum").click()
    assert page.locator("#own-A").input_value() == "(1)/4, (2)/4, (1)/4"
    assert page.locator(".verdict").is_visible()


def test_every_word_is_in_the_one_file_and_is_used():
    words = json.loads((SOURCES / "words.json").read_text())
    code = "".join(path.read_text() for path in SOURCES.glob("*.ts"))
    unused = [
        key for key in words if f'"{key}"' not in code and not key.startswith(("tab_", "head_", "lead_"))
    ]
    assert not unused
