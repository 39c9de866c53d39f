"""The process that makes robots: it imports and compiles everything once, and forks for each robot.

A forked robot starts much faster than `tvist serve`. All robots start as copies of the same memory, so what a
robot computes does not depend on the robots before it.

The test's process runs `python -m tvist_testing.nursery FD`. It sends one line of JSON for each robot over
the socket FD, with one end of the robot's own socket. However the test's process ends, its sockets close, and
so this process and all its robots end.
"""

import asyncio
import gc
import os
import signal
import socket
import sys

import msgspec

LONGEST = 4 << 20  # longest description of a robot [bytes]; its program may have a million characters


def main(number: int) -> None:
    """Make robots until the socket closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Control+C ends the test's process, which ends this one
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # so that robots do not become zombies
    warm_up()
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=number) as requests:
        requests.sendall(b"ready\n")
        while True:
            line, descriptors = _receive(requests)
            if not line:
                return
            if os.fork() == 0:
                requests.close()
                _become_robot(line, descriptors[0])
            os.close(descriptors[0])


def warm_up() -> None:
    """Run a short motion, which loads or compiles every kernel that a robot usually needs."""
    from tvist_client.robot import Robot
    from tvist_client.transports.loopback import LoopbackTransport
    from tvist_controller.loopback import LoopbackHost
    from tvist_server.config import ServeConfig
    from tvist_testing import forked_robot  # noqa: F401  what a robot imports before it serves

    setup = ServeConfig(clock="free", truth=True).setup()
    transport = LoopbackTransport(LoopbackHost(setup))

    async def move() -> None:
        async with Robot.over(transport) as robot, robot.control("nursery") as arm:
            await arm.move_j([angle + 0.01 for angle in setup.q])

    asyncio.run(move())


def _receive(requests: socket.socket) -> tuple[bytes, list[int]]:
    """Return the next line and the descriptors that came with it; an empty line at the end."""
    line, descriptors, _, _ = socket.recv_fds(requests, 65536, 1)
    while line and not line.endswith(b"\n") and len(line) < LONGEST:
        more = requests.recv(65536)
        if not more:
            return b"", descriptors
        line += more
    return line, descriptors


def _become_robot(line: bytes, descriptor: int) -> None:
    """Serve a robot in this forked process, and end the process."""
    from tvist_testing.forked_robot import serve
    from tvist_testing.markers import WantedRobot

    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    code = 1
    try:
        with socket.socket(fileno=descriptor) as connection:
            code = serve(msgspec.json.decode(line, type=WantedRobot), connection)
    finally:
        sys.stderr.flush()
        # Skip the interpreter's clean-up, which belongs to the parent process.
        os._exit(code)


if __name__ == "__main__":
    main(int(sys.argv[1]))
