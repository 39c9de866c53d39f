"""`tvist record`: record a served robot from outside."""

import asyncio
from pathlib import Path

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import print_json, say


def record(
    file: Path,
    *,
    endpoint: str = "tcp/127.0.0.1:7447",
    name: str = "ur5e",
    security: Path | None = None,
    seconds: float | None = None,
    json: bool = False,
) -> None:
    """Record states, events and, where it is told, truth of a served robot as MCAP, until Control+C.

    What only the server knows, the commands, is not in it: `tvist replay` needs a recording of `tvist serve --record`.

    Args:
        file: MCAP file to write.
        endpoint: Zenoh endpoint of the robot.
        name: Its name.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        seconds: End by itself this time after the first state.
        json: Print one JSON object at the end.
    """
    if seconds is not None and seconds <= 0.0:
        raise Failure(f"seconds is {seconds:g}: must be more than 0", code=2)
    from tvist_client.robot import Robot
    from tvist_server.ending import Ending
    from tvist_server.recording import Recorder, RecordingError

    ending = Ending()

    async def run() -> tuple[Path | None, int, int]:
        ticks: list[int] = []
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.hear(lambda: loop.call_soon_threadsafe(ended.set))
        async with await Robot.connect(endpoint, name, security=security) as robot:
            with Recorder(file, await robot.info(), {}, on_error=say, on_moved=say) as recorder:
                robot.on_state(recorder.state)
                robot.on_state(lambda state: ticks.append(state.tick))
                robot.on_event(recorder.event)
                robot.on_truth(recorder.truth)
                say(f"recording {name} into {file}; Control+C ends it")
                end = asyncio.ensure_future(ended.wait())
                # The time that was asked for begins with the first state; in lockstep it may be a second away.
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

    with told(RecordingError):
        place, states, lost = asyncio.run(run())
    ending.close()
    if json:
        print_json({"file": place and str(place), "states": states, "lost": lost})
    else:
        say(f"{states} states recorded, {lost} lost")
    if ending.interrupted:
        said = f"{states * 0.002:.1f} s recorded into {file}"
        if seconds is not None:  # without it, Control+C is how a recording ends
            raise interrupted(said)
        say(f"interrupted: {said}")
