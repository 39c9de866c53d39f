"""A robot that follows positions as UR's client library has it follow them, tick by tick and without a network."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import Setup
from tvist_controller.api.robot import Controller
from tvist_lab.programs.start import start
from tvist_lab.recordings import Floats
from tvist_plant.plant import Plant
from tvist_protocol.io import SetRegisters
from tvist_protocol.replies import Done

LOOKAHEAD, GAIN = 0.03, 2000.0
"""Arguments of `servoj` in the program of UR's client library."""
PROGRAM = f"""
def follow():
  wanted = get_target_joint_positions()

  thread servo():
    while True:
      servoj(wanted, t=get_steptime(), lookahead_time={LOOKAHEAD:g}, gain={GAIN:g})
    end
  end

  def received():
    q = get_target_joint_positions()
    i = 0
    while i < get_list_length(q):
      q[i] = read_input_float_register(i)
      i = i + 1
    end
    return q
  end

  wanted = received()
  handle = run servo()
  while True:
    wanted = received()
    sync()
  end
end
"""
"""What the library's program does in its servo mode, with registers in place of the socket: one thread takes the
positions that arrive, another passes the latest ones to `servoj`.

The library's own also extrapolates in ticks in which nothing arrives, which does not happen here. Its critical sections
are left out, since they change nothing.
"""
BEFORE = 5
"""Ticks at rest before the first position is sent."""


class TrackingError(Exception):
    """A robot does not follow positions to their end; the message says why."""


@dataclass(frozen=True)
class Followed:
    """What a robot did."""

    actual: Floats
    """Measured joint positions at the ticks of the wanted ones, shape (T, n) [rad]."""
    mean_delay: float
    """Mean delay of the filter that shapes the motion, at its end; 0 if none does [s]."""


def follow(setup: Setup, wanted: Floats, plant: Plant | None = None) -> Followed:
    """Let a robot follow positions.

    After each tick, the client compares the measured positions with those wanted now, and sends those wanted a tick
    later, as `joint_trajectory_controller` does. They arrive in time for the next tick. Each tick that a network
    needs on top of that would add 2 ms to the lag.

    Args:
        setup: Setup of the robot, at rest at the first position.
        wanted: Wanted positions, shape (T, n) [rad].
        plant: Plant to control; None for the flexible arm of the setup.

    Raises:
        TrackingError: A stop, or an error of the program, ended it.
    """
    controller = Controller(setup, plant)
    token = ""

    def send(q: Floats) -> None:
        reply = controller.receive(SetRegisters(token=token, bank="input_double", values=tuple(q.tolist())))
        assert isinstance(reply, Done), reply

    inputs = [f"input_double_register_{number}={q!r}" for number, q in enumerate(wanted[0].tolist())]
    token = start(controller.receive, PROGRAM, inputs, "tvist study tracking")
    for _ in range(BEFORE):
        _tick(controller)
    actual = np.empty_like(wanted)
    actual[0] = controller.latest.actual_q
    for tick in range(1, len(wanted)):
        send(wanted[tick])
        _tick(controller)
        actual[tick] = controller.latest.actual_q
    return Followed(actual, controller.cycle.line.filter.tvist.mean_delay if setup.shape_servo else 0.0)


def _tick(controller: Controller) -> None:
    _, events = controller.tick()
    if controller.programs.state != "PLAYING":
        whys = [event.why for event in events if event.why is not None]
        raise TrackingError("; ".join(whys) or "the program has ended")
