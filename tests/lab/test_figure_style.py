"""Curves can be told apart without colours, and by the colour-blind."""

import itertools

import numpy as np
import pytest

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


def linear(color):
    share = np.array([int(color[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """CIE L*a*b* of linear RGB; L* alone is what grey shows."""
    x, y, z = np.cbrt(np.clip(XYZ @ rgb, 1e-6, None) / (XYZ @ np.ones(3)))
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


MAIN = list(itertools.combinations(range(3), 2))
"""Pairs of the main series."""


@pytest.fixture(scope="module")
def style():
    """The module, imported where it is used: matplotlib takes a second that other tests need not wait."""
    import tvist_lab.figures.style

    return tvist_lab.figures.style


@pytest.mark.parametrize(("one", "other"), MAIN)
def test_the_three_main_colours_differ_in_grey(style, one, other):
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
    assert style.tint("#000000", 0.0) == "#FFFFFF"
    assert style.tint("#0B4A85", 1.0) == "#0B4A85"
