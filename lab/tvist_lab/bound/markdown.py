"""The page about the bound."""

from typing import Any

from tvist_lab.bound.report import SUMMARY, TERMS, move_columns, move_rows, summary_rows
from tvist_lab.markdown_table import markdown_table

PAGE = """# How far from what is possible

This page was made by `{command}`; do not edit it.

A motion within limits of velocity, acceleration and jerk needs some time more if the arm is to rest when it ends. How
much more is a property of the arm, the limits and the move, not of a shaper. Let s(t) be the way, with a jerk that is
constant in each tick, and let each of the arm's four lowest modes be ẍ + 2ζωẋ + ω²x = -s̈, as at the end pose. The
least T for which s goes from rest to rest within the limits and x = ẋ = 0 at its end follows from a linear programme
and a search for the number of ticks ([`least_time.py`](../../lab/tvist_lab/bound/least_time.py)). The **bound** is T
less the least time without modes. Limits are the paper's: 1.5 rad/s, 2 rad/s², 100 rad/s³. The modes are those of the
arm in the robot file, the shapers know the calibration `{calibration}`, and the arm is {plant}.

This is the bound *without* feed-forward of the elasticity: it assumes that the arm answers to the reference alone. A
controller that feeds the elastic deflection forward may be faster. It is also the bound for *no* vibration of these
modes: whoever leaves a few per cent may be faster, too.

{tables}

## How `planned` works

`planned` replaces the double S of `move_j` by a law of its own. It is planned before the motion begins, beside the
tick, in some tenths of a second:

1. A model of the flexible arm, with the springs and drives of the calibration and the declared payload, is linearised
   along the motion. It contains the inertia on the way, centrifugal torque, gravity and the controller's own
   feed-forward. The vibration that is left at the end is then a linear function of the accelerations
   ([`elastic_arm.py`](../../controller/tvist_controller/quiet/elastic_arm.py)).
2. For a number of ticks, a quadratic programme finds the velocities within the limits that leave the least vibration,
   also if all frequencies are 3 % lower or higher than believed. An interior-point method made for these constraints
   takes 10 to 30 ms ([`interior_point.py`](../../controller/tvist_controller/quiet/interior_point.py)).
3. The smallest number of ticks is searched for with which at most 2 % of the unshaped motion's vibration is left.
4. The model is linearised again about the motion found, and the last programme repeated.

The motion keeps its limits by construction, and its filter does nothing. Stops, pauses and the speed slider work on it
as on any time law; it is quiet only if it ends at the speed at which it began.
"""

RANGE = """The bound is {median:.0f} ms in the median, and {min:.0f} to {max:.0f} ms. At Q1 and Q2 two modes of the arm
nearly coincide, one in the plane of the arm and one across it. The definition demands that both rest, however little a
motion excites one of them, which takes nearly twice as long as for one mode; `planned` knows what it excites."""


def page(result: dict[str, Any]) -> str:
    """Return the page."""
    least = result["bound_ms"]
    tables = "\n\n".join(
        (
            f"## {len(result['moves'])} moves",
            markdown_table(SUMMARY, summary_rows(result)),
            RANGE.format(**least),
            "\n".join(f"- **{term}**: {words}" for term, words in TERMS.items()),
            "## Each move",
            markdown_table(move_columns(result), move_rows(result)),
        )
    )
    return PAGE.format(
        command=result["command"], calibration=result["calibration"], plant=result["plant"], tables=tables
    )
