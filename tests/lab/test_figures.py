"""Figures show the numbers they stand for, with units and text that can be read, in the style that is asked for."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.lab.conftest import one_motion, ring

from tvist_lab.identification.workspace_map import WorkspaceMap
from tvist_lab.metrics import motions
from tvist_lab.metrics.paper import residual as measured
from tvist_lab.studies.moves import example
from tvist_lab.studies.robustness import ERRORS, cells
from tvist_shaping import SHAPERS, custom, residual

RESULTS = Path(__file__).parents[2] / "docs" / "results"
TICKS = 1500
UNSHAPED = "#d55e00"
MODE = ("estimated_f_d", "estimated_zeta")
UNIT = re.compile(
    r"\((ms|s|Hz|%|–|°|m|mm|mrad|rad/s|rad/s²|m/s²|m/s|dB|ticks|ticks of 2 ms|damped periods)\)$"
)
NARROW = "figure.figsize: 3.503937, 3"
"""Line of a style file with the width of one column of a journal, 89 mm."""
LEAST_POINTS = 5.5  # smallest size of text in one column [pt]


@pytest.fixture(autouse=True)
def _styled(figures):
    with figures.house_style():
        yield


@pytest.fixture(scope="module")
def found():
    grid = np.linspace(6.0, 15.0, 9).reshape(3, 3)
    told = {"f_d_hz": grid, "zeta": 0.02 * grid}
    true = {"f_d_hz": 1.03 * grid, "zeta": 0.02 * grid + 0.001 * grid**0.5}
    angles = np.linspace(-1.0, 1.0, 3)
    return WorkspaceMap((1, 2), ("shoulder", "elbow"), (angles, angles), (0.0,) * 6, told, true)


def judged(count, *, counts=True):
    return [
        {
            "unshaped_peak_m_s2": 0.4,
            "shaped_peak_m_s2": 0.01 * place,
            "reduction_percent": 100.0 - place if counts else None,
        }
        for place in range(1, count + 1)
    ]


def published(name):
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


ENTRY = {"reduction_percent_median": 90.0, "reduction_percent_p5": 80.0, "delay_ms_median": 50.0}
MODES = np.array([np.linspace(7.0, 9.0, 5), np.linspace(0.2, 0.3, 5)])
MAKERS = {
    "figure_1": lambda made, *_: made.figure_1(),
    "figure_3": lambda made, *_: made.figure_3(),
    "figure_4": lambda made, *_: made.figure_4(),
    "figure_8": lambda made, *_: made.figure_8(),
    "figure_15": lambda made, pair, _: made.figure_15("Q1-Q2", *pair),
    "after_stop": lambda made, pair, _: made.after_stop_figure(*pair, "Q1-Q2"),
    "ring_down": lambda made, pair, _: made.ring_down_figure("Q1-Q2", pair[0]),
    "sensitivity": lambda made, *_: made.sensitivity_figure([SHAPERS["zv"]], 0.0, np.linspace(-0.4, 0.6, 51)),
    "settling_against_delay": lambda made, *_: made.settling_against_delay_figure(
        SHAPERS.values(), 10.0, 0.1
    ),
    "settling": lambda made, *_: made.settling_figure(published("leaderboard")["summary"]),
    "robustness": lambda made, *_: made.robustness_figure(cells(published("robustness")), ERRORS),
    "moves": lambda made, *_: made.residual_by_move_figure(judged(4)),
    "no move that counts": lambda made, *_: made.residual_by_move_figure(judged(2, counts=False)),
    "one_move": lambda made, pair, _: made.vibration_figure(pair[0][0], pair[1][0], 3),
    "identified": lambda made, *_: made.identified_figure("mine", MODES, 1.02 * MODES),
    "map": lambda made, _, found: made.workspace_map_figure(found, "f_d_hz", "an arm"),
    "compared": lambda made, pair, _: made.compared_figure(
        [made.ComparedPanel("Q1 → Q2", {"without": pair[0], "with zv": pair[1]}, "90 % less")] * 2,
        ["without"],
    ),
    "sweep": lambda made, *_: made.sweep_figure(
        [{"shaper": name, **ENTRY} for name in ("zv", "auto")] * 2, ["5 kg", "1 kg"] * 2
    ),
}


@pytest.fixture(scope="module")
def make(figures, recorded, found):
    """Make a figure by its name, from small data."""
    return lambda name: MAKERS[name](figures, recorded, found)


def words_of(figure):
    """All text that is figures."""
    from matplotlib.text import Text

    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]


def texts(panel):
    return [text.get_text() for text in panel.texts]


@pytest.fixture
def sheet(tmp_path):
    def write(*lines):
        path = tmp_path / "mine.mplstyle"
        path.write_text("\n".join(lines))
        return str(path)

    return write


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file"),
        ("font.size: 8\nfont.colour: red\n", "line 2: 'font.colour' is no setting of matplotlib"),
        ("font.size: large one\n", "font.size"),
        ("savefig.dpi: 5\n", "savefig.dpi to 5: must be 30 to 2400"),
        ("figure.figsize: 1, 1\n", "figure.figsize to 1: must be 2 to 40"),
    ],
)
def test_wrong_style_is_refused(figures, tmp_path, content, words):
    path = tmp_path / "bad.mplstyle"
    if content is not None:
        path.write_text(content)
    with pytest.raises(figures.StyleError, match=words), figures.house_style(str(path)):
        pass


def assert_readable(figures, make, style, name):
    """Check that axes have units, and readable text within the figure."""
    with figures.house_style(style):
        figure = make(name)
        figure.get_layout_engine().execute(figure)
    axes = [axis for panel in figure.axes if panel.axison for axis in (panel.xaxis, panel.yaxis)]
    quantities = [
        axis.label.get_text()
        for axis in axes
        if not any(re.search("[a-z]", label.get_text()) for label in axis.get_ticklabels())
    ]
    assert all(UNIT.search(label) for label in filter(None, quantities)), quantities
    assert any(quantities)
    for panel in figure.axes:
        assert not panel.axison or panel.get_lines() or panel.collections or panel.patches, "an empty panel"
    assert min(text.get_fontsize() for text in words_of(figure)) >= LEAST_POINTS
    renderer = figure.canvas.get_renderer()
    boxes = [panel.get_tightbbox(renderer) for panel in figure.axes]
    for box in [*boxes, *(one.get_window_extent() for one in figure.legends)]:
        assert -2.0 <= box.x0 < box.x1 <= figure.bbox.width + 2.0
        assert -2.0 <= box.y0 < box.y1 <= figure.bbox.height + 2.0


OF_PAPER = [name for name in MAKERS if name.startswith("figure_")]


@pytest.mark.parametrize("name", OF_PAPER)
def test_axes_of_the_papers_figures_have_units_and_readable_text(figures, make, sheet, name):
    assert_readable(figures, make, sheet(NARROW), name)


@pytest.mark.parametrize("name", [name for name in MAKERS if name not in OF_PAPER])
def test_axes_have_units_and_readable_text_within_the_figure(figures, make, sheet, name):
    assert_readable(figures, make, sheet(NARROW), name)


def test_file_has_the_size_of_its_style_and_is_reproducible(figures, sheet, tmp_path):
    from PIL import Image

    with figures.house_style(sheet(NARROW, "savefig.dpi: 120")):
        (png, svg, pdf), again = (
            [
                figures.save(figures.figure_4(), tmp_path / at / f"figure.{kind}")
                for kind in ("png", "svg", "pdf")
            ]
            for at in "ab"
        )
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in (png, svg, pdf)]
    with Image.open(png) as image:
        assert image.info["dpi"] == pytest.approx((120.0, 120.0), abs=0.1)
        assert 25.4 * image.width / 120.0 == pytest.approx(89.0, abs=0.3)
    points = re.search(r'width="([\d.]+)pt"', svg.read_text())[1]
    assert 25.4 / 72.0 * float(points) == pytest.approx(89.0, abs=0.1)
    assert b"/Type3" not in pdf.read_bytes()


@pytest.mark.parametrize("name", ["map", "after_stop"])
def test_paper_style_writes_headings_to_a_text_file(figures, make, sheet, tmp_path, name):
    narrow = sheet(NARROW)
    with figures.house_style(narrow):
        plain = make(name)
    headings = [panel.get_title() for panel in plain.axes if panel.get_title()]
    with figures.house_style("paper", narrow):
        printed = make(name)
        caption = figures.save(printed, tmp_path / "x.png").with_suffix(".txt").read_text(encoding="utf-8")
    shown = [text.get_text() for text in words_of(printed)]
    assert all(heading in caption and heading not in shown for heading in headings)
    assert not printed.get_supxlabel()
    assert all(words in caption for words in plain.get_supxlabel().split("\u2003 ") if words)


def test_style_sheet_takes_precedence_within_its_block(figures, sheet):
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    colors = "axes.prop_cycle: cycler('color', ['112233', '445566'])"
    with figures.house_style(
        "paper", "slides", sheet("font.family: serif", "font.size: 6", "axes.grid: False", NARROW, colors)
    ):
        figure = figures.figure_4()
    assert dict(mpl.rcParams) == before
    panel = figure.axes[0]
    assert panel.get_xticklabels()[0].get_fontfamily() == ["serif"]
    assert not panel.xaxis.get_gridlines()[0].get_visible()
    assert [line.get_color() for line in panel.get_lines()][:2] == ["#112233", "#445566"]
    assert 25.4 * figure.get_figwidth() == pytest.approx(89.0, abs=0.01)


def test_figure_4_shows_36_percent_for_the_least_sensitive_shaper(figures):
    (panel,) = figures.figure_4().axes
    assert any(text.startswith("35.8 %") for text in texts(panel))
    curves = {line.get_label(): line.get_xydata() for line in panel.get_lines()}
    assert np.interp(15.0, *curves["EI 5 %"].T) == pytest.approx(35.82, abs=0.05)
    assert np.interp(10.5, *curves["ZV"].T) == pytest.approx(0.0, abs=0.1)


def test_figure_7_shows_that_only_rounded_delays_jump(figures):
    rounded, fractional, *_ = figures.figure_7().axes[2].get_lines()
    assert np.max(np.abs(rounded.get_ydata())) > 50.0
    assert np.max(np.abs(fractional.get_ydata())) < 2.1


def test_figures_12_to_14_have_the_papers_five_panels_on_one_clock(figures, recorded):
    rising = dict.fromkeys(MODE, np.linspace(10.0, 12.0, TICKS)[:, None])
    changing = [(replace(one, columns={**one.columns, **rising}), motion) for one, motion in recorded]
    figure = figures.motion_figure("Q1 → Q2", *changing)
    units = [panel.get_ylabel().split()[-1] for panel in figure.axes]
    assert units == ["(rad/s²)", "(mm)", "(m/s²)", "(Hz)", "(–)"]
    (box,) = figure.legends
    assert [text.get_text() for text in box.get_texts()] == ["Unshaped", "Shaped"]
    assert len(figures.motion_figure("Q1 → Q2", *recorded).axes) == 3, "a mode that is constant has no panel"
    assert r"$\ddot q^*_1$, $\ddot q^*_2$" in texts(figure.axes[0])
    assert "repeatability, 0.03 mm" in texts(figure.axes[1])


def test_figure_16_labels_the_drawn_rv_and_no_decay_in_noise(figures, recorded):
    noise = 0.06 * np.random.default_rng(1).standard_normal((TICKS, 3))
    noisy = one_motion(37, alpha=noise)
    found = motions(noisy)[0]
    assert measured(noisy, found).fitted, "its peaks look like a decay"
    pairs = {"Q1 → Q2": recorded, "Q1 → Q3": (recorded[0], (noisy, found))}
    first, second = figures.figure_16(pairs).axes
    assert any("RV 0.9" in text or "RV 1.0" in text for text in texts(first))
    assert any("largest value" in text for text in texts(first))
    assert any("fitted to noise" in text for text in texts(second))
    dashed = [line for line in second.get_lines() if line.get_linestyle() == "--" and len(line.get_xdata())]
    assert [line.get_color() for line in dashed if line.get_linewidth() == 1.4] == [UNSHAPED]


@pytest.mark.parametrize(("counts", "drawn"), [([True, False, True, True], 3), ([False] * 4, 2)])
def test_example_is_the_median_of_the_counted_moves(counts, drawn):
    peaks = [0.5, 0.1, 0.3, 0.4] if any(counts) else [0.01, 0.04, 0.03, 0.02]
    rows = [
        {"reduction_percent": 90.0 if one else None, "unshaped_peak_m_s2": peak}
        for one, peak in zip(counts, peaks, strict=True)
    ]
    assert example(rows) == drawn


@pytest.mark.parametrize(
    ("amplitude", "changed", "gained"), [(0.1, "less", "earlier"), (4.0, "more", "later")]
)
def test_overview_states_reduction_and_earlier_rest_of_its_curves(figures, amplitude, changed, gained):
    pair = []
    for ticks, size in ((0, 1.0), (10, amplitude)):
        recording = one_motion(ticks, truth=ring(TICKS, 501 + ticks, 10.0, 0.1, size))
        pair.append((recording, motions(recording)[0]))
    (panel,) = figures.after_stop_figure(*pair, "Q1-Q3").axes
    curves = [line for line in panel.get_lines() if line.get_linewidth() == 1.8]
    peaks = [line.get_xydata()[0] for line in panel.get_lines() if line.get_marker() == "o"]
    for curve, (at, peak) in zip(curves, peaks, strict=True):
        time, alpha = curve.get_xydata().T
        assert peak == pytest.approx(alpha[time >= at].max())
    (_, before), (_, after) = peaks
    less = f"{100 * abs(after / before - 1):.0f} % {changed}"
    assert texts(panel)[:2] == [
        f"without shaping: {before:.2f} m/s²",
        f"with shaping: {after:.2f} m/s², {less}",
    ]
    assert any(text.endswith(f"{gained} with shaping") for text in texts(panel) if "at rest" in text)


def test_catalogue_figure_shows_every_shaper_for_the_damping(figures):
    zeta, mine = 0.34, custom("mine", [0.5, 0.5], [0.0, 0.5])
    *families, price = figures.catalogue_figure([*SHAPERS.values(), mine], zeta).axes
    lines = [line for panel in families for line in panel.get_lines() if line.get_label()[0] != "_"]
    fit = [name for name, one in SHAPERS.items() if one.duration_periods and zeta < one.zeta_max]
    assert sorted(line.get_label() for line in lines) == sorted(["mine", *fit])
    assert {name for words in texts(price) for name in words.split(", ")} == {"mine", *fit}
    (ei,) = (line for line in lines if line.get_label() == "ei")
    left = 100.0 * residual(1.0, zeta, SHAPERS["ei"].function(1.0, zeta))
    assert np.interp(1.0, *ei.get_xydata().T) == pytest.approx(left)
