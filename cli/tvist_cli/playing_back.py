"""`tvist log replay --publish`: put a recording back on the network."""

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.output import print_json, say


def publish_recording(
    file: Path,
    *,
    listen: Sequence[str],
    name: str | None,
    speed: float,
    loop: bool,
    security: str | None,
    insecure: bool,
    json: bool,
) -> None:
    """Publish a recording until its end, Control+C or another signal; see `tvist_lab.republish.Playback`.

    Raises:
        Failure: The file cannot be read, or the server cannot listen.
    """
    if not 0.01 <= speed <= 100.0:
        raise Failure(f"speed is {speed:g}: must be 0.01 to 100", code=2)
    from tvist_lab.recordings import RecordingError
    from tvist_lab.recordings.mcap_file import read
    from tvist_lab.republish import Playback
    from tvist_server.ending import Ending
    from tvist_server.gateways.base import GatewayError
    from tvist_server.gateways.exposure import ExposureError

    with told(RecordingError):
        content = read(file)
    if content.note:
        say(content.note)
    ending = Ending()

    async def run() -> Playback:
        playback = Playback(
            content, listen, name=name, speed=speed, loop=loop, security=security, insecure=insecure
        )
        duration = content.recording.time[-1] - content.recording.time[0]
        how = ", again and again" if loop else ""
        say(
            f"{playback.name} listens on {', '.join(listen)}: {duration / speed:.1f} s of {file} are played back{how}. "
            "Press Control+C to stop."
        )
        playing = asyncio.ensure_future(playback.run())
        clock = asyncio.get_running_loop()
        ending.hear(lambda: clock.call_soon_threadsafe(playing.cancel))
        with suppress(asyncio.CancelledError):
            await playing
        return playback

    with told(ExposureError, code=2), told(RecordingError, GatewayError):
        playback = asyncio.run(run())
    ending.close()
    if json:
        print_json({"file": str(file), "name": playback.name, "states": playback.states})
    else:
        say(f"{playback.states} states published")
