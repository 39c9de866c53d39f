"""A program in this process, as fast as it computes, without network."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path

from tvist_controller.api.line import Setup
from tvist_controller.api.robot import Controller, Host, Sink, experience_of, info_of
from tvist_lab.programs.start import start
from tvist_lab.programs.watch import ProgramWatch
from tvist_plant.foreign import check_unpaced
from tvist_protocol.codec import encode
from tvist_protocol.commands import Command
from tvist_protocol.programs import ProgramClosePopup
from tvist_server.option_values import StartError
from tvist_server.recording.recorder import Recorder

ATTEND_EVERY = 50
"""Ticks between two calls of the function that tells people about the run."""


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
    """Run a program until it has ended and the arm is at rest.

    Its states equal those of a run in real time, to the last bit.

    Args:
        setup: Setup of the robot.
        text: Text of the program.
        inputs: Inputs to set before, each as NAME=VALUE.
        record: MCAP file to record into.
        timeout: Robot time after which the run ends although the program goes on [s].
        attend: Tells people about the run; called when the program has said something, and now and then.
        on_record_error: Called once, from another thread, with a sentence when the recording has stopped by itself.

    Raises:
        InputError: An input is wrong.
        RefusedError: The robot refuses the program.
        RecorderError: The recording cannot be written.
        StartError: The setup is invalid, or its plant cannot be made or gives the tick.
    """
    try:
        controller = Controller(setup)
        check_unpaced(controller.cycle.plant)
    except ValueError as error:
        raise StartError(str(error)) from error
    waiting: list[Command] = []
    watch = ProgramWatch(
        controller, lambda: waiting.append(ProgramClosePopup()), _nothing, timeout=timeout, alone=True
    )
    sinks: list[Sink] = [watch]
    with ExitStack() as ends:
        if record is not None:
            start_of_it = controller.setup.to_builtins()
            recorder = Recorder(record, info_of(controller), start_of_it, wait=True, on_error=on_record_error)
            sinks.insert(0, ends.enter_context(recorder))
        host = Host(controller, *sinks, experience=experience_of(controller.setup))
        try:
            start(lambda command: host.request(encode(command)), text, inputs)
        except BaseException:
            if record is not None:
                recorder.discard()
            raise
        try:
            while not watch.over:
                while waiting:
                    host.request(encode(waiting.pop()))
                host.tick()
                if watch.news or watch.tick % ATTEND_EVERY == 0:
                    attend(watch)
        except KeyboardInterrupt:
            watch.end("signal", "SIGINT ended the run")
    return watch


def _nothing() -> None:
    """Do nothing, since the loop checks after each tick whether the run is over."""
