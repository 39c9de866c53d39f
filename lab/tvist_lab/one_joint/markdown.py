"""The lesson as a page of the documentation."""

import numpy as np

from tvist_lab.markdown_table import markdown_table
from tvist_lab.one_joint.lesson import ANGLES, MASSES, TURNS, WAYS, Lesson

HEAD = """\
# One flexible joint

For whoever learns or teaches shaping: why one fixed shaper is not enough for a robot arm. The arm is the smallest one
that shows it, that of Figure 2 of the paper (Thomsen et al., ICINCO 2019). Made by
`{command}`; do not edit.

An actuator with flexibility turns an arm that can stretch and fold. The actuator is a motor that holds its reference,
with a spring `K` and a damper `D` between it and the arm. The stretched arm has more inertia about the actuator, so it
vibrates more slowly. An arm that only turns about the actuator keeps its inertia; what changes it here is a second
joint, the elbow, which is rigid. Both axes are vertical, so the arm's weight plays no part.

![The arm at three angles of its elbow, and its frequency and damping over that angle](../images/figure_02.png)

## The formulas

```text
I(q) = J1 + J2 + m2 (l² + 2 l c2 cos q)      parallel-axis theorem and law of cosines
ζ(q) = D / (2 √(K I(q)))                     I θ̈ + D θ̇ + K θ = 0
f_d(q) = √(K / I(q)) / 2π · √(1 - ζ²)        equation (5) of the paper
```

`J1` is the inertia of the upper arm about the actuator, `l` its length; `J2` and `m2 c2` are inertia and first moment
of the forearm with its payload about the elbow; `q` is the elbow's angle, 0 for the stretched arm.

The drives are left out, because the robot file has drives that hardly yield. The simulated arm was plucked at
{angles} angles of its elbow with {masses} kg, and a damped sine was fitted to its accelerometer, noise included. The
frequencies agree with the formula within {worst_f_d:.2f} %, the damping ratios within {worst_zeta:.1f} %. Here damping
*rises* with frequency, as the damper is beside the spring. In the UR5e it falls, as the motor yields in series with the
gear; [the arm's page](../../sim_plant/README.md#where-the-numbers-come-from) says why.

"""
TABLES = """\
## The figure in numbers

With {mass:g} kg:

{modes}

## What it means for a shaper

Each number is the largest acceleration of the tool later than 10 ms after the reference has stopped, as a mean of
{turns} motions that end at `q`, and its share of the unshaped one. In these motions the shoulder turns by
{first:.0f}° to {last:.0f}° and the elbow by 60° or 120°, both in the same direction, within the paper's limits.

{left}

The fixed shaper is designed for `q` = 90°. It works there and fails at both ends, where its frequency is wrong. TVIST
follows the frequency and leaves less still, at all three. Polynomials that were identified from ring-downs are as good
as the formula. Most of what is left would be there without friction, gear errors and noise: the frequency changes while
a motion is in the filter, and the drives are not perfectly rigid.

The shaped motion lasts longer by half a period of the vibration that the shaper is designed for:

{delays}

All of this is simulated, and on a far simpler arm than a real one: it has one mode.

## Try it

```sh
tvist serve --robot one-joint
tvist move Q3
tvist identify --robot one-joint --output mine.json
tvist lesson --figures figures
```

[`shaping/examples/one_joint.py`](../../shaping/examples/one_joint.py) is the same on one page, with numpy and the
shaping library alone.
"""


def page(lesson: Lesson, command: str) -> str:
    """The page.

    Args:
        lesson: What was computed and measured.
        command: What the user typed.
    """
    head = HEAD.format(
        command=command,
        angles=len(ANGLES),
        masses=" and ".join(f"{mass:g}" for mass in MASSES),
        worst_f_d=lesson.worst_f_d,
        worst_zeta=lesson.worst_zeta,
    )
    return head + TABLES.format(
        mass=lesson.description.payload.mass,
        modes=markdown_table(MODES, modes(lesson)),
        turns=len(TURNS),
        first=np.degrees(TURNS[0]),
        last=np.degrees(TURNS[-1]),
        left=markdown_table(("", *_angles(lesson)), left(lesson)),
        delays=markdown_table(("", *_angles(lesson)), delays(lesson)),
    )


MODES = ("q", "I kg m²", "f_d Hz", "simulated", "ζ", "simulated")


def modes(lesson: Lesson) -> list[tuple[str, ...]]:
    """Rows of inertia, frequency and damping at the three angles, under `MODES`."""
    return [
        (
            f"{np.degrees(one.elbow):.0f}°",
            f"{one.inertia:.3f}",
            f"{one.f_d:.2f}",
            f"{one.simulated_f_d:.2f}",
            f"{one.zeta:.3f}",
            f"{one.simulated_zeta:.3f}",
        )
        for one in (result.mode for result in lesson.poses.values())
    ]


def left(lesson: Lesson) -> list[tuple[str, ...]]:
    """Rows of what is left by each way, a column an angle."""
    return [
        (
            label,
            *(f"{result.peak[way]:.3f} m/s², {result.left(way):.1f} %" for result in lesson.poses.values()),
        )
        for way, label in WAYS.items()
    ]


def delays(lesson: Lesson) -> list[tuple[str, ...]]:
    """Rows of how much longer a motion lasts by each way, a column an angle."""
    return [
        (label, *(f"{1e3 * result.delay[way]:.0f} ms" for result in lesson.poses.values()))
        for way, label in WAYS.items()
        if way != "unshaped"
    ]


def _angles(lesson: Lesson) -> list[str]:
    return [f"ends at q = {np.degrees(result.mode.elbow):.0f}°" for result in lesson.poses.values()]
