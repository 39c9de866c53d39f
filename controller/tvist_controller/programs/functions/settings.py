"""Functions that set the tool, the payload and gravity, and the force at the tool to zero."""

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.planning.plan import Plan
from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import bounds, number, numbers, pose
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import DELAY, Turns
from tvist_controller.programs.moves import OWN_TOKEN
from tvist_plant.plant import PERIOD
from tvist_plant.robot_checks import lacking_inertia
from tvist_plant.robot_tables import Tensor
from tvist_protocol.commands import SetPayload
from tvist_protocol.forces import ZeroFtsensor
from tvist_protocol.io import Length, SetTcp
from tvist_protocol.values import Mass, Moment, Offset
from tvist_urscript import Array, Fault, costs

GRAVITY = 9.82
"""Gravity that programs declare, within `TOLERANCE`; the simulated arm stands upright and knows no other [m/s^2]."""
TOLERANCE = 0.05
ROUNDED = 0.05
"""Share of the largest moment of inertia that others may lack because a CAD system has rounded them."""
ORDER = (0, 3, 5, 1, 2, 4)
"""Places of Ixx Iyy Izz Ixy Ixz Iyz, as programs have them, in the order of robot files."""


class SettingFunctions:
    """Changes the settings of one robot.

    Args:
        access: The robot.
        arm: Its arm, whose moves are carried out before.
    """

    def __init__(self, access: Access, arm: ProgramArm) -> None:
        self._access, self._arm = access, arm

    @costs(5)
    def set_tcp(self, tcp: object, tcp_name: object = "") -> Turns:
        """Set the tool centre point in the flange frame."""
        del tcp_name  # names are for people
        yield from self._arm.finish()
        self._send(SetTcp(token=OWN_TOKEN, offset=pose("tcp", tcp, Length)))

    @costs(20)
    def set_payload(self, m: object, cog: object = None) -> Turns:
        """Declare a payload without inertia; without a centre of mass, it is at the tool centre point."""
        com = self._access.motion.tcp[:3] if cog is None else numbers("cog", cog, 3, Offset)
        yield from self._declare(number("m", m, *bounds(Mass)), com, (0.0,) * 6)

    @costs(20)
    def set_payload_mass(self, m: object) -> Turns:
        """Change the mass of the declared payload."""
        declared = self._access.declared()
        yield from self._declare(number("m", m, *bounds(Mass)), declared.com, declared.inertia)

    @costs(20)
    def set_payload_cog(self, cog: object) -> Turns:
        """Change the centre of mass of the declared payload."""
        declared = self._access.declared()
        yield from self._declare(declared.mass, numbers("cog", cog, 3, Offset), declared.inertia)

    @costs(20)
    def set_target_payload(
        self, m: object, cog: object, inertia: object = None, transition_time: object = 0
    ) -> Turns:
        """Declare a payload with its inertia, Ixx Iyy Izz Ixy Ixz Iyz; clients see it change in a time."""
        seconds = number("transition_time", transition_time, 0.0, 3600.0)
        xx, yy, zz, xy, xz, yz = (0.0,) * 6 if inertia is None else numbers("inertia", inertia, 6, Moment)
        full = self._as_a_body((xx, xy, xz, yy, yz, zz))
        yield from self._declare(number("m", m, *bounds(Mass)), numbers("cog", cog, 3, Offset), full, seconds)

    def _as_a_body(self, inertia: Tensor) -> Tensor:
        """Make the moments of a body of those that were rounded, with a warning; others are left to be refused."""
        lack = lacking_inertia(inertia)
        if not 0.0 < lack <= ROUNDED * max(inertia[0], inertia[3], inertia[5]):
            return inertia
        self._access.emit(
            "warning",
            why=f"set_target_payload: no body has the inertia {[inertia[k] for k in ORDER]}; taken for a rounded one, "
            f"it gets {lack:.2g} kg m² more about each axis",
        )
        lack *= 1.0 + 1e-9
        xx, xy, xz, yy, yz, zz = inertia
        return xx + lack, xy, xz, yy + lack, yz, zz + lack

    def set_gravity(self, d: object) -> None:
        """Accept the gravity that the arm has, which is installed upright.

        Raises:
            Fault: It is another.
        """
        x, y, z = numbers("d", d, 3)
        if max(abs(x), abs(y), abs(z - GRAVITY)) > TOLERANCE:
            raise Fault(f"set_gravity: d is [{x:g}, {y:g}, {z:g}]; the simulated arm stands upright, so it must be "
                        f"[0, 0, {GRAVITY}]")  # fmt: skip

    def get_gravity(self) -> Array:
        """Return the gravity that the arm has, which is installed upright [m/s^2]."""
        return Array((0.0, 0.0, GRAVITY))

    @costs(80)
    def zero_ftsensor(self) -> None:
        """Take the present force and torque at the tool as zero."""
        self._send(ZeroFtsensor(token=OWN_TOKEN))

    def _declare(
        self, mass: float, com: tuple[float, ...], inertia: tuple[float, ...], seconds: float = 0.0
    ) -> Turns:
        xyz = (com[0], com[1], com[2])
        six = (inertia[0], inertia[1], inertia[2], inertia[3], inertia[4], inertia[5])
        yield from self._arm.finish()
        command = SetPayload(token=OWN_TOKEN, mass=mass, com=xyz, inertia=six, transition_time=seconds)
        # Planned beside the ticks and taken after a fixed number of them, as a move is: so it takes effect at the same
        # tick on every machine (decision 26).
        ordered = self._access.plans.later(command)
        for _ in range(DELAY):
            yield
        before, ticks, now = self._access.declared(), round(seconds / PERIOD), self._access.latest().tick + 1
        self._send(command, ordered())
        self._access.peripherals.payload_change = (before, ticks, now + ticks) if ticks else None

    def _send(self, command: SetTcp | SetPayload | ZeroFtsensor, plan: Plan | None = None) -> None:
        try:
            self._access.send(command, plan)
        except RefusalError as refusal:
            raise Fault(refusal.reply.why) from refusal
