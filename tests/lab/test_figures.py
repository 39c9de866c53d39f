"""The figures show the numbers they stand for, and curves can be told apart without colours and by the colour-blind."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tvist_lab.metrics import motions
from tvist_lab.metrics.residual import residual as measured
from tvist_lab.studies.moves import example
from tvist_shaping import SHAPERS, custom, residual

TICKS = 1500
UNSHAPED = "#d55e00"
MODE = ("estimated_f_d", "estimated_zeta")
DEUTERANOPIA = np.array(
    [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
)
"""What one without M cones sees, in linear RGB (Machado, Oliveira and Fernandes, 2009, severity 1)."""
PROTANOPIA = np.array(
    [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
)
"""The same without L cones."""
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""Of linear RGB."""
MAIN = list(itertools.combinations(range(3), 2))
"""Pairs of the main series."""


@pytest.fixture(autouse=True)
def _styled(figures):
    with figures.house_style():
        yield


def texts(panel):
    return [text.get_text() for text in panel.texts]


def test_figure_4_shows_that_the_least_sensitive_shaper_leaves_36_percent(figures):
    figure = figures.figure_4()
    (panel,) = figure.axes
    assert any(text.startswith("35.8 %") for text in texts(panel))
    curves = {line.get_label(): line.get_xydata() for line in panel.get_lines()}
    ei = curves["EI 5 %"]
    assert np.interp(15.0, *ei.T) == pytest.approx(35.82, abs=0.05)
    assert np.interp(10.5, *curves["ZV"].T) == pytest.approx(0.0, abs=0.1)


def test_figure_7_shows_rounded_delays_jump_and_fractional_ones_not(figures):
    rounded, fractional, *_ = figures.figure_7().axes[2].get_lines()
    assert np.max(np.abs(rounded.get_ydata())) > 50.0
    assert np.max(np.abs(fractional.get_ydata())) < 2.1


def test_figures_12_to_14_have_the_papers_five_panels_on_one_clock(figures, recorded):
    rising = np.linspace(10.0, 12.0, TICKS)[:, None]
    changing = [
        (replace(one, columns={**one.columns, **dict.fromkeys(MODE, rising)}), motion)
        for one, motion in recorded
    ]
    figure = figures.motion_figure("Q1 → Q2", *changing)
    assert len(figure.axes) == 5
    assert [panel.get_ylabel().split()[-1] for panel in figure.axes] == [
        "(rad/s²)",
        "(mm)",
        "(m/s²)",
        "(Hz)",
        "(–)",
    ]
    (box,) = figure.legends
    assert [text.get_text() for text in box.get_texts()] == ["Unshaped", "Shaped"]
    assert all(f"{symbol}: " in figure.get_supxlabel() for symbol in ("$E$", "$f_d$", r"$\zeta$"))
    assert len(figures.motion_figure("Q1 → Q2", *recorded).axes) == 3, "a mode that is constant has no panel"
    joints = texts(figure.axes[0])
    assert len(joints) == 3
    assert r"$\ddot q^*_1$, $\ddot q^*_2$" in joints


def test_figure_16_writes_the_rv_it_draws_and_where_it_is_no_fit(figures, recorded):
    figure = figures.figure_16({"Q1 → Q2": recorded, "Q1 → Q3": recorded})
    assert len(figure.axes) == 2
    words = texts(figure.axes[0])
    assert any("RV 0.9" in text or "RV 1.0" in text for text in words)
    assert any("largest value" in text for text in words)
    assert words.count("$t_b$") == words.count("$t_b^*$") == 1


def test_figure_16_draws_no_decay_through_noise(figures, recorded, one_motion):
    noise = 0.06 * np.random.default_rng(1).standard_normal((TICKS, 3))
    noisy = one_motion(37, alpha=noise)
    found = motions(noisy)[0]
    assert measured(noisy, found).fitted, "its peaks look like a decay"
    figure = figures.figure_16({"Q1-Q2": (recorded[0], (noisy, found))})
    (panel,) = figure.axes
    dashed = [line for line in panel.get_lines() if line.get_linestyle() == "--" and len(line.get_xdata())]
    decays = [line for line in dashed if line.get_linewidth() == 1.4]
    assert [line.get_color() for line in decays] == [UNSHAPED]
    assert any("fitted to noise" in text for text in texts(panel))


def test_the_band_of_repeatability_has_its_number(figures, recorded):
    assert "repeatability, 0.03 mm" in texts(figures.motion_figure("Q1-Q2", *recorded).axes[1])


@pytest.mark.parametrize(("counts", "drawn"), [([True, False, True, True], 3), ([False] * 4, 2)])
def test_the_example_is_the_middle_one_of_the_moves_that_count(counts, drawn):
    peaks = [0.5, 0.1, 0.3, 0.4] if any(counts) else [0.01, 0.04, 0.03, 0.02]
    judged = [
        {"reduction_percent": 90.0 if one else None, "unshaped_peak_m_s2": peak}
        for one, peak in zip(counts, peaks, strict=True)
    ]
    assert example(judged) == drawn


