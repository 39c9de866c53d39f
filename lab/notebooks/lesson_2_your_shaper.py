"""Lesson 2: write a shaper and test it on moves of the simulated arm."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="2: Your own shaper")

with app.setup:
    import math

    import marimo as mo
    import numpy as np
    from matplotlib import rcParams

    from tvist_controller.api.line import OwnShaper, load_calibration
    from tvist_lab.figures import house_settings
    from tvist_lab.figures.style import INK, SHAPED, THIRD, UNSHAPED, legend, panels
    from tvist_lab.study.case import Case
    from tvist_lab.study.method import Named
    from tvist_lab.study.method_list import names
    from tvist_lab.study.moves import draw_moves
    from tvist_lab.study.recipes import Recipe
    from tvist_lab.study.work import Job, measure
    from tvist_plant.description import load
    from tvist_shaping import Impulses, ShapingError, residual, shaper, shaper_of

    rcParams.update(house_settings())


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 2: Your own shaper

    **You learn** to write an input shaper, to see whether it works on an arm and not only on paper, and what
    robustness is worth when the frequency is not known exactly.

    ## Write it

    The next cell is yours. Your shaper is a function of the damped frequency $f_d$ in Hz and the damping ratio
    $\zeta$ of the arm's lowest mode. It returns amplitudes $A$, whose sum is one, and times $\tau$ in seconds, which
    start at zero and are proportional to $1/f_d$. The controller calls it at every tick, so that it follows the arm.

    As it stands, it is a zero-vibration shaper with a mistake. Find the mistake, then try a third impulse.
    Control+Enter runs the cell, and everything below follows.
    """)
    return


@app.function
def mine(f_d, zeta):
    """My shaper."""
    when = 0.4  # periods after the first impulse
    K = math.exp(-2.0 * math.pi * when * zeta / math.sqrt(1.0 - zeta**2))
    A = np.array([1.0, K])
    tau = np.array([0.0, when / f_d])
    return Impulses(A / A.sum(), tau)


@app.cell(hide_code=True)
def _():
    try:
        own = shaper_of(mine, name="mine")
    except ShapingError as _error:
        mo.stop(True, mo.callout(mo.md(f"This is not a shaper yet: {_error}"), kind="danger"))
    return (own,)


@app.cell(hide_code=True)
def _():
    rival = mo.ui.dropdown(names("lesson"), value="zv", label="compare with")
    rival
    return (rival,)


