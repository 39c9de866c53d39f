"""Log UR's real-time interface, port 30003, to a CSV file, with only Python's standard library.

    tvist serve --ur --profile real
    python 02_realtime_log.py [HOST] [FILE] [SECONDS]        default: 127.0.0.1 realtime.csv, until Control+C

The robot sends a package at every tick, 500 times a second: an int32 with its own length, then doubles, big-endian.
This is the layout that UR publishes; software before 5.10 ends it after the safety status. Columns have UR's names,
with a number appended to each of several values: one per joint, or x y z and a rotation vector. Times are in s,
angles in rad, lengths in m, forces in N, moments in N m, currents in A. Targets are those before the shaper.
"""

import csv
import signal
import socket
import struct
import sys

HOST, FILE, SECONDS = (*sys.argv[1:4], *("127.0.0.1", "realtime.csv", "inf")[len(sys.argv) - 1 :])
PORT, TICK = 30003, 0.002
LAYOUT = (
    ("time", 1), ("q_target", 6), ("qd_target", 6), ("qdd_target", 6), ("I_target", 6), ("M_target", 6),
    ("q_actual", 6), ("qd_actual", 6), ("I_actual", 6), ("I_control", 6),
    ("tool_vector_actual", 6), ("TCP_speed_actual", 6), ("TCP_force", 6),
    ("tool_vector_target", 6), ("TCP_speed_target", 6), ("digital_inputs", 1), ("motor_temperatures", 6),
    ("controller_timer", 1), ("", 1), ("robot_mode", 1), ("joint_modes", 6), ("safety_mode", 1), ("", 6),
    ("tool_accelerometer", 3), ("", 6), ("speed_scaling", 1), ("linear_momentum", 1), ("", 2),
    ("V_main", 1), ("V_robot", 1), ("I_robot", 1), ("V_actual", 6), ("digital_outputs", 1), ("program_state", 1),
    ("elbow_position", 3), ("elbow_velocity", 3), ("safety_status", 1),
    ("", 3), ("payload_mass", 1), ("payload_cog", 3), ("payload_inertia", 6),
)  # fmt: skip
"""Doubles of a package, in order: name and count; those without a name are reserved."""
NAMES = [
    name and (name if count == 1 else f"{name}_{number}") for name, count in LAYOUT for number in range(count)
]


def receive(robot: socket.socket, size: int) -> bytes:
    """Receive this many bytes, which may arrive in pieces."""
    data = b""
    while len(data) < size:
        piece = robot.recv(size - len(data))
        if not piece:
            sys.exit("the robot has closed the connection")
        data += piece
    return data


def main() -> None:
    """Log until the time is over."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    ticks: list[int] = []
    try:
        robot = socket.create_connection((HOST, PORT), timeout=5.0)
    except OSError as error:
        sys.exit(f"nobody listens at {HOST}:{PORT} ({error}): does the server run, with --ur?")
    # If this program reads too slowly, samples are lost; this buffer holds half a second of them.
    robot.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 600_000)
    with robot, open(FILE, "w", newline="", encoding="utf-8") as file:  # noqa: PTH123  one page of plain Python
        log = csv.writer(file)
        log.writerow(name for name in NAMES if name)
        print(f"logging {HOST}:{PORT} into {FILE} …", flush=True)
        try:
            while not ticks or (ticks[-1] - ticks[0]) * TICK < float(SECONDS):
                (size,) = struct.unpack(">i", receive(robot, 4))
                values = struct.unpack(f">{(size - 4) // 8}d", receive(robot, size - 4))
                log.writerow(value for name, value in zip(NAMES, values, strict=False) if name)
                ticks.append(round(values[0] / TICK))
        except KeyboardInterrupt:
            pass
    if ticks:
        print(f"{len(ticks)} samples, {ticks[-1] - ticks[0] + 1 - len(ticks)} missing")


if __name__ == "__main__":
    main()