@pytest.fixture
def rung(one_motion, ring):
    """A motion after which the tool rings with an amplitude, in the truth."""

    def make(shaped_ticks, amplitude):
        recording = one_motion(shaped_ticks, truth=ring(TICKS, 501 + shaped_ticks, 10.0, 0.1, amplitude))
        return recording, motions(recording)[0]

    return make


@pytest.mark.parametrize(
    ("amplitude", "changed", "gained"), [(0.1, "less", "earlier"), (4.0, "more", "later")]
)
def test_the_overview_says_by_its_own_curves_whether_the_tool_shakes_less_and_rests_earlier(
    figures, rung, amplitude, changed, gained
):
    (panel,) = figures.after_stop_figure(rung(0, 1.0), rung(10, amplitude), "Q1-Q3").axes
    curves = [line for line in panel.get_lines() if line.get_linewidth() == 1.8]
    peaks = [line for line in panel.get_lines() if line.get_marker() == "o"]
    for curve, peak in zip(curves, peaks, strict=True):
        time, alpha = curve.get_xydata().T
        assert peak.get_xydata()[0][1] == pytest.approx(alpha[time >= peak.get_xydata()[0][0]].max())
    before, after = (peak.get_xydata()[0][1] for peak in peaks)
    without, with_shaping, rest, *_ = texts(panel)[:2] + [text for text in texts(panel) if "at rest" in text]
    assert without == f"without shaping: {before:.2f} m/s²"
    assert with_shaping == f"with shaping: {after:.2f} m/s², {100 * abs(after / before - 1):.0f} % {changed}"
    assert rest.endswith(f"{gained} with shaping")


@pytest.mark.parametrize("zeta", [0.0, 0.34])
def test_the_figure_of_the_catalogue_shows_every_shaper_that_is_for_the_damping(figures, zeta):
    mine = custom("mine", [0.5, 0.5], [0.0, 0.5])
    figure = figures.catalogue_figure([*SHAPERS.values(), mine], zeta)
    *families, price = figure.axes
    shown = [
        line.get_label() for panel in families for line in panel.get_lines() if line.get_label()[0] != "_"
    ]
    assert sorted(shown) == sorted(
        [
            "mine",
            *(name for name, shaper in SHAPERS.items() if shaper.duration_periods and zeta < shaper.zeta_max),
        ]
    )
    named = {name for words in texts(price) for name in words.split(", ")}
    assert named == set(shown)
    (ei,) = (line for panel in families for line in panel.get_lines() if line.get_label() == "ei")
    assert np.interp(1.0, *ei.get_xydata().T) == pytest.approx(
        100.0 * residual(1.0, zeta, SHAPERS["ei"].function(1.0, zeta))
    )


def linear(color):
    share = np.array([int(color[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """CIE L*a*b* of linear RGB; L* alone is what grey shows."""
    x, y, z = np.cbrt(np.clip(XYZ @ rgb, 1e-6, None) / (XYZ @ np.ones(3)))
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize(("one", "other"), MAIN)
def test_the_three_main_colours_differ_in_grey_as_they_are_printed(figures, style, one, other):
    with figures.house_style("paper"):
        lightness = [lab(linear(style.SERIES[place].color))[0] for place in (one, other)]
    assert abs(lightness[0] - lightness[1]) > 12.0


@pytest.mark.parametrize("seen", [DEUTERANOPIA, PROTANOPIA, np.eye(3)])
@pytest.mark.parametrize(("one", "other"), MAIN)
def test_the_three_main_colours_differ_to_the_colour_blind(style, one, other, seen):
    first, second = (lab(seen @ linear(style.SERIES[place].color)) for place in (one, other))
    assert np.linalg.norm(first - second) > 25.0


def test_each_series_has_dashes_and_a_marker_of_its_own(style):
    assert len({str(one.dashes) for one in style.SERIES}) == len(style.SERIES)
    assert len({one.marker for one in style.SERIES}) == len(style.SERIES)
    assert len({one.color for one in style.SERIES}) == len(style.SERIES)


def test_colours_are_dark_enough_to_be_seen_on_white(style):
    for one in style.SERIES:
        assert lab(linear(one.color))[0] < 75.0


def test_dashed_curves_lie_over_full_ones(style):
    full, dashed = (one.line()["zorder"] for one in style.SERIES[:2])
    assert style.SERIES[0].dashes == "-"
    assert dashed > full


def test_labels_of_a_logarithmic_axis_are_plain_and_of_one_size(style):
    _, (panel,) = style.panels(1, 3.0)
    panel.set(yscale="log", ylim=(0.01, 20.0))
    style.decades(panel, "y")
    panel.figure.draw_without_rendering()
    labels = [*panel.get_yticklabels(), *panel.get_yticklabels(minor=True)]
    assert {label.get_fontsize() for label in labels} == {8.0}
    words = {label.get_text() for label in labels}
    assert {"0.1", "0.2", "0.5", "1", "10"} <= words
    assert not any("$" in word for word in words)


def test_a_tint_is_between_the_colour_and_white(style):
    assert style.tint("#000000", 0.0) == "#ffffff"
    assert style.tint("#0b4a85", 1.0) == "#0b4a85"
