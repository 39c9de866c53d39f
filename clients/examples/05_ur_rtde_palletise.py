"""Put four boxes on a pallet with ur_rtde and a gripper that really holds, in the world `pallet`.

    tvist serve --ur --cell clients/examples/palletise.toml
    python 05_ur_rtde_palletise.py [HOST]      default: 127.0.0.1

Needs `pip install ur-rtde`, and of the robot the extra `world`. `palletise.script` does the same in URScript.
"""

import socket
import sys
import time

from rtde_control import RTDEControlInterface

HOST = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1"
BOXES = [(-0.52, -0.40), (-0.52, -0.25), (-0.36, -0.40), (-0.36, -0.25)]
PLACES = [(-0.52, 0.12), (-0.52, 0.24), (-0.38, 0.12), (-0.38, 0.24)]
ABOVE, GRIPPED, PUT_DOWN = 0.35, 0.15, 0.177
"""Heights of the tool centre point [m]."""
DOWN = [2.2214, 2.2214, 0.0]


class Gripper:
    """A Robotiq 2F gripper at the socket of its URCap."""

    def __init__(self, host: str) -> None:
        self._socket = socket.create_connection((host, 63352), timeout=5.0)

    def ask(self, line: str) -> str:
        """Send a line, and return the answer."""
        self._socket.sendall(f"{line}\n".encode())
        return self._socket.recv(1024).decode().strip()

    def activate(self) -> None:
        """Activate it, and wait until it is active."""
        self.ask("SET ACT 1")
        while self.ask("GET STA") != "STA 3":
            time.sleep(0.01)

    def move(self, position: int) -> bool:
        """Move the fingers, 0 is open and 255 closed; return whether they hold something."""
        self.ask(f"SET POS {position} SPE 255 FOR 100 GTO 1")
        while (stopped := self.ask("GET OBJ")) == "OBJ 0":
            time.sleep(0.01)
        return stopped in {"OBJ 1", "OBJ 2"}


def main() -> None:
    """Carry all boxes to their places."""
    control, gripper = RTDEControlInterface(HOST), Gripper(HOST)
    control.setTcp([0.0, 0.0, 0.163, 0.0, 0.0, 0.0])
    gripper.activate()
    began, held = time.monotonic(), 0
    control.moveL([-0.144, -0.435, ABOVE, *DOWN], 0.5, 1.2)
    for box, place in zip(BOXES, PLACES, strict=True):
        control.moveJ_IK([*box, ABOVE, *DOWN], 1.05, 1.4)
        control.moveL([*box, GRIPPED, *DOWN], 0.25, 0.8)
        held += gripper.move(255)
        control.setPayload(1.32, [0.0, 0.0, 0.09])
        control.moveL([*box, ABOVE, *DOWN], 0.5, 1.2)
        control.moveL([*place, ABOVE, *DOWN], 0.5, 1.2)
        control.moveL([*place, PUT_DOWN, *DOWN], 0.25, 0.8)
        gripper.move(0)
        control.setPayload(0.92, [0.0, 0.0, 0.058])
        control.moveL([*place, ABOVE, *DOWN], 0.5, 1.2)
    print(f"{held} of {len(BOXES)} boxes were gripped and put down in {time.monotonic() - began:.1f} s")
    control.stopScript()
    control.disconnect()


if __name__ == "__main__":
    main()
