"""Lesson 1: how the modes change with the pose, and why one fixed shaper is not enough."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="1: What changes with the pose")

with app.setup:
    import marimo as mo
    import numpy as np
    from matplotlib import rcParams

    from tvist_controller.api.line import estimator_of, load_calibration
    from tvist_lab.figures import house_settings
    from tvist_lab.figures.style import INK, SHAPED, UNSHAPED, legend, note, panels, title
    from tvist_lab.studies.paper.published import pose
    from tvist_lab.study.method_list import names
    from tvist_lab.workspace import identified
    from tvist_plant.description import load
    from tvist_shaping import residual, shaper

    rcParams.update(house_settings())


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 1: What changes with the pose

    **You learn** how much the frequency and the damping of a UR5e change while it moves, and why a shaper that is
    designed once cannot serve its whole workspace.

    A stretched arm is a long lever with a heavy end: it swings slowly. A folded arm swings faster. The package contains
    a *calibration* of the UR5e with 5 kg: polynomials that give the damped frequency $f_d$ and the damping ratio
    $\zeta$ of its lowest mode for any pose. They were fitted to ring-downs in 163 poses of the simulated arm. Turning
    the base changes nothing, and the outer two joints of the wrist hardly do, so three joints remain.
    Which of the three matters most, and why?
    """)
    return


@app.cell
def _():
    estimator = estimator_of(load_calibration("ur5e_5kg"))
    return (estimator,)


@app.cell(hide_code=True)
def _():
    shoulder = mo.ui.slider(-180, 0, 5, value=-180, label="shoulder (°)", show_value=True)
    elbow = mo.ui.slider(-150, 150, 5, value=0, label="elbow (°)", show_value=True)
    wrist = mo.ui.slider(-180, 0, 5, value=-90, label="wrist (°)", show_value=True)
    mo.vstack([shoulder, elbow, wrist])
    return elbow, shoulder, wrist


@app.function
def modes(estimator, poses):
    """Return damped frequency [Hz] and damping ratio of the lowest mode in each pose."""
    found = np.array([[value[0] for value in estimator.estimate(q)] for q in poses])
    return found[:, 0], found[:, 1]


@app.cell(hide_code=True)
def _(estimator, shoulder):
    wrists, elbows = np.linspace(-180, 0, 25), np.linspace(-150, 150, 31)
    _poses = [
        np.radians([0.0, shoulder.value, second, first, 0.0, 0.0]) for second in elbows for first in wrists
    ]
    frequencies, dampings = (values.reshape(31, 25) for values in modes(estimator, _poses))
    return dampings, elbows, frequencies, wrists


@app.cell(hide_code=True)
def _(dampings, elbow, elbows, estimator, frequencies, shoulder, wrist, wrists):
    _q = np.radians([0.0, shoulder.value, elbow.value, wrist.value, 0.0, 0.0])
    (here_f,), (here_zeta,) = modes(estimator, [_q])
    _figure, _panels = panels(2, 6.0, share_x=False)
    for _panel, _values, _name in zip(
        _panels, (frequencies, dampings), ("$f_d$ (Hz)", r"$\zeta$"), strict=True
    ):
        _drawn = _panel.contourf(wrists, elbows, _values, levels=14, cmap="viridis")
        _figure.colorbar(_drawn, ax=_panel, label=_name)
        _panel.plot(
            [wrist.value], [elbow.value], "o", color="white", markeredgecolor=INK, markersize=9, clip_on=False
        )
        _panel.set(xlabel="Wrist (°)", ylabel="Elbow (°)")
        title(_panel, f"{_name} with the shoulder at {shoulder.value}°; the circle is your pose")
    _words = f"In your pose the arm swings at **{here_f:.1f} Hz** with $\\zeta$ = **{here_zeta:.2f}**."
    mo.vstack([_figure, mo.md(_words)])
    return here_f, here_zeta


