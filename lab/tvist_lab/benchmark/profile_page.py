"""The page about where a tick's time goes."""

from tvist_lab.benchmark.machine import Machine
from tvist_lab.benchmark.tick_profile import READ, SAMPLES, STREAM, BoxTime, Profiles, TickProfile, parts_of
from tvist_lab.markdown_table import markdown_table

FIGURE = "tick"
"""Name of the figure's file, without its suffix."""
COLUMNS = ("box", "calls", "µs itself", "share %", "sampled %")
SUMMARY = ("robot", "tick µs", "MuJoCo µs", "ratio", "95 %", "sum / untouched", "95 %", "wrapper µs")
INDENT = "&nbsp;" * 4


def page(found: Profiles, command: str) -> str:
    """Return the page.

    Args:
        found: What was measured.
        command: The command that made the page, as it was typed.
    """
    names = list(found.ticks)
    sections = "\n\n".join(f"## {_title(name)}\n\n{_section(found.ticks[name])}" for name in names)
    return f"""# Where a tick's time goes

This page was made by

```sh
{command}
```

on {place(found.machine)}, with a load of {found.machine.load:.1f} at its start. A robot in process
makes the first second of the motion from Q1 to Q3 with each of several filters, and once follows set-points. The boxes
are those of the paper's Figure 6 and what is around them, from the message that starts the ticks to the encoded state.
The times hold for this machine under its load; compare them with MuJoCo's tick of the same arm, measured in turn.

![Time of a tick by box](../images/{FIGURE}.png)

{markdown_table(SUMMARY, [summary(name, found.ticks[name]) for name in names], left=1)}

*itself* is the time of a box without its parts, which are indented below it, in µs per tick; shares add up to 100 %.
Each function of a box is wrapped by one that reads the clock. What that costs is found by wrapping all functions twice,
and subtracted: *wrapper* per call. *sum / untouched* compares the sum of all boxes with the same ticks without any
wrapper, and shows what this leaves. *sampled* are the same shares by {SAMPLES} samples of the untouched program, by a
timer of the processor's time; a box in compiled code has none, and counts for the one around it there.

{sections}
"""


def rows(found: TickProfile, indent: str = INDENT) -> list[tuple[str, ...]]:
    """Return the rows of a robot's table."""
    ordered = [(f"{indent * depth}{box.name}", box) for depth, box in parts_of(found.boxes)]
    whole = "", f"{found.us:.1f}", f"{100.0 * sum(box.share for box in found.boxes):.1f}", ""
    return [*((name, *_numbers(box)) for name, box in ordered), ("sum", *whole)]


def place(machine: Machine) -> str:
    """Return a machine in words."""
    return f"{machine.cpu}, {machine.cores} cores, {machine.system}, Python {machine.python}"


def _section(found: TickProfile) -> str:
    return markdown_table(COLUMNS, rows(found), left=1)


def _numbers(box: BoxTime) -> tuple[str, ...]:
    sampled = "–" if box.sampled is None else f"{100.0 * box.sampled:.1f}"
    return f"{box.calls:.2f}", f"{box.us:.2f}", f"{100.0 * box.share:.1f}", sampled


def summary(name: str, found: TickProfile) -> tuple[str, ...]:
    """Return a robot's row of the table beside MuJoCo."""
    mujoco, check = found.mujoco, found.check
    return (
        name,
        f"{mujoco.value:.1f}",
        f"{mujoco.reference_value:.1f}",
        f"{mujoco.compared:.3f}",
        f"{mujoco.low:.3f} to {mujoco.high:.3f}",
        f"{check.compared:.3f}",
        f"{check.low:.3f} to {check.high:.3f}",
        f"{found.wrapper_us:.2f}",
    )


def _title(name: str) -> str:
    told = {
        STREAM: f"{name}: a stream at 500 Hz, with its look-ahead for collisions",
        READ: f"{name}: states published over Zenoh, and UR's interfaces open",
    }
    return told.get(name, name)
