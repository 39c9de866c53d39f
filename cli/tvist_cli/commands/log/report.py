"""`tvist log report`: a web page about recordings, in one file."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json, typed, write_report


def report(
    *files: Path,
    output: Path = Path("report.html"),
    force: bool = False,
    columns: str | None = None,
    json: bool = False,
) -> None:
    """Write a report of recordings or logs as one web page that needs no network.

    It says in a sentence how much the tool vibrates; of several files, whether the others vibrate less than the first.

    Args:
        files: Recordings or logs in any format that tvist log analyze reads. The first one is what others are compared
            with.
        output: File to write.
        force: Replace an existing file.
        columns: Names of a CSV's columns if they are not RTDE's, with {} for the number of a joint or axis, and a unit
            after a colon: time=t:ms,q=joint_{}:deg,accelerometer=acc_{}:g. Also qd, pose, target_q, target_qd.
        json: Print the verdict as one JSON object.
    """
    if not files:
        raise Failure("report needs at least one recording or log: tvist log report run.mcap", code=2)
    if output.exists() and not force:
        raise Failure(f"{output} exists already: give --force to replace it, or --output")
    from tvist_lab.recordings import RecordingError
    from tvist_lab.report import recordings_page

    with told(RecordingError):
        page = recordings_page(files, typed(), columns)
    write_report(output, page)
    if json:
        print_json(
            {"files": [str(file) for file in files], "report": str(output), "verdict": list(page.verdict)}
        )
        return
    for sentence in page.verdict:
        out.print(sentence)
