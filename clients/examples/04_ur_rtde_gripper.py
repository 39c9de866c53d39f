"""Pick and place four boxes with ur_rtde, and a Robotiq 2F gripper over its own socket.

    tvist serve --ur --cell clients/examples/cell.toml
    python 04_ur_rtde_gripper.py [HOST]        default: 127.0.0.1

Needs `pip install ur-rtde`. The same program drives a real arm with Robotiq's URCap, which listens on the same port.
"""

import socket
import sys

from rtde_control import RTDEControlInterface

HOST = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1"
TOOL, COG = 0.92, 0.058
"""Mass of the gripper [kg], and its centre of gravity from the flange [m]."""
TCP = 0.163
"""Distance of the tool centre point from the flange [m]."""
MASSES = [0.4, 0.8, 1.2, 1.6]
DOWN = [2.2214, 2.2214, 0.0]


class Gripper:
    """A Robotiq 2F gripper at the socket of its URCap."""

    def __init__(self, host: str) -> None:
        self._socket = socket.create_connection((host, 63352), timeout=5.0)

    def ask(self, line: str) -> str:
        """Send a line, and return the answer."""
        self._socket.sendall(f"{line}\n".encode())
        answer = self._socket.recv(1024).decode().strip()
        if answer in {"", "?"}:
            raise RuntimeError(f"the gripper does not answer {line}")
        return answer

    def activate(self) -> None:
        """Activate it, and wait until it is active."""
        self.ask("SET ACT 0 ATR 0")
        self.ask("SET ACT 1")
        while self.ask("GET STA") != "STA 3":
            pass

    def move(self, position: int) -> bool:
        """Move the fingers, 0 is open and 255 closed; return whether they hold something."""
        self.ask(f"SET POS {position} SPE 255 FOR 150 GTO 1")
        while (stopped := self.ask("GET OBJ")) == "OBJ 0":
            pass
        return stopped in {"OBJ 1", "OBJ 2"}


def main() -> None:
    """Move all boxes by 20 cm."""
    control, gripper = RTDEControlInterface(HOST), Gripper(HOST)
    control.setTcp([0.0, 0.0, TCP, 0.0, 0.0, 0.0])
    gripper.activate()
    held = 0
    for number, mass in enumerate(MASSES):
        y = -0.3 + 0.1 * number
        control.moveJ_IK([-0.45, y, 0.35, *DOWN], 1.5, 2.0)
        control.moveL([-0.45, y, 0.2, *DOWN], 0.25, 1.2)
        held += gripper.move(255)
        control.setPayload(TOOL + mass, [0.0, 0.0, (TOOL * COG + mass * TCP) / (TOOL + mass)])
        control.moveL([-0.45, y, 0.35, *DOWN], 0.25, 1.2)
        control.moveJ_IK([-0.65, y, 0.35, *DOWN], 1.5, 2.0)
        control.moveL([-0.65, y, 0.2, *DOWN], 0.25, 1.2)
        gripper.move(0)
        control.setPayload(TOOL, [0.0, 0.0, COG])
        control.moveL([-0.65, y, 0.35, *DOWN], 0.25, 1.2)
    print(f"{held} of {len(MASSES)} boxes were gripped and put down 20 cm further")
    control.stopScript()
    control.disconnect()


if __name__ == "__main__":
    main()
