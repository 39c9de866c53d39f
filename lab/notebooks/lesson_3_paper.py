"""Lesson 3: the paper's experiment on the simulated arm."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(app_title="3: The paper's experiment")

with app.setup:
    import marimo as mo
    import numpy as np

    from tvist_lab.figures.style import INK, SHAPED, THIRD, UNSHAPED, legend, panels
    from tvist_lab.in_process import free_setup, robot_in_process
    from tvist_lab.metrics import amplitude, best_tool_acceleration, motions
    from tvist_lab.studies.paper import methods as ways
    from tvist_lab.studies.paper.experiment import judge, run, table_1
    from tvist_lab.studies.paper.published import MOTIONS, published
    from tvist_shaping import residual, zv


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 3: The paper's experiment

    **You learn** what time-varying input shaping does to the motions of the paper (Thomsen, Søe-Knudsen, Brandt and
    Zhang, ICINCO 2019), how vibration is measured, and how far a simulated arm agrees with the real UR5e.

    The robot below runs in this notebook as fast as it can be computed: the same controller, shaper and arm as
    `tvist serve`, without a network. Each motion is made three times:

    - **unshaped**: the command as it is;
    - **fixed ZV**: a zero-vibration shaper for the pose in which the motion *starts*, and held there;
    - **TVIST**: a zero-vibration shaper whose delay follows the estimated frequency of the pose, tick by tick.

    Q1 is stretched out, Q2 the same with the base turned, Q3 folded.
    """)
    return


@app.cell(hide_code=True)
def _():
    motion = mo.ui.dropdown(list(MOTIONS), value="Q1-Q3", label="motion (a new one takes some seconds)")
    seed = mo.ui.slider(0, 9, 1, value=0, label="seed of noise and gear errors", show_value=True)
    mo.vstack([motion, seed])
    return motion, seed


@app.function
async def make(motion, seed):
    """The lowest mode in the paper's poses, and a recording of the motion by each method."""
    async with robot_in_process(free_setup(seed=seed)) as robot, robot.control("lesson") as arm:
        modes = await table_1(robot, arm)
        start = modes[MOTIONS[motion][0]]
        fixed = ways.fixed("zv", start["f_d_hz"], start["zeta"])
        methods = {"unshaped": ways.UNSHAPED, "fixed ZV": fixed, "TVIST": ways.SHAPED}
        return modes, {
            name: await run(robot, arm, motion, method, seed=1000 * seed) for name, method in methods.items()
        }


@app.cell
async def _(motion, seed):
    modes, recordings = await make(motion.value, seed.value)
    judged = {name: judge(recording) for name, recording in recordings.items()}
    return judged, modes, recordings


@app.cell(hide_code=True)
def _(recordings):
    _figure, (_above, _below) = panels(2, 5.4)
    _unshaped = recordings["unshaped"]
    _motion = motions(_unshaped)[0]
    _end = _unshaped.time[_motion.reference_stop] - _unshaped.time[_motion.start]
    for (_name, _recording), _color in zip(recordings.items(), (UNSHAPED, THIRD, SHAPED), strict=True):
        _motion = motions(_recording)[0]
        _time = 1e3 * (_recording.time - _recording.time[_motion.start] - _end)
        _joint = int(np.argmax(np.max(np.abs(_recording["target_qdd"]), axis=0)))
        _above.plot(_time, _recording["target_qdd"][:, _joint], color=_color, label=_name)
        _below.plot(_time, amplitude(best_tool_acceleration(_recording)), color=_color)
    _above.set(ylabel="Commanded acceleration\nof a joint (rad/s²)")
    _below.set(
        xlabel="Time after the unshaped motion's end (ms)",
        ylabel="Acceleration\nof the tool (m/s²)",
        xlim=(-300, 400),
        ylim=(0, 2),
    )
    _below.axhline(0.1, color=INK, linewidth=0.8, linestyle="--")
    legend(_figure, _above)
    mo.vstack(
        [
            mo.md(
                "## The end of the motion\n\nThe steps in the command are the impulses of the shaper at work."
            ),
            _figure,
        ]
    )
    return


