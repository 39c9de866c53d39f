"""A program in real time, on a served robot that clients can reach."""

import asyncio
from collections.abc import Callable, Sequence

from tvist_controller.api.robot import Controller
from tvist_lab.programs.start import CLIENT, LEASE, start
from tvist_lab.programs.watch import ProgramWatch
from tvist_protocol.commands import KeepAlive
from tvist_protocol.programs import ProgramClosePopup
from tvist_protocol.replies import Reply
from tvist_server.config import ServeConfig
from tvist_server.ending import Ending
from tvist_server.gateways.starting import Prepare
from tvist_server.server import Server

HERE = "127.0.0.1"
"""Address of this machine's own clients."""
ATTEND = 0.05
"""Time between two calls of the function that tells people about the run [s]."""


class ProgramServer:
    """A served robot that begins with a program, and ends with it.

    Args:
        config: Configuration of one robot in real time.
        text: Text of the program.
        inputs: Inputs to set before, each as NAME=VALUE.
        ending: Shutdown by signals.
        timeout: Robot time after which the run ends although the program goes on [s].
        prepare: What takes long before the robot is made, see `Server`.

    Raises:
        StartError: The configuration is invalid.
        RecorderError: The recording cannot be written.
        GatewayError: The server cannot listen on an endpoint.
        InputError: An input is wrong.
        RefusedError: The robot refuses the program.
    """

    def __init__(
        self,
        config: ServeConfig,
        text: str,
        inputs: Sequence[str],
        ending: Ending,
        timeout: float | None,
        prepare: Prepare | None = None,
    ) -> None:
        self._ending = ending

        def observe(controller: Controller) -> ProgramWatch:
            self.watch = ProgramWatch(controller, self._close_popup, ending.request, timeout=timeout)
            return self.watch

        self.server = Server(config, observe, prepare=prepare)
        (self._robot,) = self.server.robots
        try:
            # Clients of UR's interfaces on this machine have a hand in the program, as beside one of their own.
            client = f"ur-{HERE}" if config.ur else CLIENT
            self._token = start(self._robot.request, text, inputs, client)
            self.server.share_control(HERE, self._token)
        except BaseException:
            self.server.discard()
            raise

    async def run(self, ready: Callable[[], None], attend: Callable[[ProgramWatch], None]) -> None:
        """Serve until the program has ended and the arm is at rest, or a signal comes.

        Args:
            ready: Called once the robot ticks and answers clients.
            attend: Tells people about the run; called now and then.
        """
        loop = asyncio.get_running_loop()
        serving = asyncio.ensure_future(self.server.run(ready, self._ending))
        renewed = loop.time()
        while not serving.done():
            await asyncio.wait((serving,), timeout=ATTEND)
            attend(self.watch)
            if loop.time() - renewed > LEASE / 10.0:
                renewed = loop.time()
                self._robot.reception.command(KeepAlive(token=self._token), _nothing)
        await serving
        if self.server.failure is not None:
            self.watch.end("server_failure", self.server.failure)
        elif self._ending.signal is not None:
            self.watch.end("signal", f"{self._ending.signal.name} ended the run")

    def _close_popup(self) -> None:
        def close() -> None:
            self._robot.request(ProgramClosePopup())

        self._robot.driven.post(close)


def _nothing(_: Reply) -> None:
    """Ignore the reply: if control is lost, the program ends with it."""
