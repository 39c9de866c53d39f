"""Lesson 1: why an arm rings, and what two impulses do about it."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="1: Why an arm rings, and what two impulses do about it")

with app.setup:
    import marimo as mo
    import numpy as np
    from matplotlib.figure import Figure

    import tvist_shaping as ts

    # The colours of tvist_lab.figures, which this lesson does not import: it needs only numpy, matplotlib and
    # tvist_shaping.
    UNSHAPED, SHAPED, THIRD, INK = "#D55E00", "#0B4A85", "#5FBF9A", "#333333"


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 1: Why an arm rings, and what two impulses do about it

    **You learn** why a flexible arm swings on after its motor has stopped, how two small commands instead of one make
    it stop, and what that costs when the frequency is not known exactly.

    ## One mass on a spring

    An arm with flexible joints is, to a first approximation, a mass on a spring. The motor moves one end of the
    spring to a new position at once; the mass follows, and swings. Two numbers describe this *mode*: its **damped
    frequency** $f_d$ and its **damping ratio** $\zeta$. Without damping ($\zeta = 0$) the mass would swing for ever.
    """)
    return


@app.cell(hide_code=True)
def _():
    frequency = mo.ui.slider(2.0, 15.0, 0.5, value=7.0, label="damped frequency $f_d$ (Hz)", show_value=True)
    damping = mo.ui.slider(0.0, 0.5, 0.01, value=0.1, label=r"damping ratio $\zeta$", show_value=True)
    mo.vstack([frequency, damping])
    return damping, frequency


@app.function
def step_response(time, f_d, zeta):
    """Position of the mass after the motor end moved from 0 to 1 at time 0."""
    omega = 2.0 * np.pi * f_d
    sigma = omega * zeta / np.sqrt(1.0 - zeta**2)
    late = np.maximum(time, 0.0)
    swing = np.exp(-sigma * late) * (np.cos(omega * late) + sigma / omega * np.sin(omega * late))
    return np.where(time < 0.0, 0.0, 1.0 - swing)


@app.function
def panels(*widths):
    """A figure with panels side by side."""
    figure = Figure(figsize=(8.0, 3.2), dpi=110, layout="constrained")
    axes = figure.subplots(1, len(widths), width_ratios=widths, squeeze=False)[0]
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(visible=True, color="#E4E4E4", linewidth=0.6)
    return figure, axes


@app.cell(hide_code=True)
def _(damping, frequency):
    _time = np.linspace(-0.1, 1.0, 800)
    _figure, (_panel,) = panels(1)
    _panel.plot(_time, np.where(_time < 0.0, 0.0, 1.0), color=INK, linestyle=":", label="motor")
    _panel.plot(_time, step_response(_time, frequency.value, damping.value), color=UNSHAPED, label="mass")
    _panel.set(xlabel="Time (s)", ylabel="Position", ylim=(-0.1, 2.1))
    _panel.legend(frameon=False, loc="upper right")
    overshoot = np.exp(-np.pi * damping.value / np.sqrt(1.0 - damping.value**2))
    mo.vstack([_figure, mo.md(f"The mass overshoots by **{100 * overshoot:.0f} %** of the step.")])
    return (overshoot,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Two impulses

    Now the motor moves in two parts: a share of the step at once, and the rest a little later. Each part makes the mass
    swing. If the second swing meets the first in opposite phase and with the same size, nothing is left of both.

    An *input shaper* does this to any command: it replaces each change by several smaller changes, the *impulses*
    $A_1, A_2, \dots$ at the times $\tau_1 = 0, \tau_2, \dots$, whose sum is one.

    **Try it:** find the waiting time and the share at which the blue curve stops swinging. When the damping is zero,
    the right share is one half; why must it be larger when there is damping?
    """)
    return


@app.cell(hide_code=True)
def _():
    wait = mo.ui.slider(
        0.0, 1.0, 0.02, value=0.3, label="second part after (periods, $f_d \\tau_2$)", show_value=True
    )
    share = mo.ui.slider(0.3, 1.0, 0.01, value=0.5, label="share of the first part, $A_1$", show_value=True)
    mo.vstack([wait, share])
    return share, wait


@app.cell(hide_code=True)
def _(damping, frequency, share, wait):
    impulses = ts.Impulses(
        np.array([share.value, 1.0 - share.value]), np.array([0.0, wait.value / frequency.value])
    )
    remaining = float(ts.residual(frequency.value, damping.value, impulses))
    return impulses, remaining


@app.cell(hide_code=True)
def _(damping, frequency, impulses, remaining):
    _time = np.linspace(-0.1, 1.0, 800)
    _parts = [
        A * step_response(_time - tau, frequency.value, damping.value)
        for A, tau in zip(impulses.A, impulses.tau, strict=True)
    ]
    _figure, (_panel, _plane) = panels(2, 1)
    _panel.plot(_time, _parts[0], color=UNSHAPED, linewidth=1.0, label="first part")
    _panel.plot(_time, _parts[1], color=THIRD, linewidth=1.0, label="second part")
    _panel.plot(_time, _parts[0] + _parts[1], color=SHAPED, linewidth=2.2, label="both")
    _panel.set(xlabel="Time (s)", ylabel="Position of the mass", ylim=(-0.1, 2.1))
    _panel.legend(frameon=False, loc="upper right")
    # Each part's swing as a vector when the second part begins: the first has turned and decayed by then.
    _omega = 2.0 * np.pi * frequency.value
    _sigma = _omega * damping.value / np.sqrt(1.0 - damping.value**2)
    _age = impulses.tau[-1] - impulses.tau
    _vectors = impulses.A * np.exp((-_sigma + 1j * _omega) * _age)
    _from = 0.0
    for _vector, _color in zip(_vectors, (UNSHAPED, THIRD), strict=True):
        _to = _from + _vector
        _plane.annotate(
            "",
            (_to.real, _to.imag),
            (np.real(_from), np.imag(_from)),
            arrowprops={"arrowstyle": "->", "color": _color, "linewidth": 2},
        )
        _from = _to
    _plane.plot([0.0, _from.real], [0.0, _from.imag], color=SHAPED, linewidth=3, solid_capstyle="round")
    _plane.set(xlim=(-1, 1), ylim=(-1, 1), aspect="equal", title="swings as vectors: blue remains")
    _plane.title.set_fontsize(9)
    mo.vstack([_figure, mo.md(f"**{100 * remaining:.1f} %** of the swing remains.")])
    return


@app.cell(hide_code=True)
def _(damping, frequency):
    zv = ts.zv(frequency.value, damping.value)
    mo.accordion(
        {
            "Where does nothing remain?": mo.md(
                f"After half a period, so {1e3 * zv.tau[1]:.0f} ms, with a first share of "
                f"**{zv.A[0]:.3f}** at this damping. The second part must be smaller than the first, since the first "
                "swing has decayed by the time they meet. This is the *zero-vibration* shaper, ZV."
            )
        }
    )
    return (zv,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## When the frequency is wrong

    The two swings cancel only if the shaper knows the frequency. If the true frequency is different, the second swing
    comes too early or too late. *Robust* shapers have more impulses: they leave little over a wider band of
    frequencies, and take longer.
    """)
    return


