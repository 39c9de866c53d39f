"""One tick of a robot as UR's interfaces report it, with RTDE's names."""

from collections.abc import Iterator
from functools import cached_property

from tvist_controller.instruments.motors import Meters, joint_ratings
from tvist_controller.instruments.reading import POWERED, Reading
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.variables import VARIABLES, Read, entry
from tvist_controller.instruments.wrench import RUNNING
from tvist_plant.description import RobotDescription
from tvist_protocol.io import BITS, NUMBERS, Io
from tvist_protocol.stream import State


def _registers() -> Iterator[tuple[str, Read]]:
    def bit(bank: str, number: int) -> Read:
        return lambda r: bool(getattr(r.io, bank)[number // 32] >> number % 32 & 1)

    for bank in ("input", "output"):
        yield from ((f"{bank}_bit_registers{bits}", entry(f"{bank}_bit_register", number))
                    for number, bits in enumerate(("0_to_31", "32_to_63")))  # fmt: skip
        yield from ((f"{bank}_bit_register_{k}", bit(f"{bank}_bit_register", k)) for k in range(BITS))
        for kind in ("int", "double"):
            name = f"{bank}_{kind}_register"
            yield from ((f"{name}_{k}", entry(name, k)) for k in range(NUMBERS))


READERS: dict[str, Read] = {row.name: row.read for row in VARIABLES.values()} | dict(_registers())
"""Function that reads each variable and register, by RTDE's name."""


class Snapshot(Reading):
    """Variables and registers as attributes named as in RTDE: `actual_q`, `input_int_register_7`."""


for _name, _read in READERS.items():
    _once = cached_property(_read)
    _once.__set_name__(Snapshot, _name)
    setattr(Snapshot, _name, _once)


class Instruments:
    """Reads a robot's values tick by tick; skipped ticks make temperatures and energies less accurate."""

    def __init__(self, description: RobotDescription) -> None:
        self._rigid = RigidBody(description)
        self._ratings = joint_ratings(description)
        self._constants = [rating.torque_constant for rating in self._ratings]
        self._idle = [0.0] * description.joints
        self._meters = Meters(self._ratings)

    def snapshot(self, state: State, io: Io) -> Snapshot:
        """Return the values of a tick from its state, terminals and registers."""
        current = self.follow(state.tick, state.robot_mode, state.actual_moment, state.actual_qd)
        return Snapshot(state, io, self._rigid, self._ratings, current, self._meters)

    def follow(self, tick: int, mode: int, moment: list[float], velocity: list[float]) -> list[float]:
        """Advance temperatures and energies to a tick by measured values; return the currents [A]."""
        current, mechanical = self._idle, 0.0
        if mode == RUNNING:
            current = [m / constant for m, constant in zip(moment, self._constants, strict=True)]
            mechanical = sum([m * v for m, v in zip(moment, velocity, strict=True)])
        self._meters.update(tick, current, mechanical, powered=mode in POWERED)
        return current
