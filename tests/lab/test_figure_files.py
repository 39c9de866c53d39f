"""Every figure has labelled axes with units and text that can be read, over one column and over two."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tvist_lab.identification.workspace_map import WorkspaceMap
from tvist_lab.studies.robustness import ERRORS, cells
from tvist_shaping import SHAPERS

DOCS = Path(__file__).parents[2] / "docs"
TICKS = 1500
UNIT = re.compile(
    r"\((ms|s|Hz|%|–|°|m|mm|mrad|rad/s|rad/s²|m/s²|m/s|dB|ticks|ticks of 2 ms|damped periods)\)$"
)
WIDTHS = {1: "figure.figsize: 3.503937, 3", 2: "figure.figsize: 7.204725, 3"}
"""Lines of style files with the width of one and of two columns of a journal."""
LEAST_POINTS = {1: 5.5, 2: 7.0}
"""Smallest size of text by columns [pt]."""


@pytest.fixture(scope="module")
def found():
    grid = np.linspace(6.0, 15.0, 9).reshape(3, 3)
    told = {"f_d_hz": grid, "zeta": 0.02 * grid}
    true = {key: 1.03 * value for key, value in told.items()}
    true["zeta"] = true["zeta"] + 0.001 * grid**0.5
    angles = np.linspace(-1.0, 1.0, 3)
    return WorkspaceMap((1, 2), ("shoulder", "elbow"), (angles, angles), (0.0,) * 6, told, true)


@pytest.fixture(scope="module")
def make(figures, recorded, found):
    """Make a figure by its name, from small data."""
    compared_figure = figures.compared_figure

    def judged(count, *, counts=True):
        return [
            {
                "unshaped_peak_m_s2": 0.4,
                "shaped_peak_m_s2": 0.01 * place,
                "reduction_percent": 100.0 - place if counts else None,
            }
            for place in range(1, count + 1)
        ]

    def entries():
        figures = {"reduction_percent_median": 90.0, "reduction_percent_p5": 80.0, "delay_ms_median": 50.0}
        return [{"shaper": name, **figures} for name in ("zv", "auto")] * 2

    def published(name):
        return json.loads((DOCS / "results" / f"{name}.json").read_text(encoding="utf-8"))

    modes = np.array([np.linspace(7.0, 9.0, 5), np.linspace(0.2, 0.3, 5)])
    known = SHAPERS.values()
    makers = {
        "figure_1": figures.figure_1,
        "figure_3": figures.figure_3,
        "figure_4": figures.figure_4,
        "figure_7": figures.figure_7,
        "figure_8": figures.figure_8,
        "figure_12": lambda: figures.motion_figure("Q1-Q2", *recorded),
        "observed": lambda: figures.motion_figure("motion 1", recorded[0]),
        "figure_15": lambda: figures.figure_15("Q1-Q2", *recorded),
        "figure_16": lambda: figures.figure_16({"Q1-Q2": recorded}),
        "after_stop": lambda: figures.after_stop_figure(*recorded, "Q1-Q2"),
        "ring_down": lambda: figures.ring_down_figure("Q1-Q2", recorded[0]),
        "catalogue": lambda: figures.catalogue_figure(known),
        "sensitivity": lambda: figures.sensitivity_figure([SHAPERS["zv"]], 0.0, np.linspace(-0.4, 0.6, 51)),
        "settling_against_delay": lambda: figures.settling_against_delay_figure(known, 10.0, 0.1),
        "pareto": lambda: figures.pareto_figure(published("leaderboard")["summary"]),
        "settling": lambda: figures.settling_figure(published("leaderboard")["summary"]),
        "robustness": lambda: figures.robustness_figure(cells(published("robustness")), ERRORS),
        "moves": lambda: figures.residual_by_move_figure(judged(4)),
        "one_move": lambda: figures.vibration_figure(recorded[0][0], recorded[1][0], 3),
        "identified": lambda: figures.identified_figure("mine", modes, 1.02 * modes),
        "map": lambda: figures.workspace_map_figure(found, "f_d_hz", "an arm"),
        "map over two columns": lambda: figures.workspace_map_figure(found, "zeta", "an arm"),
        "compared": lambda: compared_figure(
            [figures.Shown("Q1 → Q2", {"without": recorded[0], "with zv": recorded[1]}, "90 % less")] * 4,
            ["without"],
        ),
        "sweep": lambda: figures.sweep_figure(entries(), ["5 kg", "1 kg"] * 2),
        "no move that counts": lambda: figures.residual_by_move_figure(judged(2, counts=False)),
    }
    return lambda name: makers[name]()


NAMES = [
    "figure_1", "figure_3", "figure_4", "figure_7", "figure_8", "figure_12", "observed", "figure_15", "figure_16",
    "after_stop", "ring_down", "catalogue", "sensitivity", "settling_against_delay", "pareto",
    "settling", "robustness", "moves", "one_move", "identified", "map", "map over two columns",
    "no move that counts", "compared", "sweep",
]  # fmt: skip


def words_of(figure):
    """All text that is figures."""
    from matplotlib.text import Text

    return [
        text
        for text in figure.findobj(Text)
        if isinstance(text, Text) and text.get_visible() and text.get_text().strip()
    ]


def named(axis):
    """Whether an axis counts names instead of a quantity."""
    return any(re.search("[a-z]", label.get_text()) for label in axis.get_ticklabels())


@pytest.fixture
def sheet(tmp_path):
    """A style sheet with these lines."""

    def write(*lines):
        path = tmp_path / "mine.mplstyle"
        path.write_text("\n".join(lines))
        return str(path)

    return write


@pytest.mark.parametrize("name", NAMES)
def test_axes_have_units_and_text_is_large_enough_and_within_the_figure(figures, make, sheet, name):
    columns = 2 if "two" in name else 1
    with figures.house_style(sheet(WIDTHS[columns])):
        figure = make(name)
        figure.draw_without_rendering()
    labels = [
        axis.label.get_text()
        for panel in figure.axes
        if panel.axison
        for axis in (panel.xaxis, panel.yaxis)
        if axis.label.get_text() and not named(axis)
    ]
    assert labels
    assert all(UNIT.search(label) for label in labels), labels
    for panel in figure.axes:
        assert not panel.axison or panel.get_lines() or panel.collections or panel.patches, "an empty panel"
    lines = [line for panel in figure.axes for line in panel.get_lines()]
    assert all(line.get_alpha() is None for line in lines), "colours mix where lines overlap"
    assert min(text.get_fontsize() for text in words_of(figure)) >= LEAST_POINTS[columns]
    renderer = figure.canvas.get_renderer()
    boxes = [panel.get_tightbbox(renderer) for panel in figure.axes]
    for box in [*boxes, *(one.get_window_extent() for one in figure.legends)]:
        assert -2.0 <= box.x0 < box.x1 <= figure.bbox.width + 2.0
        assert -2.0 <= box.y0 < box.y1 <= figure.bbox.height + 2.0


@pytest.mark.parametrize(("columns", "millimetres"), [(1, 89.0), (2, 183.0)])
def test_a_file_has_the_width_and_resolution_of_the_style(figures, sheet, tmp_path, columns, millimetres):
    from PIL import Image

    with figures.house_style(sheet(WIDTHS[columns], "savefig.dpi: 120")):
        png, svg, pdf = (
            figures.save(figures.figure_4(), tmp_path / "new" / f"figure.{suffix}")
            for suffix in ("png", "svg", "pdf")
        )
    with Image.open(png) as image:
        assert image.info["dpi"] == pytest.approx((120.0, 120.0), abs=0.1)
        assert 25.4 * image.width / 120.0 == pytest.approx(millimetres, abs=0.3)
    points = re.search(r'width="([\d.]+)pt"', svg.read_text())[1]
    assert 25.4 / 72.0 * float(points) == pytest.approx(millimetres, abs=0.1)
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", pdf.read_bytes())
    assert 25.4 / 72.0 * float(box[1]) == pytest.approx(millimetres, abs=0.1)
    assert b"/Type3" not in pdf.read_bytes()


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_equal_figures_give_equal_files(figures, tmp_path, suffix):
    with figures.house_style():
        first, second = (
            figures.save(figures.figure_4(), tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab"
        )
    assert first == second


@pytest.mark.parametrize("name", ["map", "after_stop", "ring_down", "robustness"])
def test_in_print_headings_and_explanations_are_a_text_beside_the_figure(
    figures, make, sheet, tmp_path, name
):
    narrow = sheet(WIDTHS[1])
    with figures.house_style(narrow):
        plain = make(name)
    headings = [panel.get_title() for panel in plain.axes if panel.get_title()]
    explained = plain.get_supxlabel()
    with figures.house_style("paper", narrow):
        printed = make(name)
        caption = figures.save(printed, tmp_path / "x.png").with_suffix(".txt").read_text(encoding="utf-8")
    shown = [text.get_text() for text in words_of(printed)]
    for place, heading in enumerate(headings):
        assert heading in caption
        assert heading not in shown
        assert len(headings) == 1 or f"{'abc'[place]}: {heading}." in caption
    assert not printed.get_supxlabel()
    assert all(words in caption for words in explained.split("\u2003 ") if words)


def test_on_slides_text_and_lines_are_larger(figures):
    with figures.house_style():
        usual = figures.figure_4()
    with figures.house_style("slides"):
        slide = figures.figure_4()
    labels = [one.axes[0].xaxis.label.get_fontsize() for one in (usual, slide)]
    curves = [one.axes[0].get_lines()[0].get_linewidth() for one in (usual, slide)]
    assert labels[1] == pytest.approx(1.4 * labels[0])
    assert curves[1] == pytest.approx(1.4 * curves[0])


def test_a_style_sheet_of_matplotlib_takes_precedence(figures, sheet):
    lines = (
        "# a journal's",
        "font.family: serif",
        "font.size: 6",
        "axes.grid: False",
        "backend: ps",
        WIDTHS[1],
    )
    colors = "axes.prop_cycle: cycler('color', ['112233', '445566'])"
    with figures.house_style(sheet(*lines, colors)):
        figure = figures.figure_4()
    panel = figure.axes[0]
    assert panel.xaxis.label.get_fontsize() == pytest.approx(6.0), "not made smaller, though it is narrow"
    assert panel.get_xticklabels()[0].get_fontfamily() == ["serif"]
    assert not panel.xaxis.get_gridlines()[0].get_visible()
    assert [line.get_color() for line in panel.get_lines()][:2] == ["#112233", "#445566"]
    assert 25.4 * figure.get_figwidth() == pytest.approx(89.0, abs=0.01)


def test_a_style_ends_with_its_block(figures):
    import matplotlib as mpl

    before = mpl.rcParams.copy()
    with figures.house_style("paper", "slides"):
        assert mpl.rcParams != before
    assert mpl.rcParams == before


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "cannot be read: No such file"),
        ("font.size: 8\nfont.colour: red\n", "line 2: 'font.colour' is no setting of matplotlib"),
        ("font.size: large one\n", "font.size"),
        ("just words\n", "line 1: 'just words' is no setting"),
        ("savefig.dpi: 5\n", "savefig.dpi to 5: must be 30 to 2400"),
        ("figure.figsize: 1, 1\n", "figure.figsize to 1: must be 2 to 40"),
    ],
)
def test_a_style_file_that_is_none_is_refused_in_a_sentence(figures, tmp_path, content, words):
    path = tmp_path / "bad.mplstyle"
    if content is not None:
        path.write_text(content)
    with pytest.raises(figures.StyleError, match=words), figures.house_style(str(path)):
        pass


@pytest.mark.parametrize("shares", [("median", "p5", "p95"), ("min", "max")])
def test_a_study_draws_lines_over_numbers_and_dots_with_bars_over_names(figures, shares):
    summary = [
        {"shaper": "zv", "kg": kg, "way": f"way {kg:g}", **{f"delay_ms_{share}": 50.0 for share in shares}}
        for kg in (1.0, 5.0)
    ]
    for axis, dashes in (("kg", "-"), ("way", "None")):
        (panel,) = figures.study_figure(summary, [axis], ["delay_ms"], few="min" in shares).axes
        lines = panel.get_lines()
        assert {line.get_linestyle() for line in lines} == {dashes}
        assert len(lines) == (1 if "median" in shares else 2)
        assert panel.collections


def test_poses_are_marked_on_a_map(figures, found):
    marked = replace(found, poses={"Q1": (0.0, 0.5), "Q2": (0.0, 0.5), "Q3": (1.0, 1.0)})
    figure = figures.workspace_map_figure(marked, "f_d_hz", "an arm")
    assert all(
        [text.get_text() for text in panel.texts][-2:] == ["Q1, Q2", "Q3"] for panel in figure.axes[:3]
    )
    assert all(text.get_rotation() == 0.0 for panel in figure.axes[:3] for text in panel.texts)


def test_a_figure_of_no_counted_move_has_no_empty_panel(make):
    assert len(make("no move that counts").axes) == 1


def test_a_triangle_is_one_that_exceeds_a_limit_by_more_than_a_percent(figures):
    row = {
        "pareto": False, "residual_m_s2_median": 0.1, "time_until_still_ms_median": 50.0,
        "reference_velocity_ratio_max": 1.0,
    }  # fmt: skip
    rows = [
        row | {"shaper": "near", "reference_acceleration_ratio_max": 1.003},
        row | {"shaper": "far", "reference_acceleration_ratio_max": 2.5, "residual_m_s2_median": 0.2},
    ]
    (panel,) = figures.pareto_figure(rows).axes
    markers = [line.get_marker() for line in panel.get_lines() if len(line.get_xdata()) == 1]
    assert markers == ["o", "^"]
    assert [text.get_text() for text in panel.texts] == ["near", "far (2.5×)"]
