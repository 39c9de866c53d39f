"""A link between two addresses, in a process of its own: each way takes 1 ms ± 0.5 ms, and it fails on demand.

`python -m tests.bridge.link ROBOT NEAR SEED SLOWER` passes bytes on between the ports of the robot's interfaces at two
addresses of this machine. It does what the lines on its standard input say, and answers each with `done`.
"""

import random
import subprocess
import sys
from pathlib import Path

from tests.system.relay import Relay

ROOT = Path(__file__).parents[2]
PORTS = (29999, 30001, 30002, 30004)
"""Dashboard, primary and secondary interface, RTDE."""
DELAY = (0.5e-3, 1.5e-3)
"""Range of the time that bytes take, which keep their order [s]."""


class Link:
    """Listens at an address that stands for a robot's, and connects to the robot."""

    def __init__(self, robot, near, seed, slower):
        draw = random.Random(seed)
        self._ports = [_Uneven((robot, port), (near, port), draw, slower) for port in PORTS]

    def do(self, what):
        """Do the same to all ports: `hold`, `flow`, `cut` or `restore` as a `Relay` does."""
        for port in self._ports:
            getattr(port, what)()


class _Uneven(Relay):
    def __init__(self, target, near, draw, slower):
        self._draw, self._slower = draw, slower
        super().__init__(target, near)

    def takes(self):
        return self._slower * self._draw.uniform(*DELAY)


class LinkProcess:
    """A `Link` in another process, which ends with this object's use as a context."""

    def __init__(self, *arguments):
        command = [sys.executable, "-m", "tests.bridge.link", *map(str, arguments)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen(command, cwd=ROOT, **pipes)

    def __enter__(self):
        self.do("flow")
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.communicate()

    def do(self, what):
        """Let it do what `Link.do` says, and wait until it has."""
        print(what, file=self._process.stdin, flush=True)
        assert self._process.stdout.readline() == "done\n", what


if __name__ == "__main__":
    link = Link(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
    for line in sys.stdin:
        link.do(line.strip())
        sys.stdout.write("done\n")
        sys.stdout.flush()
