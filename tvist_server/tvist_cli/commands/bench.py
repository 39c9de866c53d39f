"""`tvist bench`: how fast it is on this machine."""

from tvist_cli.output import err, out, print_json, table


def bench(*, seconds: float = 10.0, json: bool = False) -> None:
    """Measure plant, filter, control cycle and the whole line, and the punctuality of a served robot.

    Args:
        seconds: How long to watch a served robot tick in real time, with one client and a recorder; 0: not at all.
        json: Print one JSON object.
    """
    from tvist_lab.bench import bench as run

    result = run(seconds, tell=lambda what: err.print(f"measuring {what} ..."))
    if json:
        print_json(result)
        return
    flat = {key: value for key, value in result.items() if not isinstance(value, dict)}
    table(
        "in this process, one core",
        ("what", "figure"),
        [(key, f"{value:.4g}") for key, value in flat.items()],
    )
    for key, values in result.items():
        if isinstance(values, dict):
            table(key, ("what", "figure"), [(name, f"{value:.4g}") for name, value in values.items()])
    out.print("Figures are of this machine under what else it was doing; ratios travel, microseconds do not.")
