"""`tvist log record`: record a served robot over the network."""

import asyncio
from pathlib import Path
from signal import SIGINT

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, check_range, failing_on, interrupted
from tvist_cli.output import print_json, say


def record(
    file: Path,
    *,
    at: Connection = LOCAL,
    seconds: float | None = None,
    keep: str | None = None,
    json: bool = False,
) -> None:
    """Record what a served robot publishes as MCAP until Control+C: states, events, truth, inputs and outputs.

    Commands are not recorded, since only the server knows them: `tvist log replay` needs a file from `tvist
    serve --record`.

    Args:
        file: Write to this MCAP file.
        at: Where the robot is.
        seconds: Stop this many seconds after the first state.
        keep: Keep only the last 90s, 10min or 2h, and at most a quarter more [all]. FILE then names several
            files, as with tvist serve --keep.
        json: Print one JSON object at the end.
    """
    check_range("seconds", seconds, 0.0, above=True)
    from tvist_server.option_values import ticks_of
    from tvist_server.recording.recorder import Recorder
    from tvist_server.shutdown import Shutdown

    with failing_on(ValueError, exit_code=2):
        kept = None if keep is None else ticks_of(keep, "keep")
    ending = Shutdown()

    async def run() -> tuple[Path | None, int, int]:
        ticks: list[int] = []
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.on_request(lambda: loop.call_soon_threadsafe(ended.set))
        async with await at.robot() as robot:
            info = await robot.info()
            with Recorder(file, info, {}, keep=kept, on_error=say, on_moved=say) as recorder:
                robot.on_state(recorder.state)
                robot.on_state(lambda state: ticks.append(state.tick))
                robot.on_event(recorder.event)
                robot.on_truth(recorder.truth)
                robot.on_io(recorder.io)
                say(f"recording {info.name} into {file}; press Control+C to stop")
                end = asyncio.ensure_future(ended.wait())
                # The requested time starts with the first state, which may come a second later in lockstep.
                first = asyncio.ensure_future(robot.state())
                await asyncio.wait((end, first), return_when=asyncio.FIRST_COMPLETED)
                if first.done():
                    first.result()
                    await asyncio.wait((end,), timeout=seconds)
                for task in (end, first):
                    task.cancel()
            if recorder.error is not None:
                raise Failure(recorder.error)
            missing = ticks[-1] - ticks[0] + 1 - len(ticks) if ticks else 0
            return recorder.place, len(ticks), missing + recorder.dropped

    place, states, lost = asyncio.run(run())
    ending.close()
    if json:
        print_json({"file": place and str(place), "states": states, "lost": lost})
    else:
        say(f"{states} states recorded, {lost} lost")
    if ending.signal == SIGINT:
        said = f"{states * 0.002:.1f} s recorded into {file}"
        if seconds is not None:  # without `seconds`, Control+C ends the recording regularly
            raise interrupted(said)
        say(f"interrupted: {said}")
