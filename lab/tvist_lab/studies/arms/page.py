"""The arms and how well their vibration is suppressed, as a page of the documentation."""

from typing import Any

from tvist_lab.markdown_table import markdown_table


def robots_page(listed: list[dict[str, Any]], command: str) -> str:
    """Return the page about the arms.

    Args:
        listed: What `tvist robots --json` gives.
        command: The command that made the page, as it was typed.
    """
    return f"""# The arms

This page was made by

```sh
{command}
```

`tvist serve --robot NAME` serves one of them, `tvist robots NAME` tells all that is known of it, and
[a how-to](../how-to/add-a-robot.md) says how to add your own.

{_arms(listed)}

*Length* is that of all links after the first, stretched out. Kinematics, masses and limits of UR's arms are published.
The springs and drives of the UR5e were fitted to measured modes. Nobody has measured those of the others: they are
*assumed*, the UR5e's scaled by the [rule of dynamic similarity](../../sim_plant/tvist_plant/similar.py).

{_origins(listed)}

{_measurements(listed)}"""


def _arms(listed: list[dict[str, Any]]) -> str:
    head = ("name", "model", "joints", "length m", "payload kg", "largest torques N m", "calibrations")
    return markdown_table(
        head,
        [
            (
                f"`{one['name']}`",
                one["model"],
                str(len(one["joints"])),
                f"{one['length_m']:.2f}",
                f"{one['payload_kg']:g}",
                ", ".join(f"{torque:g}" for torque in one["torque_n_m"]),
                ", ".join(one["calibrations"]),
            )
            for one in listed
        ],
    )


def _origins(listed: list[dict[str, Any]]) -> str:
    rows = [
        (f"`{one['name']}`", f"`{key}`", kind, source)
        for one in listed
        for kind, keys in one["origins"].items()
        for key, source in keys.items()
    ]
    return "## Where the numbers come from\n\n" + markdown_table(("arm", "table or key", "", "source"), rows)


MEASURED = """## Vibration with the shaper `auto`

Each arm makes random moves with its rated payload, at the paper's limits, unshaped and shaped. A row whose springs
differ from the file shows what an error of the assumption means: all springs are stiffer or softer, and the arm is
identified again, as its user would do.

{table}

- *f_d off by*: median error of the calibration's first three modes at random poses.
- *moves*: those with enough vibration for a percentage, at least 0.2 m/s²; *too weak*: those left out since the drives
  cannot make them with the rated payload.
- *less*: how much smaller the largest acceleration of the tool after the stop is; one move in twenty has less than
  *p5*.
- *sag off by*: largest difference of a gear's twist at rest from gravity torque over stiffness, relative to the largest
  twist in the pose. It is not 0, since a sagging arm has other gravity torques than the commanded pose.
"""


def _measurements(listed: list[dict[str, Any]]) -> str:
    rows = [
        (
            f"`{one['name']}`",
            f"{100.0 * (found['stiffness'] - 1.0):+.0f} %",
            found["calibration"],
            ", ".join(f"{value:.1f}" for value in found["f_d_error_percent"]),
            str(found["counted"]),
            str(found["too_weak"]),
            _said(found["reduction_percent"]["median"]),
            _said(found["reduction_percent"]["p5"]),
            f"{found['delay_ms']:.0f}",
            f"{found['sag_error_percent']:.2f}",
        )
        for one in listed
        for found in one.get("measured", ())
    ]
    if not rows:
        return ""
    head = (
        "arm", "springs", "calibration", "f_d off by %", "moves", "too weak", "less % median", "p5", "delay ms",
        "sag off by %",
    )  # fmt: skip
    return MEASURED.format(table=markdown_table(head, rows))


def _said(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
