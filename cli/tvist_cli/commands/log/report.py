"""`tvist log report`: write a web page about recordings."""

from pathlib import Path

from tvist_cli.failure import Misuse
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import default_output, print_lines, typed, write_report


def report(*files: Path, output: Path | None = None, logs: LogOptions = AS_IT_IS, json: bool = False) -> None:
    """Write a report of recordings or logs as one web page that needs no network.

    Its verdict tells how much the tool vibrates and, for several files, whether the others vibrate less than
    the first.

    Args:
        files: Read these recordings or logs, in any format that tvist log analyze reads; the others are
            compared with the first.
        output: Write to this file and replace it if it exists [report.html, if there is none yet].
        logs: How to read logs.
        json: Print the verdict as one JSON object.
    """
    if not files:
        raise Misuse("report needs at least one recording or log: tvist log report run.mcap")
    output = default_output(Path("report.html")) if output is None else output
    from tvist_lab.report import recordings_page

    recordings = logs.read(*files)
    page = recordings_page(files, typed(), recordings)
    write_report(output, page)
    result = {"files": [str(file) for file in files], "report": str(output), "verdict": list(page.verdict)}
    print_lines(result, page.verdict, json=json)
