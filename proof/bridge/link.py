"""A link between two addresses, in a process of its own: each way takes 1 ms ± 0.5 ms, and it fails on demand.

`python -m proof.bridge.link ROBOT NEAR` passes bytes on between the ports of the robot's interfaces at two addresses of
this machine. It does what the lines on its standard input say, and answers each with `done`.
"""

import random
import subprocess
import sys
from typing import Self

from proof.bridge.relay import Address, Relay

PORTS = (29999, 30001, 30002, 30004)
"""Dashboard, primary and secondary interface, RTDE."""
DELAY = (0.5e-3, 1.5e-3)
"""Range of the time that bytes take, which keep their order [s]."""


class Link:
    """Listens at an address, and connects to the robot.

    Args:
        robot: Its IP address.
        near: IP address that stands for it.
        seed: Seed of the delays.
        slower: Factor of the delays, beside a robot whose time passes more slowly.
    """

    def __init__(self, robot: str, near: str, seed: int = 0, slower: float = 1.0) -> None:
        draw = random.Random(seed)  # noqa: S311  nothing secret
        self._ports = [_Uneven((robot, port), (near, port), draw, slower) for port in PORTS]

    def do(self, what: str, *numbers: float) -> None:
        """Do the same to all ports: `hold`, `flow`, `cut` or `restore` as a `Relay` does, or `throttle` to a rate."""
        for port in self._ports:
            if what == "throttle":
                port.rate = numbers[0] or None
            else:
                getattr(port, what)()


class _Uneven(Relay):
    def __init__(self, target: Address, near: Address, draw: random.Random, slower: float) -> None:
        self._draw, self._slower = draw, slower
        super().__init__(target, near)

    def takes(self) -> float:
        return self._slower * self._draw.uniform(*DELAY)


class LinkProcess:
    """A link in another process, which ends with this object's use as a context.

    Args:
        robot: See `Link`, as for the other address.
        near: Where it listens.
        seed: Seed of the delays.
        slower: See `Link`.
    """

    def __init__(self, robot: str, near: str, seed: int = 0, slower: float = 1.0) -> None:
        command = [sys.executable, "-m", "proof.bridge.link", robot, near, str(seed), str(slower)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self) -> Self:
        self.do("flow")
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()

    def do(self, what: str) -> None:
        """Let it do what `Link.do` says, such as `hold` or `throttle 20000`, and wait until it has."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(what, file=self._process.stdin, flush=True)
        if self._process.stdout.readline() != "done\n":
            raise RuntimeError(f"the link has ended instead of doing {what}")


if __name__ == "__main__":
    link = Link(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    for line in sys.stdin:
        name, *arguments = line.split()
        link.do(name, *map(float, arguments))
        print("done", flush=True)
