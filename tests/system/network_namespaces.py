"""Two network namespaces of this machine with a cable between them."""

import contextlib
import os
import shutil
import subprocess

ROBOTS, WATCHERS = "10.213.7.1", "10.213.7.2"
"""Addresses of the two ends."""


def why_not():
    """Why there can be none here; None if there can."""
    if shutil.which("ip") is None:
        return "network namespaces need the command ip"
    if os.geteuid() != 0:
        return "network namespaces need root"
    probe = subprocess.run(
        ["ip", "netns", "add", f"tvist-probe-{os.getpid()}"], capture_output=True, check=False
    )
    if probe.returncode:
        return f"network namespaces are not permitted: {probe.stderr.decode().strip()}"
    subprocess.run(["ip", "netns", "del", f"tvist-probe-{os.getpid()}"], check=True)
    return None


@contextlib.contextmanager
def cabled():
    """Words that run a program at either end: among the robots, and among those who watch."""
    names = [f"tvist-{what}-{os.getpid()}" for what in ("robots", "watchers")]
    ends = [f"tv{number}-{os.getpid() % 100000}" for number in (0, 1)]
    try:
        for name in names:
            _ip("netns", "add", name)
        _ip("link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
        for name, end, address in zip(names, ends, (ROBOTS, WATCHERS), strict=True):
            _ip("link", "set", end, "netns", name)
            _ip("-n", name, "addr", "add", f"{address}/24", "dev", end)
            _ip("-n", name, "link", "set", end, "up")
            _ip("-n", name, "link", "set", "lo", "up")
        yield [("ip", "netns", "exec", name) for name in names]
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)


def _ip(*arguments):
    subprocess.run(["ip", *arguments], check=True)
