"""`python -m tvist_controller.programs.table`: prints docs/reference/generated/urscript-functions.md."""

from inspect import getdoc

from tvist_controller.programs.functions.unsimulated import SUBJECTS
from tvist_controller.programs.library import FUNCTION_GROUPS, known_signatures
from tvist_protocol.pages import markdown_table
from tvist_urscript import METHOD, REQUIRED, Signature, signatures

HEAD = """# URScript functions

The functions that programs can call, besides [those of the language](../urscript.md#3-functions). Printed by
`python -m tvist_controller.programs.table`.

- Units are metres, radians and seconds. Poses are those of the tool centre point in the base frame.
- Parameters with a default may be left out; any parameter may be given by name.
- A function that *waits* lets time pass. All others return in the same tick.
- A bad argument ends the program with an error at the position of the call.
- A move with a radius `r` is blended into the next move. The call returns at once, and the program runs on to that
  next move. Outputs, registers and log texts that it writes on the way take effect when the arm begins the blend;
  values that it reads are those of the present. A function that waits ends the path: the arm stops at the target of the
  last move.
"""
COSTS = """Evaluations that a call takes from [the budget](../urscript.md#4-threads). All other functions take one.
Inverse kinematics takes 900 more for an arm without a closed form, or with a free joint, for which it searches a curve
of postures."""


def page() -> str:
    """Return the reference page of all functions."""
    parts = [HEAD]
    for functions in FUNCTION_GROUPS:
        rows = [
            (f"`{_call(name, one)}`", "waits" if one.blocks else "", _what(functions, name))
            for name, one in signatures(functions).items()
        ]
        parts.append(f"## {functions.title}\n\n{markdown_table(('function', '', 'what'), rows)}\n")
    costs = sorted({one.cost for one in known_signatures().values() if one.cost > 1}, reverse=True)
    dear = [
        (
            str(cost),
            ", ".join(f"`{name}`" for name, one in sorted(known_signatures().items()) if one.cost == cost),
        )
        for cost in costs
    ]
    parts.append(f"## Costs\n\n{COSTS}\n\n{markdown_table(('evaluations', 'functions'), dear)}\n")
    missing = [
        (f"`{name}`", what)
        for name, (_, what) in sorted(SUBJECTS.items(), key=lambda row: (row[1][1], row[0]))
        if name != METHOD
    ]
    parts.append(
        "## Not simulated\n\nThese, and methods such as `handle.call()`, end the program with an error that names them."
        f"\n\n{markdown_table(('function', 'subject'), missing)}\n"
    )
    return "\n".join(parts)


def _call(name: str, one: Signature) -> str:
    parameters = [
        parameter.name if parameter.default is REQUIRED else f"{parameter.name}={_shown(parameter.default)}"
        for parameter in one.parameters
    ]
    return f"{name}({', '.join(parameters)})"


def _shown(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _what(functions: type, name: str) -> str:
    text = getdoc(getattr(functions, name)) or ""
    return " ".join(text.partition("\n\n")[0].split())


if __name__ == "__main__":
    print(page(), end="")  # noqa: T201  its purpose
