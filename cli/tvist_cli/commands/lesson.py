"""`tvist lesson`: the paper's Figure 2, in numbers."""

from pathlib import Path

from tvist_cli.failure import told
from tvist_cli.output import err, out, print_json, progress, table


def lesson(*, figures: Path | None = None, markdown: Path | None = None, json: bool = False) -> None:
    """Show on an arm with one flexible joint why a fixed shaper is not enough; takes about ten seconds.

    The robot one-joint is simulated as fast as possible. First it is plucked at many angles of its elbow, to compare
    its frequency and damping with their formulas; then it makes motions that end at three angles, unshaped and shaped.

    Args:
        figures: Folder to write figure 2 to.
        markdown: File to write a page with the formulas and the tables to.
        json: Print one JSON object.
    """
    from tvist_lab.one_joint import lesson as run
    from tvist_lab.one_joint.markdown import MODES, delays, left, modes, page

    with progress(run.COUNT, "plucks and motions") as bar:
        done = run.lesson(lambda: bar(1, None))
    with told(OSError):
        if figures is not None:
            from tvist_lab.figures import figure_2, save

            err.print(str(save(figure_2(done), figures / "figure_02.png")))
        if markdown is not None:
            markdown.write_text(page(done, f"tvist lesson --markdown {markdown}"), encoding="utf-8")
    if json:
        print_json(done.as_dict())
        return
    table(f"the mode at three angles of the elbow, {done.description.payload.mass:g} kg", MODES, modes(done))
    out.print(
        f"over {len(run.ANGLES)} angles with two payloads, the simulated f_d is within {done.worst_f_d:.2f} % of the "
        f"formula, ζ within {done.worst_zeta:.1f} %"
    )
    ends = [row[0] for row in modes(done)]
    table(
        "largest acceleration after motions that end at q, and share of the unshaped one",
        ("", *ends),
        left(done),
    )
    table("how much longer the motions last", ("", *ends), delays(done))
