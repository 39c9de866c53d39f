"""`tvist replay`: run a recording's commands again and compare."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import out, print_json, say
from tvist_cli.shapers_of import load_given


def replay(
    file: Path, output: Path | None = None, *, shaper: list[str] | None = None, json: bool = False
) -> None:
    """Run a recording's messages again on a new robot, without a clock, and compare every state bit by bit.

    Args:
        file: MCAP file that `tvist serve --record` wrote.
        output: MCAP file to write the second run to.
        shaper: FILE.py:NAME, repeatable: your own shaper that the robot was served with. A recording names the file,
            but replay runs it only if it is given here.
        json: Print one JSON object.
    """
    from tvist_lab.recordings import RecordingError
    from tvist_lab.recordings.mcap_file import read
    from tvist_lab.replay import ReplayError, replay_file
    from tvist_server.recording import RecorderError

    own = [load_given(place) for place in shaper or []]
    with told(RecordingError, ReplayError, RecorderError, ValueError):
        content = read(file)
        again = replay_file(content, output, own)
    for note in again.notes:
        say(note)
    if json:
        print_json(
            {"file": str(file), "ticks": len(again.states), "equal": again.first_difference is None,
             "first_difference": again.first_difference}
        )  # fmt: skip
    elif again.first_difference is None:
        out.print(f"{file}: {len(again.states)} ticks replayed, every state equal to the last bit")
    if again.first_difference is not None:
        raise Failure(f"{file}: the second run differs: {again.first_difference}")
