"""`tvist log replay`: run a recording's commands again and compare, or publish the recording."""

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from tvist_cli.compiling import compile_if_new
from tvist_cli.failure import Failure, Misuse, check_range, failing_on
from tvist_cli.output import print_json, print_lines, say
from tvist_cli.shapers_of import load_given

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"  # endpoint on which a recording is published


def replay(
    file: Path,
    output: Path | None = None,
    *,
    shaper: list[str] | None = None,
    plant: str | None = None,
    publish: bool = False,
    listen: list[str] | None = None,
    name: str | None = None,
    speed: float | None = None,
    loop: bool = False,
    security: str | None = None,
    insecure: bool = False,
    json: bool = False,
) -> None:
    """Run a recording's messages again on a new robot, without a clock, and compare every state bit by bit.

    With --publish, the recording itself is published instead, for programs that watch or record a robot.

    Args:
        file: Read this MCAP file of `tvist serve --record`; with --publish also one of `tvist log record`.
        output: Write the second run to this MCAP file.
        shaper: Allow this shaper of your own, FILE.py:NAME, repeatable. A recording names the file of the
            shaper it was made with, but replay executes that file only if you name it here.
        plant: Use the arm that the robot was served with: FILE.py:NAME, or the name of an installed plant. An
            arm that is not simulated cannot be replayed.
        publish: Publish the recording at its own time and refuse all commands of clients.
        listen: With --publish, listen on this Zenoh endpoint, repeatable [tcp/127.0.0.1:7447].
        name: With --publish, give the robot this name on the network [that of the recording].
        speed: With --publish, play at this multiple of the recording's speed [1].
        loop: With --publish, start again at the end of the recording.
        security: With --publish, use this folder made by tvist keys, as tvist serve does.
        insecure: With --publish, accept remote connections without TLS and do not authenticate clients.
        json: Print one JSON object.
    """
    of_publishing = {
        "--listen": listen, "--name": name, "--speed": speed, "--loop": loop or None, "--security": security,
        "--insecure": insecure or None,
    }  # fmt: skip
    of_computing = {"the output": output, "--shaper": shaper, "--plant": plant}
    for option, given in (of_computing if publish else of_publishing).items():
        if given is not None:
            why = f"--publish computes nothing: leave out {option}"
            raise Misuse(why if publish else f"{option} needs --publish: give both or neither")
    if publish:
        _publish(
            file, listen=listen or [DEFAULT_ENDPOINT], name=name, speed=1.0 if speed is None else speed, loop=loop,
            security=security, insecure=insecure, json=json,
        )  # fmt: skip
    else:
        _run_again(file, output, shaper or [], plant, json=json)


def _run_again(file: Path, output: Path | None, shaper: list[str], plant: str | None, *, json: bool) -> None:
    from tvist_controller.sources.own_files import OwnFileError
    from tvist_controller.sources.own_plants import load_plant
    from tvist_lab.recordings.mcap_file import read_checked
    from tvist_lab.replay import replay_file

    own = [load_given(place) for place in shaper]
    with failing_on(OwnFileError, exit_code=2):
        arm = None if plant is None else load_plant(plant)
    with failing_on(ValueError):
        content = read_checked(file)
        compile_if_new()
        again = replay_file(content, output, own, arm)
    for note in again.notes:
        say(note)
    ticks, differs = len(again.states), again.first_difference
    result = {"file": str(file), "ticks": ticks, "equal": differs is None, "first_difference": differs}
    equal = [f"{file}: {ticks} ticks replayed, every state equal to the last bit"]
    print_lines(result, equal if differs is None else [], json=json)
    if differs is not None:
        raise Failure(f"{file}: the second run differs: {differs}")


def _publish(
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
    """Publish a recording until its end or a signal; raise Failure if it cannot be read or the server cannot listen."""
    check_range("speed", speed, 0.01, 100.0)
    from tvist_lab.recordings.mcap_file import read_checked
    from tvist_lab.republish import Playback
    from tvist_server.shutdown import Shutdown

    content = read_checked(file)
    if content.note:
        say(content.note)
    ending = Shutdown()

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
        ending.on_request(lambda: clock.call_soon_threadsafe(playing.cancel))
        with suppress(asyncio.CancelledError):
            await playing
        return playback

    playback = asyncio.run(run())
    ending.close()
    if json:
        print_json({"file": str(file), "name": playback.name, "states": playback.states})
    else:
        say(f"{playback.states} states published")