@app.cell(hide_code=True)
def _(own, rival):
    _zeta = 0.2
    _ratio = np.linspace(0.5, 1.5, 501)
    _figure, (_panel,) = panels(1, 3.2)
    for _shaper, _color in ((own, SHAPED), (shaper(rival.value), THIRD)):
        _train = _shaper.function(1.0, _zeta)
        _words = f"{_shaper.name}: {_train.duration:.2f} periods"
        _panel.plot(_ratio, 100.0 * residual(_ratio, _zeta, _train), color=_color, label=_words)
    _panel.axhline(5.0, color=INK, linewidth=0.8, linestyle="--")
    _panel.set(xlabel="True over assumed frequency", ylabel="Swing that remains (%)", ylim=(0, 60))
    legend(_figure, _panel)
    mo.vstack(
        [
            mo.md("## Look at it\n\nThis is by the formula for one mode, for a damping ratio of 0.2."),
            _figure,
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    count = mo.ui.slider(2, 12, 1, value=4, label="moves", show_value=True)
    draw = mo.ui.slider(0, 20, 1, value=7, label="seed of the moves", show_value=True)
    error = mo.ui.slider(-30, 30, 5, value=0, label="assumed frequency too high by (%)", show_value=True)
    mo.vstack(
        [
            mo.md(
                "## Try it on the arm\n\nThe moves are drawn at random over the workspace of a UR5e with 5 kg. Each is "
                "simulated unshaped and shaped; the largest acceleration of the tool after the end of the command "
                "counts. Four moves take some seconds."
            ),
            count,
            draw,
            error,
        ]
    )
    return count, draw, error


@app.cell
def _(count, draw):
    robot, calibration = load("ur5e"), load_calibration("ur5e_5kg")
    moves = draw_moves(robot, count.value, draw.value, (5.0, 5.0)).moves
    return calibration, moves, robot


@app.cell
def _(calibration, moves, own, robot):
    def try_on_moves(name, frequency_error):
        """Make each move unshaped and shaped; the shaper's frequency is too high by a share."""
        known = (OwnShaper("lesson_2_your_shaper.py", "mine", "", own),)
        method = Named(Recipe(name, calibration, frequency_error, own=known), name)
        return [measure(Job(Case(robot, move), (method,)))[0] for move in moves]

    return (try_on_moves,)


@app.cell
def _(error, rival, try_on_moves):
    tried = {name: try_on_moves(name, error.value / 100.0) for name in ("mine", rival.value)}
    return (tried,)


@app.function
def remaining(judged):
    """Median ratio of shaped to unshaped peak; moves that hardly vibrate are left out, unless all do."""
    loud = [row for row in judged if row["reduction_percent"] is not None] or judged
    return float(np.median([row["shaped_peak_m_s2"] / row["unshaped_peak_m_s2"] for row in loud]))


@app.function
def delay(judged):
    """Median delay of the moves [ms]."""
    return float(np.median([row["delay_ms"] for row in judged]))


@app.cell(hide_code=True)
def _(tried):
    _figure, (_panel,) = panels(1, 3.2)
    _unshaped = [row["unshaped_peak_m_s2"] for row in next(iter(tried.values()))]
    _where = 1 + np.arange(len(_unshaped))
    _panel.bar(_where - 0.27, _unshaped, 0.25, color=UNSHAPED, label="unshaped")
    for (_name, _judged), _color, _beside in zip(tried.items(), (SHAPED, THIRD), (0.0, 0.27), strict=True):
        _peaks = [row["shaped_peak_m_s2"] for row in _judged]
        _panel.bar(_where + _beside, _peaks, 0.25, color=_color, label=_name)
    _panel.set(xlabel="Move", ylabel="Largest acceleration\nafter it (m/s²)", xticks=_where)
    legend(_figure, _panel)
    _lines = [
        f"- `{name}` leaves **{100 * remaining(judged):.0f} %** and takes {delay(judged):.0f} ms longer (medians)."
        for name, judged in tried.items()
    ]
    mo.vstack([_figure, mo.md("\n".join(_lines))])
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Question

    Suppose that the assumed frequency is 25 % too high, because the arm carries more than was declared. Which of `zv`
    and `ei` leaves less on your moves, and which if the frequency is right? What does the more robust one cost?
    """)
    return


@app.cell(hide_code=True)
def _(try_on_moves):
    _tried = {(name, wrong): try_on_moves(name, wrong) for name in ("zv", "ei") for wrong in (0.0, 0.25)}
    answer = {
        "remaining": {key: remaining(judged) for key, judged in _tried.items()},
        "delay_ms": {name: delay(_tried[name, 0.0]) for name in ("zv", "ei")},
    }
    _delay = answer["delay_ms"]
    _left = {key: f"{100 * share:.0f} %" for key, share in answer["remaining"].items()}
    _best = {
        wrong: min(("zv", "ei"), key=lambda name: answer["remaining"][name, wrong]) for wrong in (0.0, 0.25)
    }
    mo.accordion(
        {
            "Answer": mo.md(
                f"With the wrong frequency `zv` leaves {_left['zv', 0.25]} and `ei` {_left['ei', 0.25]}: "
                f"**{_best[0.25]}** is better. With the right one `zv` leaves {_left['zv', 0.0]} and `ei` "
                f"{_left['ei', 0.0]}: **{_best[0.0]}** is better. `zv` makes the moves {_delay['zv']:.0f} ms longer, "
                f"`ei` {_delay['ei']:.0f} ms. What is left with the right frequency is of other modes, of "
                "friction and of the gears: `docs/results/floors.md` gives the share of each."
            )
        }
    )
    return (answer,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    To use your shaper on a served robot, save the function in a file and start `tvist serve --shaper FILE.py:mine`.
    `docs/how-to/change-a-shaper.md` explains this, and how to write a filter instead of impulses.
    """)
    return


if __name__ == "__main__":
    app.run()
