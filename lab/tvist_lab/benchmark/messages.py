"""Valid and invalid messages of every type and size, to put load on a robot."""

import random
from collections.abc import Callable
from typing import Any

import msgspec

from tvist_protocol import commands as c
from tvist_protocol import kinematics as k
from tvist_protocol import motions as m
from tvist_protocol.calibration import Calibration
from tvist_protocol.codec import MAX_BYTES, encode
from tvist_protocol.io import SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.motions import ServoJ, SpeedJ, SpeedL, StopJ, StopL
from tvist_protocol.programs import ProgramLoad, ProgramPlay, ProgramStop
from tvist_protocol.simulation import SimulationInject, SimulationStep
from tvist_protocol.values import Pose

TOOL = (-0.49, -0.13, 0.49, 2.22, 2.22, 0.0)
"""A pose of the tool within reach [m, rad]."""
POSE = (1.57, -1.57, 1.57, -1.57, -1.57, 0.0)
STRANGER = "none of ours"
"""A token that belongs to no lease."""
NEAR = 0.2
"""Distance of targets from the pose [rad]."""
FILTERS = ("zv", "zvd", "ei", "none", "auto", "nonsense")


class Messages:
    """A source of messages; half of them have the token of the lease, half have an invalid token.

    Args:
        seed: Seed of the random choice.
        token: Token of the lease.
        calibration: A calibration that fits the robot.
    """

    def __init__(self, seed: int, token: str, calibration: Calibration) -> None:
        self._random = random.Random(seed)  # noqa: S311  no secret
        self._token = token
        self._calibration = msgspec.to_builtins(calibration)

    def next(self) -> bytes:
        """Return the next message."""
        make: Callable[[], bytes] = self._random.choice((self._sound, self._sound, self._unsound, self._long))
        return make()

    def _sound(self) -> bytes:
        """Return a valid command, which the robot may still refuse in its present state."""
        return encode(self._random.choice(self._commands()))

    def _commands(self) -> list[c.Command]:
        chance, token = self._random, self._random.choice((self._token, STRANGER))
        q = tuple(angle + chance.uniform(-NEAR, NEAR) for angle in POSE)
        mass = chance.uniform(0.0, 6.0)
        via, pose = self._tool_pose(), self._tool_pose()
        line = m.LineSegment(pose=via, blend=chance.uniform(0.0, 0.1))
        return [
            c.TakeControl(client=f"stranger {chance.randrange(9)}"),
            c.KeepAlive(token=token),
            c.HandOver(token=STRANGER, client="stranger"),
            c.ReleaseControl(token=STRANGER),
            c.MoveJ(token=token, q=q),
            ServoJ(token=token, q=q),
            SpeedJ(token=token, qd=(chance.uniform(-0.1, 0.1),) * len(q)),
            SpeedL(token=token, xd=(0.0, 0.0, chance.uniform(-0.1, 0.1), 0.0, 0.0, 0.0)),
            StopJ(token=token, acceleration=chance.uniform(1.0, 30.0)),
            StopL(token=token, acceleration=chance.uniform(1.0, 30.0)),
            c.ServoStart(token=token),
            c.ServoStop(token=token),
            c.Stop(),
            c.Stop(token=token, deceleration=chance.uniform(1.0, 30.0)),
            c.Pause(token=token),
            c.Resume(token=token),
            c.SetSpeed(token=token, fraction=chance.uniform(0.1, 1.0)),
            c.SetShaper(token=token, name=chance.choice(FILTERS)),
            c.SetEstimator(token=token, name="fixed", f_d=(8.0,), zeta=(0.1,)),
            c.SetPayload(token=token, mass=mass, com=(0.0, 0.0, 0.04), inertia=(0.01, 0, 0, 0.01, 0, 0.01)),
            SetIo(token=token, digital_output_mask=255, digital_outputs=chance.randrange(256)),
            SetRegisters(bank="input_double", values=tuple(chance.uniform(-1.0, 1.0) for _ in range(24))),
            ProgramLoad(name=chance.choice(("paper.urp", "nothing.urp"))),
            ProgramPlay(token=token),
            ProgramStop(token=token),
            SetTcp(token=token, offset=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)),
            m.MoveL(token=token, pose=pose),
            m.MoveC(token=token, via=via, pose=pose),
            m.MovePath(token=token, segments=(line, m.JointSegment(q=q), m.ArcSegment(via=via, pose=pose))),
            k.InverseKinematics(pose=pose),
            k.ForwardKinematics(q=q),
            SimulationSetInputs(token=token, digital_input_mask=255, digital_inputs=chance.randrange(256)),
            c.PowerOn(token=token),
            c.UnlockProtectiveStop(token=token),
            SimulationStep(token=token, ticks=10),
            SimulationInject(token=token, fault="nonsense"),
        ]

    def _tool_pose(self) -> Pose:
        """Return a pose of the tool near `TOOL`."""
        x, y, z, *turn = (value + self._random.uniform(-NEAR, NEAR) for value in TOOL)
        rx, ry, rz = turn
        return x, y, z, rx, ry, rz

    def _unsound(self) -> bytes:
        """Return bytes that are not a command: truncated, modified or random."""
        chance, data = self._random, bytearray(self._sound())
        match chance.randrange(3):
            case 0:
                return bytes(data[: chance.randrange(len(data))])
            case 1:
                data[chance.randrange(len(data))] = chance.randrange(256)
                return bytes(data)
        return chance.randbytes(self._size())

    def _long(self) -> bytes:
        """Return a command that is longer than necessary."""
        chance, size = self._random, self._size()
        token = chance.choice((self._token, STRANGER))
        junk: Any = chance.choice(([{}], [1], [1.5], ["ab"], [[0]]))
        junk *= max(size // len(msgspec.msgpack.encode(junk)), 1)
        estimator = {"type": "set_estimator", "token": token, "name": "polynomial"}
        setpoints = [{"sequence": number, "q": POSE} for number in range(min(size // 70 + 1, 1000))]
        longs: list[dict[str, Any]] = [
            {**estimator, "calibration": {"a": junk}},
            {**estimator, "calibration": {**self._calibration, "robot": "x" * min(size, 60)}},
            {**estimator, "calibration": self._calibration},
            {"type": "simulation.step", "token": token, "ticks": 1000, "setpoints": setpoints},
            {"type": "move_j", "token": token, "q": junk},
            {"type": "stop", "why": junk},
            {"type": chance.choice(("stop", "nonsense", "take_control")), "client": "x" * size},
        ]
        return msgspec.msgpack.encode(chance.choice(longs))[:MAX_BYTES]

    def _size(self) -> int:
        """Size from a few bytes to the largest permitted one, with all orders of magnitude equally likely."""
        return int(2.0 ** self._random.uniform(4.0, 17.99))
