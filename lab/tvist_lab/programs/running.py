"""Run a program on a robot from tick 0, so that equal programs give states that are equal to the last bit."""

import asyncio
import re
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from tvist_controller.api.line import Setup
from tvist_controller.api.robot import Controller, Host, Sink, info_of, payload_learning_of
from tvist_lab.programs.watch import ProgramWatch
from tvist_plant.foreign import check_unpaced
from tvist_protocol.codec import encode
from tvist_protocol.commands import Command, KeepAlive, TakeControl
from tvist_protocol.errors import RefusedError
from tvist_protocol.io import Bank, SetRegisters, SimulationSetInputs
from tvist_protocol.programs import ProgramClosePopup, ProgramRun
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_server.config import ServeConfig
from tvist_server.gateways.base import Prepare
from tvist_server.option_values import StartError
from tvist_server.recording.recorder import Recorder
from tvist_server.server import Server
from tvist_server.shutdown import Shutdown

CLIENT: Final = "tvist run"
LEASE: Final = 3600.0  # time without renewal after which a run loses control [s]
HERE: Final = "127.0.0.1"
ATTEND_TICKS, ATTEND_S = 50, 0.05  # ticks, or time [s], between two calls of `attend`
LEAST, MOST = -(2**31), 2**31 - 1
_INPUT = re.compile(r"(?P<name>digital_input|input_(?P<kind>bit|int|double)_register)_(?P<number>\d{1,3})")
_BITS = {"0": False, "false": False, "off": False, "1": True, "true": True, "on": True}


class InputError(ValueError):
    """An input is not given as NAME=VALUE; the message tells what is wrong."""


def run_in_lockstep(
    setup: Setup,
    text: str,
    inputs: Sequence[str],
    *,
    record: Path | None = None,
    timeout: float | None = None,
    attend: Callable[[ProgramWatch], None],
    on_record_error: Callable[[str], None],
) -> ProgramWatch:
    """Run a program in this process, without network, until the program has ended and the arm is at rest.

    Its states equal those of a run in real time, to the last bit. `inputs` are NAME=VALUE; `timeout` is robot
    time [s]; `attend` is called after new messages and regularly; `on_record_error` is called from another
    thread. Raises InputError for a wrong input, RefusedError if the robot refuses the program, RecorderError
    if the recording cannot be written, StartError if the setup is invalid or its plant unsuitable.
    """
    try:
        controller = Controller(setup)
        check_unpaced(controller.cycle.plant)
    except ValueError as error:
        raise StartError(str(error)) from error
    waiting: list[Command] = []
    watch = ProgramWatch(
        controller, lambda: waiting.append(ProgramClosePopup()), lambda: None, timeout=timeout, alone=True
    )
    sinks: list[Sink] = [watch]
    with ExitStack() as ends:
        if record is not None:
            start = controller.setup.to_builtins()
            recorder = Recorder(record, info_of(controller), start, wait=True, on_error=on_record_error)
            sinks.insert(0, ends.enter_context(recorder))
        host = Host(controller, *sinks, learning=payload_learning_of(controller.setup))
        try:
            _start(lambda command: host.request(encode(command)), text, inputs)
        except BaseException:
            if record is not None:
                recorder.discard()
            raise
        try:
            while not watch.over:
                while waiting:
                    host.request(encode(waiting.pop()))
                host.tick()
                if watch.news or watch.tick % ATTEND_TICKS == 0:
                    attend(watch)
        except KeyboardInterrupt:
            watch.end("signal", "SIGINT ended the run")
    return watch


class ProgramServer:
    """A robot served in real time that starts with a program, and ends with it.

    Arguments are those of `run_in_lockstep`, the shutdown by signals, and the preparation of `Server`. Raises
    StartError, RecorderError, InputError or RefusedError likewise, and GatewayError if the server cannot listen.
    """

    watch: ProgramWatch

    def __init__(
        self,
        config: ServeConfig,
        text: str,
        inputs: Sequence[str],
        ending: Shutdown,
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
            # Local clients of UR's interfaces share control of the program, as if one of them had started it.
            self._token = _start(self._robot.request, text, inputs, f"ur-{HERE}" if config.ur else CLIENT)
            self.server.share_control(HERE, self._token)
        except BaseException:
            self.server.discard()
            raise

    async def run(self, ready: Callable[[], None], attend: Callable[[ProgramWatch], None]) -> None:
        """Serve until the program has ended and the arm is at rest, or a signal comes.

        `ready` is called once the robot ticks and answers clients, `attend` regularly.
        """
        loop = asyncio.get_running_loop()
        serving = asyncio.ensure_future(self.server.run(ready, self._ending))
        renewed = loop.time()
        while not serving.done():
            await asyncio.wait((serving,), timeout=ATTEND_S)
            attend(self.watch)
            if loop.time() - renewed > LEASE / 10.0:
                renewed = loop.time()
                # The reply does not matter: if control is lost, the program ends anyway.
                self._robot.intake.command(KeepAlive(token=self._token), lambda _: None)
        await serving
        if self.server.failure is not None:
            self.watch.end("server_failure", self.server.failure)
        elif self._ending.signal is not None:
            self.watch.end("signal", f"{self._ending.signal.name} ended the run")

    def _close_popup(self) -> None:
        self._robot.driven.post(lambda: self._robot.request(ProgramClosePopup()))


def _start(
    request: Callable[[Command], Reply], text: str, inputs: Sequence[str], client: str = CLIENT
) -> str:
    """Take control, set inputs and start a program; return the token of the lease."""
    reply = request(TakeControl(client=client, lease_s=LEASE))
    assert isinstance(reply, Accepted)
    assert reply.token is not None
    for one in inputs:
        answer = request(input_command(one, reply.token))
        if isinstance(answer, Refused):
            raise InputError(f"input is {one!r}: {answer.why}")
    answer = request(ProgramRun(token=reply.token, text=text))
    if isinstance(answer, Refused):
        raise RefusedError(answer)
    return reply.token


def input_command(text: str, token: str) -> SetRegisters | SimulationSetInputs:
    """Return the command that sets an input, given as NAME=VALUE."""
    name, equals, value = (part.strip() for part in text.partition("="))
    found = _INPUT.fullmatch(name)
    if found is None or not equals:
        raise InputError(
            f"input is {text!r}: must be NAME=VALUE, where NAME is digital_input_N, input_bit_register_N, "
            "input_int_register_N or input_double_register_N"
        )
    number = int(found["number"])
    bank, convert, requirement = _BANKS[found["kind"] or "bit"]
    try:
        converted = convert(value.lower())
    except (KeyError, ValueError):
        raise InputError(f"input is {text!r}: the value must be {requirement}") from None
    if found["kind"] is not None:
        return SetRegisters(token=token, bank=bank, values=(converted,), first=number)
    if number > 17:
        raise InputError(f"input is {text!r}: N of digital_input_N must be from 0 to 17")
    bit = 1 << number
    return SimulationSetInputs(token=token, digital_input_mask=bit, digital_inputs=bit if converted else 0)


def _whole(value: str) -> int:
    number = int(value)
    if not LEAST <= number <= MOST:
        raise ValueError
    return number


_BANKS: dict[str, tuple[Bank, Callable[[str], float], str]] = {
    "bit": ("input_bit", _BITS.__getitem__, "0 or 1"),
    "int": ("input_int", _whole, f"a whole number from {LEAST} to {MOST}"),
    "double": ("input_double", float, "a number"),
}  # bank of registers, conversion of a value, and what the value must be, by kind
