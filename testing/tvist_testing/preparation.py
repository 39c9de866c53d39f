"""What a robot goes through before a test and at chosen times of it: its program, its faults, its log.

Everything happens in the controller's thread between two ticks that simulation time alone determines, and it is in the
robot's journal. So equal tests stay equal to the last bit, and a replay of the recording has the same faults.
"""

import logging
from collections.abc import Callable

from tvist_controller.controller import Controller
from tvist_controller.instruments.report import Sink
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import Command, ReleaseControl, TakeControl
from tvist_protocol.errors import RefusedError
from tvist_protocol.programs import ProgramLoad
from tvist_protocol.replies import Accepted, Refused, Reply
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.stream import Event, State
from tvist_server.robot import ServedRobot
from tvist_testing.wanted import WantedFault, WantedRobot

CLIENT = "tvist_testing"
"""Name under which faults are injected while nobody else has control."""
log = logging.getLogger("robot")


class Preparation:
    """Prepares one robot.

    Args:
        wanted: The robot that a test wants.
    """

    def __init__(self, wanted: WantedRobot) -> None:
        self._wanted = wanted
        self._later = sorted(
            (fault for fault in wanted.faults if fault.after > 0.0), key=lambda one: one.after
        )
        self._controller: Controller | None = None
        self._post: Callable[[Callable[[], None]], None] | None = None
        self._request: Callable[[Command], Reply] | None = None

    def observe(self, controller: Controller) -> Sink:
        """Return the observer of the robot's messages; the server calls this."""
        self._controller = controller
        return _Observer(self)

    def on(self, robot: ServedRobot) -> None:
        """Do what comes before the first tick.

        Args:
            robot: The robot, whose clock has not started.

        Raises:
            RefusedError: The robot refuses its program or a fault; the message says why.
        """
        self._post, self._request = robot.driven.post, robot.request
        if self._wanted.program is not None:
            name, text = self._wanted.program
            _accepted(robot.request(ProgramLoad(name=name, text=text)))
        for fault in self._wanted.faults:
            if fault.after == 0.0:
                self._inject(fault)

    def tick(self, tick: int) -> None:
        """Inject the faults that are due after a tick; called in the controller's thread."""
        while self._later and tick * PERIOD >= self._later[0].after - 0.5 * PERIOD:
            fault = self._later.pop(0)
            assert self._post is not None
            self._post(lambda fault=fault: self._inject_or_say(fault))  # type: ignore[misc]

    def _inject_or_say(self, fault: WantedFault) -> None:
        try:
            self._inject(fault)
        except RefusedError as error:
            log.warning("the fault %s was refused: %s", fault.fault, error)

    def _inject(self, fault: WantedFault) -> None:
        assert self._controller is not None
        assert self._request is not None
        lease = self._controller.session.lease
        token, borrowed = ("", True) if lease is None else (lease.token, False)
        if borrowed:
            reply = _accepted(self._request(TakeControl(client=CLIENT, lease_s=60.0)))
            assert isinstance(reply, Accepted)
            assert reply.token is not None
            token = reply.token
        _accepted(
            self._request(
                SimulationInject(
                    token=token,
                    fault=fault.fault,
                    joint=fault.joint,
                    seconds=fault.seconds,
                    value=fault.value,
                )
            )
        )
        if borrowed:
            _accepted(self._request(ReleaseControl(token=token)))


class _Observer(Sink):
    """Writes events into the log, and lets the preparation see each tick."""

    def __init__(self, preparation: Preparation) -> None:
        self._preparation = preparation

    def event(self, event: Event) -> None:
        why = f": {event.why}" if event.why else ""
        log.info("tick %d: %s%s", event.tick, event.kind, why)

    def state(self, state: State) -> None:
        self._preparation.tick(state.tick)


def _accepted(reply: Reply) -> Reply:
    if isinstance(reply, Refused):
        raise RefusedError(reply)
    return reply
