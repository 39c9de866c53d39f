"""Robustness against wrong stiffness and payload, as a page of the documentation."""

from typing import Any

from tvist_lab.evaluation.robustness import ERRORS, PERCENTILES


def robustness_page(result: dict[str, Any], command: str) -> str:
    """Return the tables of `tvist robustness` with their explanation.

    Args:
        result: What was measured.
        command: The command that made the page, as it was typed.
    """
    tables = "\n\n".join(
        f"## Wrong {kind}: {name}\n\n{_table(result['shapers'], kind, name)}"
        for kind in ERRORS
        for name in PERCENTILES
    )
    return f"""# Robustness

This page was made by

```sh
{command}
```

Every shaper makes {result["moves"]} random moves, seed {result["seed"]}, with payloads of 0 to 5 kg, on arms
all of whose springs are stiffer or softer than calibrated, and with a declared mass above or below the carried one. The
arm is otherwise as described. The tables show by how much per cent the largest
acceleration of the tool after the stop is reduced, compared with the unshaped move on the same arm; one move in twenty
has less than *p5*. The rows are ordered by what a shaper costs: the delay of the reference, with every tick between
shaper and drives.

![Reduction against delay, for each error](../images/robustness.png)

{tables}
"""


def _table(rows: list[dict[str, Any]], kind: str, name: str) -> str:
    errors = [f"{100.0 * error:+.0f} %" for error in sorted(ERRORS[kind])]
    lines = [
        "| shaper | delay ms | " + " | ".join(errors) + " |",
        "|---|---:|" + "---:|" * len(errors),
        *(
            f"| {row['name']} | {row['delay_ms']:.0f} | "
            + " | ".join(_said(row[kind][error]["reduction_percent"][name]) for error in errors)
            + " |"
            for row in rows
        ),
    ]
    return "\n".join(lines)


def _said(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