@app.cell(hide_code=True)
def _():
    _names = [name for name in ts.SHAPERS if name != "none"]
    chosen = mo.ui.multiselect(_names, value=["zv", "zvd", "ei"], label="shapers")
    error = mo.ui.slider(-40, 40, 1, value=10, label="true frequency is higher by (%)", show_value=True)
    mo.vstack([chosen, error])
    return chosen, error


@app.cell(hide_code=True)
def _(chosen, damping, error):
    _ratio = np.linspace(0.5, 1.5, 501)
    _figure, (_panel,) = panels(1)
    for _name, _color in zip(
        chosen.value, (UNSHAPED, SHAPED, THIRD, "#CC79A7", INK, "#E69F00"), strict=False
    ):
        _train = ts.shaper(_name).function(1.0, damping.value)
        _left = 100.0 * ts.residual(_ratio, damping.value, _train)
        _here = 100.0 * float(ts.residual(1.0 + error.value / 100.0, damping.value, _train))
        _words = f"{_name}: lasts {_train.duration:.2f} periods, leaves {_here:.1f} %"
        _panel.plot(_ratio, _left, color=_color, label=_words)
        _panel.plot([1.0 + error.value / 100.0], [_here], "o", color=_color)
    _panel.axhline(5.0, color=INK, linewidth=0.8, linestyle="--")
    _panel.set(xlabel="True over assumed frequency", ylabel="Swing that remains (%)", ylim=(0.0, 60.0))
    if chosen.value:
        _panel.legend(frameon=False, loc="upper center", fontsize=8)
    _figure
    return


@app.cell(hide_code=True)
def _():
    tolerance = mo.ui.slider(0, 40, 1, value=10, label="the frequency is known within ± (%)", show_value=True)
    mo.vstack(
        [
            mo.md(
                "## Question\n\nYou know the frequency of your arm only within some percent. What is the most that "
                "ZV leaves, and which is the **shortest** shaper that never leaves more than 5 %? Read it off the "
                "figure first; the damping ratio is that of the slider at the top."
            ),
            tolerance,
        ]
    )
    return (tolerance,)


@app.function
def worst(shaper, tolerance, zeta):
    """Largest share of the swing that a shaper leaves for a true frequency within a tolerance."""
    true = np.linspace(1.0 - tolerance, 1.0 + tolerance, 201)
    return float(np.max(ts.residual(true, zeta, shaper.function(1.0, zeta))))


@app.cell(hide_code=True)
def _(damping, tolerance):
    _share = tolerance.value / 100.0
    # Shapers with negative impulses are shorter still, but ask more of the motors than the command did.
    _candidates = [
        shaper
        for shaper in ts.SHAPERS.values()
        if shaper.duration_periods and shaper.peak == 1.0 and damping.value < shaper.zeta_max
    ]
    _good = [shaper for shaper in _candidates if worst(shaper, _share, damping.value) <= 0.05 + 1e-3]
    _periods = [round(shaper.function(1.0, damping.value).duration, 6) for shaper in _good]
    answer = {
        "zv_leaves": worst(ts.shaper("zv"), _share, damping.value),
        "shortest": [s.name for s, periods in zip(_good, _periods, strict=True) if periods == min(_periods)],
        "periods": min(_periods, default=None),
    }
    _words = (
        f"The shortest within 5 %: **{', '.join(answer['shortest'])}**, {answer['periods']:.2f} periods long. "
        "ZV is 0.50 periods long."
        if _good
        else "No shaper of the catalogue does that."
    )
    mo.accordion({"Answer": mo.md(f"ZV leaves up to **{100 * answer['zv_leaves']:.1f} %**. {_words}")})
    return (answer,)


if __name__ == "__main__":
    app.run()
