"""Tables of `tvist bench`: figures beside their references, and two runs beside each other."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from tvist_cli.output import out, table

if TYPE_CHECKING:
    from tvist_lab.benchmark.figure import Figure
    from tvist_lab.benchmark.machine import Machine
    from tvist_lab.benchmark.saved_run import BenchRun, Change


def print_figures(title: str, figures: "Mapping[str, Figure]") -> None:
    """Print figures with their references."""
    columns = ("figure", "value", "unit", "reference", "value", "compared", "95 %", "n")
    table(title, columns, [_row(one) for one in figures.values()])


def print_run(run: "BenchRun") -> None:
    """Print a run: its machine and its figures."""
    print_figures(_place(run.machine), run.figures)
    flat = {key: value for key, value in run.details.items() if not isinstance(value, dict)}
    nested = {key: value for key, value in run.details.items() if isinstance(value, dict)}
    for title, values in (({"without a reference": flat} if flat else {}) | nested).items():
        table(title, ("what", "figure"), [(key, f"{value:.4g}") for key, value in values.items()])
    out.print(
        "compared: × is the figure divided by its reference, + or − their difference; both are of this run."
    )


def print_changes(old: "BenchRun", new: "BenchRun", found: "Sequence[Change]") -> None:
    """Print what differs between a saved run and a new one."""
    columns = ("figure", "saved", "this run", "change", "95 %", "beyond")
    table("against the saved run", columns, [_changed(one) for one in found])
    out.print(
        "change: this run's comparison divided by the saved one, or minus it; beyond: by more than chance."
    )
    if _place(old.machine) != _place(new.machine):
        out.print(f"The saved run was made on another machine: {_place(old.machine)}.", soft_wrap=True)


def _row(one: "Figure") -> tuple[str, ...]:
    return (
        one.what,
        f"{one.value:.4g}",
        one.unit,
        one.reference,
        f"{one.reference_value:.4g}",
        _compared(one.compared, one.relation),
        _interval(one.low, one.high, one.relation),
        str(one.repetitions),
    )


def _changed(one: "Change") -> tuple[str, ...]:
    what = (one.new or one.old).what  # type: ignore[union-attr]  # one of the two has it
    if one.old is None or one.new is None:
        only = "only in this run" if one.old is None else "only in the saved run"
        shown = [
            "–" if figure is None else _compared(figure.compared, figure.relation)
            for figure in (one.old, one.new)
        ]
        return what, *shown, only, "", ""
    return (
        what,
        _compared(one.old.compared, one.old.relation),
        _compared(one.new.compared, one.new.relation),
        _compared(one.change, one.relation),
        _interval(one.low, one.high, one.relation),
        {None: "not known", True: "yes", False: "no"}[one.beyond],
    )


def _compared(value: float | None, relation: str) -> str:
    if value is None:
        return "–"
    return f"× {value:.3g}" if relation == "ratio" else f"{value:+.3g}"


def _interval(low: float | None, high: float | None, relation: str) -> str:
    if low is None or high is None:
        return ""
    sign = "" if relation == "ratio" else "+"
    return f"{low:{sign}.3g} to {high:{sign}.3g}"


def _place(machine: "Machine") -> str:
    return f"{machine.cpu}, {machine.cores} cores, {machine.system}, Python {machine.python}"