@app.function
def markdown(columns, rows):
    """A table."""
    lines = [columns, ["---", *["---:"] * (len(columns) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


@app.function
def number(value, form):
    """A number in a table; a dash where there is none."""
    return "–" if value is None else format(value, form)


@app.cell(hide_code=True)
def _(judged):
    _columns = ["method", "longer by (ms)", "largest acceleration after it (m/s²)", "at rest after (ms)"]
    _rows = [
        [
            name,
            f"{one.result.delay_ms:.0f}",
            f"{one.peak:.3f}",
            number(None if one.still_after is None else 1e3 * one.still_after, ".0f"),
        ]
        for name, one in judged.items()
    ]
    mo.md(
        "The largest acceleration is that of the tool later than 10 ms after the end of the command, without noise; "
        "the tool is at rest when its acceleration stays below 0.1 m/s² (dashed).\n\n"
        + markdown(_columns, _rows)
    )
    return


@app.cell(hide_code=True)
def _(judged, motion):
    _columns = {
        "delay_ms": ("delay (ms)", ".0f"),
        "stabilisation_ms": ("stabilisation (ms)", ".0f"),
        "cycle_ms": ("cycle (ms)", ".0f"),
        "overshoot_m": ("overshoot (m)", ".1e"),
        "residual_vibration_m_s2": ("residual vibration (m/s²)", ".2f"),
    }
    _paper = published()["table_2"][motion.value]
    table_2 = {}
    for _kind, _method in (("unshaped", "unshaped"), ("shaped", "TVIST")):
        table_2[f"{_kind}, paper"] = _paper[_kind]
        table_2[f"{_kind}, here"] = {key: getattr(judged[_method].result, key) for key in _columns}
    _rows = [
        [name, *(number(values[key], form) for key, (_, form) in _columns.items())]
        for name, values in table_2.items()
    ]
    mo.md(
        f"## Table 2 of the paper: {motion.value}\n\nThe paper's figures are means of ten runs of a real arm; ours are "
        "of one run of a simulated arm. *Stabilisation* is the time from the tool's first coming within 0.03 mm of "
        "where it ends to its staying there, *cycle* the time from the start until then, *overshoot* how far it leaves "
        "that place in between. *Residual vibration* is read off the noisy accelerometer, as in the paper, so that it "
        "never falls below about 0.1 m/s². The simulated arm was calibrated to the paper's frequencies and damping "
        "ratios; `docs/reference/paper.md` says of every figure whether it was fitted or predicted.\n\n"
        + markdown(["", *(words for words, _ in _columns.values())], _rows)
    )
    return (table_2,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Question

    The fixed ZV is right where the motion starts. Lesson 1 says how much a ZV for one frequency leaves at another. How
    much should the fixed ZV leave at the *end* of this motion, and how much of the unshaped vibration did it leave?
    Does your prediction change for Q1-Q2?
    """)
    return


@app.cell(hide_code=True)
def _(judged, modes, motion):
    _start, _end = (modes[pose] for pose in MOTIONS[motion.value])
    answer = {
        "predicted": float(
            residual(_end["true_f_d_hz"], _end["true_zeta"], zv(_start["f_d_hz"], _start["zeta"]))
        ),
        "fixed": judged["fixed ZV"].peak / judged["unshaped"].peak,
        "tvist": judged["TVIST"].peak / judged["unshaped"].peak,
    }
    mo.accordion(
        {
            "Answer": mo.md(
                f"The ZV was designed for {_start['f_d_hz']:.1f} Hz, and the arm ends at {_end['true_f_d_hz']:.1f} Hz. "
                f"The formula of lesson 1 predicts that **{100 * answer['predicted']:.0f} %** remains; "
                f"**{100 * answer['fixed']:.0f} %** did. TVIST left **{100 * answer['tvist']:.0f} %**. The formula is "
                "for one mode of a fixed frequency, and the peak is taken later than 10 ms after the end of each "
                "command, when part of the swing has decayed: it says how large the effect is, not its second digit."
            )
        }
    )
    return (answer,)


if __name__ == "__main__":
    app.run()
