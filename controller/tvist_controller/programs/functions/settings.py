"""Functions that set tool, payload, gravity and the zero of the force."""

from typing import Annotated

from tvist_controller.instruments.variables import ORDER
from tvist_controller.planning.plan import Plan
from tvist_controller.programs.access import OWN_TOKEN, refusals_as_faults
from tvist_controller.programs.arguments import Vector3, pose, several, within
from tvist_controller.programs.blended_moves import DELAY, Turns
from tvist_controller.programs.functions.group import FunctionGroup, reads
from tvist_plant.plant import PERIOD
from tvist_plant.robot_checks import lacking_inertia
from tvist_plant.robot_tables import Tensor
from tvist_protocol import values
from tvist_protocol.commands import SetPayload
from tvist_protocol.forces import ZeroFtsensor
from tvist_protocol.io import Length, SetTcp
from tvist_protocol.values import Mass, Moment, Offset
from tvist_urscript import Array, Fault, costs

GRAVITY = 9.82  # gravity that programs may declare, within `TOLERANCE`, for an upright arm [m/s^2]
TOLERANCE = 0.05
ROUNDED = 0.05  # fraction of the largest moment by which others may be too small due to rounding in CAD
NONE: Tensor = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # inertia of a payload declared without it


Centre = Annotated[tuple[float, float, float], several(3, Offset)]
Moments = Annotated[Tensor, several(6, Moment)]
ToolPose = Annotated[values.Pose, lambda name, value: pose(name, value, Length)]


class SettingFunctions(FunctionGroup):
    """Settings of one robot, which take effect after pending moves."""

    title = "Settings"

    @costs(5)
    def set_tcp(self, tcp: ToolPose, tcp_name: object = "") -> Turns:
        """Set the tool centre point in the flange frame."""
        yield from self._arm.finish()
        self._send(SetTcp(token=OWN_TOKEN, offset=tcp))

    @costs(20)
    def set_payload(self, m: Mass, cog: Centre | None = None) -> Turns:
        """Declare a payload without inertia; its centre of mass is by default the tool centre point."""
        x, y, z = self._access.motion.tcp[:3] if cog is None else cog
        return self._declare(m, (x, y, z), NONE)

    @costs(20)
    def set_payload_mass(self, m: Mass) -> Turns:
        """Change the mass of the declared payload."""
        declared = self._access.declared()
        return self._declare(m, declared.com, declared.inertia)

    @costs(20)
    def set_payload_cog(self, cog: Centre) -> Turns:
        """Change the centre of mass of the declared payload."""
        declared = self._access.declared()
        return self._declare(declared.mass, cog, declared.inertia)

    @costs(20)
    def set_target_payload(
        self,
        m: Mass,
        cog: Centre,
        inertia: Moments | None = None,
        transition_time: Annotated[float, within(0.0, 3600.0)] = 0,
    ) -> Turns:
        """Declare a payload with inertia, Ixx Iyy Izz Ixy Ixz Iyz; clients see a gradual transition."""
        xx, yy, zz, xy, xz, yz = inertia or NONE
        return self._declare(m, cog, self._as_a_body((xx, xy, xz, yy, yz, zz)), transition_time)

    def _as_a_body(self, inertia: Tensor) -> Tensor:
        """Correct slightly impossible moments with a warning; leave others to be refused."""
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

    def set_gravity(self, d: Vector3) -> None:
        """Check that gravity is that of an upright arm."""
        x, y, z = d
        if max(abs(x), abs(y), abs(z - GRAVITY)) > TOLERANCE:
            raise Fault(f"set_gravity: d is [{x:g}, {y:g}, {z:g}]; the simulated arm stands upright, so it must be "
                        f"[0, 0, {GRAVITY}]")  # fmt: skip

    get_gravity = reads("Return gravity for an upright arm [m/s^2].", lambda _: Array((0.0, 0.0, GRAVITY)))

    @costs(80)
    def zero_ftsensor(self) -> None:
        """Take the present force and torque at the tool as zero."""
        self._send(ZeroFtsensor(token=OWN_TOKEN))

    def _declare(
        self, mass: float, com: tuple[float, float, float], inertia: Tensor, seconds: float = 0.0
    ) -> Turns:
        yield from self._arm.finish()
        command = SetPayload(token=OWN_TOKEN, mass=mass, com=com, inertia=inertia, transition_time=seconds)
        # Planned in parallel and applied after a fixed number of ticks, so that every machine applies it at the same
        # tick.
        ordered = self._access.plans.later(command)
        for _ in range(DELAY):
            yield
        before, ticks, now = self._access.declared(), round(seconds / PERIOD), self._access.latest().tick + 1
        self._send(command, ordered())
        self._access.peripherals.payload_change = (before, ticks, now + ticks) if ticks else None

    def _send(self, command: SetTcp | SetPayload | ZeroFtsensor, plan: Plan | None = None) -> None:
        with refusals_as_faults():
            self._access.send(command, plan)
