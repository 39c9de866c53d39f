"""A robot in lockstep that runs the program which follows set-points, and what came of it, for the tests."""

import numpy as np
from tests.controller.robots import NoArm, Robot
from tests.controller.scripts import URSIM

from tvist_protocol.io import Registers, SetRegisters
from tvist_protocol.programs import ProgramRun
from tvist_server.moving import registers as r
from tvist_server.moving.program import program

SPEED, DECELERATION = 0.5, 4.0
RUN = 71


class Followed:
    """The program on a robot without an arm.

    Attributes:
        told: Tick and posture of each call of `servoj`.
        arrived: Tick of each package.
    """

    def __init__(self, **changes):
        self.robot = Robot(plant=NoArm(), q=URSIM, shaper="none")
        self.told, self.arrived = [], []
        guidance = self.robot.controller.programs._access.guidance
        servo = guidance.servo

        def listening(q, lookahead, gain, *, shaped):
            self.told.append((self.tick, q))
            return servo(q, lookahead, gain, shaped=shaped)

        guidance.servo = listening
        given = {"speed": SPEED, "deceleration": DECELERATION, "lookahead": 0.03, "gain": 2000.0} | changes
        self.text = program(RUN, **given)

    def start(self):
        return self.robot.send(ProgramRun, text=self.text)

    @property
    def tick(self):
        return len(self.robot.states)

    def write(self, values):
        """Write an input package."""
        self.arrived.append(self.tick)
        n, order, *doubles = values
        also = (Registers(bank="input_double", first=r.SETPOINTS, values=tuple(doubles)),)
        self.robot.send(
            SetRegisters, bank="input_int", first=r.NUMBER, values=(int(n), int(order)), also=also, token=None
        )

    def tick_(self, count=1):
        self.robot.tick(count)

    def output(self, place):
        return self.robot.controller.io().output_int_register[place]

    @property
    def targets(self):
        return np.array([state.target_q for state in self.robot.states])
