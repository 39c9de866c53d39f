"""`tvist log advise`: find in logs what rings, and recommend a shaper."""

from pathlib import Path

from tvist_cli.failure import Failure, Misuse
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import out, print_json, progress, say, table, typed, write_report


def advise(*files: Path, output: Path | None = None, logs: LogOptions = AS_IT_IS, json: bool = False) -> None:
    """Find in a robot's logs what rings after its motions, predict what each shaper would leave, and recommend one.

    The prediction convolves the recorded acceleration with each shaper. Motions that were made with a shaper are
    treated separately if the log shows it. Record each motion two or three times, with a second of rest after each.

    Args:
        files: Read these recordings or logs of one robot, in any format that tvist log analyze reads.
        output: Write the result to this web page, one file with the two figures that show the reasons; an
            existing file is replaced.
        logs: How to read logs.
        json: Print one JSON object with all figures of each shaper and motion.
    """
    if not files:
        raise Misuse("advise needs at least one recording or log: tvist log advise run.mcap")
    from tvist_lab.advice import advise as advised
    from tvist_lab.advice import as_dict, command, verdict
    from tvist_lab.metrics import MeasuredRecording
    from tvist_lab.report.of_advice import MODES, OPTIONS, advice_page, modes_rows, option_rows

    measured = []
    with progress(len(files), "logs") as bar:
        for recording in logs.read(*files):
            measured.append(MeasuredRecording.of(recording))
            bar()
    joints = sorted({log.recording.joints for log in measured})
    if len(joints) > 1:
        have = " and ".join(map(str, joints))
        raise Failure(f"the logs have {have} joints: give logs of one robot")
    notes = [
        f"{file}: {note}" for file, log in zip(files, measured, strict=True) for note in log.recording.notes
    ]
    advice = advised(measured)
    notes += [f"{files[place]}, motion {number}: {why}" for place, number, why in advice.refused]
    for note in notes:
        say(note)
    if output is not None:
        write_report(output, advice_page(advice, measured, files, typed()))
    if json:
        print_json({"files": [str(file) for file in files], **as_dict(advice, measured)})
        return
    for title, heads, rows in (
        ("what rings", MODES, modes_rows(advice)),
        ("what shapers would leave", OPTIONS, option_rows(advice)),
    ):
        if rows:
            table(title, [head.replace("\n", " ") for head in heads], rows)
    for sentence in (*verdict(advice, measured), *command(advice, measured)):
        out.print(sentence)