@app.cell(hide_code=True)
def _(estimator):
    _named = {key: estimator.estimate(np.array(pose(key))) for key in ("Q1", "Q2", "Q3")}
    mo.md(
        "The paper's poses: "
        + "; ".join(f"{key} {f[0]:.1f} Hz, $\\zeta$ = {z[0]:.2f}" for key, (f, z) in _named.items())
        + "."
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## A shaper that is designed once

    Choose a shaper and its design frequency. Each point is a pose of the workspace and shows how much of the swing
    would remain there. A shaper that follows the pose would leave nothing in any of them.
    """)
    return


@app.cell(hide_code=True)
def _():
    chosen = mo.ui.dropdown(names("lesson"), value="zv", label="shaper")
    design = mo.ui.slider(6.0, 18.0, 0.5, value=10.5, label="designed for (Hz)", show_value=True)
    mo.vstack([chosen, design])
    return chosen, design


@app.cell(hide_code=True)
def _(estimator):
    workspace = identified(load("ur5e")).spread(250, 6, seed=0)
    spread_f, spread_zeta = modes(estimator, workspace)
    return spread_f, spread_zeta


@app.function
def remaining(f_d, zeta, impulses):
    """Return the share of the swing that impulses leave in each pose."""
    return np.array([float(residual(f, z, impulses)) for f, z in zip(f_d, zeta, strict=True)])


@app.cell(hide_code=True)
def _(chosen, design, spread_f, spread_zeta):
    _impulses = shaper(chosen.value).function(design.value, float(np.median(spread_zeta)))
    left = remaining(spread_f, spread_zeta, _impulses)
    _figure, (_above, _below) = panels(2, 5.0)
    _above.plot(spread_f, 100.0 * left, ".", color=UNSHAPED, label=f"{chosen.value} for {design.value:g} Hz")
    _above.axhline(0.0, color=SHAPED, linewidth=2, label="a shaper that follows the pose")
    _above.axhline(5.0, color=INK, linewidth=0.8, linestyle="--")
    note(
        _above,
        "5 %",
        (1.0, 5.0),
        xycoords=("axes fraction", "data"),
        xytext=(0, 3),
        textcoords="offset points",
        ha="right",
    )
    _above.set(ylabel="Swing that remains (%)")
    _below.hist(spread_f, bins=30, color=SHAPED, alpha=0.6)
    _below.set(xlabel="Damped frequency of the pose (Hz)", ylabel="Poses")
    legend(_figure, _above)
    mo.vstack(
        [
            _figure,
            mo.md(
                f"More than 5 % remains in **{100 * np.mean(left > 0.05):.0f} %** of the poses, and up to "
                f"**{100 * left.max():.0f} %**. This shaper makes each motion **{1e3 * _impulses.duration:.0f} ms** "
                "longer."
            ),
        ]
    )
    return (left,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Question

    With the best single frequency, how much does your shaper leave in the worst pose, and which frequency is that? Move
    the slider to find it. Then choose `ei3`, the most robust one: is it worth its duration?
    """)
    return


@app.cell(hide_code=True)
def _(chosen, spread_f, spread_zeta):
    _designs = np.linspace(spread_f.min(), spread_f.max(), 60)
    _zeta = float(np.median(spread_zeta))
    _worst = [
        remaining(spread_f, spread_zeta, shaper(chosen.value).function(f_d, _zeta)).max() for f_d in _designs
    ]
    _best = int(np.argmin(_worst))
    answer = {
        "design_hz": float(_designs[_best]),
        "worst": float(_worst[_best]),
        "fixed_ms": 1e3 * shaper(chosen.value).function(float(_designs[_best]), _zeta).duration,
        "following_ms": float(np.mean(500.0 / spread_f)),
    }
    mo.accordion(
        {
            "Answer": mo.md(
                f"`{chosen.value}` is best designed for **{answer['design_hz']:.1f} Hz**, and still leaves up to "
                f"**{100 * answer['worst']:.0f} %**. It costs {answer['fixed_ms']:.0f} ms a motion. A ZV that "
                f"follows the pose leaves nothing and costs {answer['following_ms']:.0f} ms on average. The frequency "
                f"spans {spread_f.min():.1f} to {spread_f.max():.1f} Hz: no fixed shaper that is as short covers it."
            )
        }
    )
    return (answer,)


if __name__ == "__main__":
    app.run()
