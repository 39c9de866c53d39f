"""UR's real-time interface, ports 30003 and 30013: at every tick an int32 length and 152 doubles, big-endian."""

from struct import Struct
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.primary.session import ScriptSession

LAYOUT: Final[tuple[tuple[str | None, int], ...]] = (
    ("timestamp", 1),
    ("target_q", 6),
    ("target_qd", 6),
    ("target_qdd", 6),
    ("target_current", 6),
    ("target_moment", 6),
    ("actual_q", 6),
    ("actual_qd", 6),
    ("actual_current", 6),
    ("joint_control_output", 6),
    ("actual_TCP_pose", 6),
    ("actual_TCP_speed", 6),
    ("actual_TCP_force", 6),
    ("target_TCP_pose", 6),
    ("target_TCP_speed", 6),
    ("actual_digital_input_bits", 1),
    ("joint_temperatures", 6),
    ("actual_execution_time", 1),
    (None, 1),  # test value, for UR's own use
    ("robot_mode", 1),
    ("joint_mode", 6),
    ("safety_mode", 1),
    (None, 6),
    ("actual_tool_accelerometer", 3),
    (None, 6),
    ("speed_scaling", 1),
    ("actual_momentum", 1),
    (None, 2),
    ("actual_main_voltage", 1),
    ("actual_robot_voltage", 1),
    ("actual_robot_current", 1),
    ("actual_joint_voltage", 6),
    ("actual_digital_output_bits", 1),
    ("runtime_state", 1),
    ("elbow_position", 3),
    ("elbow_velocity", 3),
    ("safety_status", 1),
    (None, 3),
    ("payload", 1),
    ("payload_cog", 3),
    ("payload_inertia", 6),
)
"""Fields of the package: attribute of the snapshot (None: reserved, filled with 0) and number of doubles."""

PACKAGE: Final = Struct(f">i{sum(count for _, count in LAYOUT)}d")
_KEY: Final = "realtime"


def package(snapshot: Snapshot) -> bytes:
    """Return the package of a tick, which is created once for all clients of a robot."""
    made: bytes | None = snapshot.shared.get(_KEY)
    if made is None:
        values: list[float] = []
        for name, count in LAYOUT:
            if name is None:
                values += [0.0] * count
            elif count == 1:
                values.append(getattr(snapshot, name))
            else:
                found: list[float] = getattr(snapshot, name)
                values += found
                values += [0.0] * (count - len(found))  # an arm with fewer joints
        made = snapshot.shared[_KEY] = PACKAGE.pack(PACKAGE.size, *values)
    return made


class RealtimeSession(ScriptSession):
    """One client of the real-time interface; its input is URScript, ignored on the read-only port."""

    def receive(self, data: bytes) -> None:
        if not self.read_only:
            super().receive(data)

    def sample(self, snapshot: Snapshot) -> bytes:
        return package(snapshot)
