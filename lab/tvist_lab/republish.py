"""Publish a recording on the network at its original pace, by a server that accepts no commands."""

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from threading import Thread

import msgspec

from tvist_lab.recordings import RecordingError
from tvist_lab.recordings.mcap_file import Published, RecordingFile
from tvist_protocol import keys
from tvist_protocol.codec import encode
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.recorded import TICK_NS
from tvist_protocol.replies import Refused
from tvist_protocol.stream import Event, State, Truth
from tvist_server.gateways.base import Answer, CommandIntake, Gateway, topic_of
from tvist_server.gateways.network import Network
from tvist_server.gateways.security import server_security

TICK = TICK_NS * 1e-9  # duration of a tick [s]
LEAVE = 0.6  # longest time for clients to read the remaining messages at the end [s]
REFUSAL = Refused(
    code="wrong_mode",
    where="",
    why="a recording is being played back, which takes no commands: it only publishes",
)  # answer to every command


class PlaybackIntake(CommandIntake):
    """Describes the recorded robot and refuses everything else."""

    def __init__(self, info: Info, name: str) -> None:
        self._info = msgspec.structs.replace(info, name=name, clock="realtime", control=None, stepper=None)
        self.tick = info.tick  # tick of the last state published

    def request(self, data: bytes, answer: Answer) -> None:  # noqa: ARG002  whatever it is
        """Refuse a command."""
        answer(REFUSAL)

    def info(self, answer: Callable[[Callable[[], bytes]], None]) -> None:
        """Answer with the description of the robot and the present tick."""
        answer(lambda: encode(msgspec.structs.replace(self._info, tick=self.tick)))


class Playback:
    """Publishes a recording on the endpoints `listen`, as robot `name` (default: as recorded) at `speed` times its own.

    With `loop` it repeats, with ever increasing ticks. `security` is a folder with certificates and roles;
    `insecure` allows remote connections without TLS. Raises RecordingError if the recording does not describe
    its robot, ProtocolError for a forbidden name, StartError if the robot would be reachable unintentionally,
    GatewayError if it cannot listen.
    """

    def __init__(
        self,
        content: RecordingFile,
        listen: Sequence[str],
        *,
        name: str | None = None,
        speed: float = 1.0,
        loop: bool = False,
        security: str | None = None,
        insecure: bool = False,
    ) -> None:
        if content.info is None:
            raise RecordingError(
                f"{content.path} does not describe its robot: record it with tvist serve --record"
            )
        self.name = keys.check_robot_name(name or content.robot)
        self.states = 0
        self._content, self._speed, self._loop = content, speed, loop
        endpoints, guard = server_security(listen, [self.name], security=security, insecure=insecure)
        self._intake = PlaybackIntake(content.info, self.name)
        self._network = Network(endpoints, guard, lockstep=False)
        try:
            truth = content.counts["truth"] > 0
            self._gateway: Gateway = self._network.gateway(
                self.name, self._intake, lockstep=False, truth=truth
            )
        except BaseException:
            self._network.close()
            raise

    async def run(self) -> None:
        """Publish until the recording ends, or until this is cancelled."""
        clock, began = asyncio.get_running_loop(), None
        try:
            for message in played(self._content, loop=self._loop):
                now = clock.time()
                if isinstance(message, State):
                    if began is None:
                        began = now, message.tick
                    due = began[0] + (message.tick - began[1]) * TICK / self._speed
                    if due > now:
                        await asyncio.sleep(due - now)
                    elif self.states % 50 == 0:
                        await asyncio.sleep(0)  # playback is late, but must notice if it is cancelled
                    self.states += 1
                    self._intake.tick = message.tick
                self._gateway.publish(topic_of(message), message, encode(message))
        finally:
            # In a thread, since a client that has stopped reading may delay this for ten seconds.
            leaving = Thread(target=self._leave, name="tvist-leave", daemon=True)
            leaving.start()
            leaving.join(LEAVE)

    def _leave(self) -> None:
        with suppress(Exception):
            self._network.close()


def played(content: RecordingFile, *, loop: bool = False) -> Iterator[Published]:
    """Yield the messages of a recording in order; with `loop` endlessly, with ticks and times that continue."""
    tick = content.recording["tick"]
    length = int(tick[-1] - tick[0]) + 1
    shift = 0
    while True:
        for message in content.again(State, Truth, Event, Io):
            yield _shifted(message, shift) if shift else message
        if not loop:
            return
        shift += length


def _shifted(message: Published, ticks: int) -> Published:
    if isinstance(message, State | Truth):
        time = message.timestamp + ticks * TICK
        return msgspec.structs.replace(message, tick=message.tick + ticks, timestamp=time)
    return msgspec.structs.replace(message, tick=message.tick + ticks)
