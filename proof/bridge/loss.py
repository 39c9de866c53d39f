"""How late set-points come over a cable that loses packets: TCP sends them again, and what follows has to wait.

The cable joins two network namespaces, and a packet filter drops packets at random at either end; this needs root, and
the commands `ip` and `nft`.
"""

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from struct import Struct
from typing import Any

import numpy as np

NEAR, FAR = "10.213.42.1", "10.213.42.2"
PORT, PERIOD = 30004, 0.002
_PACKAGE = Struct(">d207x")
"""A package as long as a robot's input package: when it was sent [s], and fill."""


@contextlib.contextmanager
def cable(lost: float) -> Iterator[Sequence[list[str]]]:
    """Lay a cable; return the words that run a program at either end.

    Args:
        lost: Share of the packets of TCP that are dropped at either end [-].
    """
    names = [f"tvist-{end}-{os.getpid()}" for end in ("near", "far")]
    plugs = [f"tv{end}{os.getpid() % 1_000_000}" for end in "nf"]
    try:
        for name in names:
            _do("ip", "netns", "add", name)
        _do("ip", "link", "add", plugs[0], "type", "veth", "peer", "name", plugs[1])
        for name, plug, address in zip(names, plugs, (NEAR, FAR), strict=True):
            _do("ip", "link", "set", plug, "netns", name)
            _do("ip", "-n", name, "addr", "add", f"{address}/24", "dev", plug)
            for one in (plug, "lo"):
                _do("ip", "-n", name, "link", "set", one, "up")
            if lost:
                rule = f"meta l4proto tcp numgen random mod 1000000 < {round(1e6 * lost)} counter drop"
                hook = "type filter hook input priority 0"
                table = f"table ip tvist {{\n chain lose {{\n {hook}\n {rule}\n }}\n}}\n"
                _do("ip", "netns", "exec", name, "nft", "-f", "-", told=table)
        yield [["ip", "netns", "exec", name] for name in names]
    finally:
        for name in names:
            with contextlib.suppress(subprocess.CalledProcessError):
                _do("ip", "netns", "del", name)


def _do(*words: str, told: str = "") -> str:
    return subprocess.run(words, input=told, text=True, check=True, capture_output=True).stdout


def measure(lost: float, seconds: float) -> dict[str, Any]:
    """Send packages over such a cable, 500 a second; return how late they came, counted from the least delay [ms]."""
    with cable(lost) as (near, far):
        here = [sys.executable, "-m", "proof.bridge.loss"]
        taking = subprocess.Popen([*far, *here, "take"], stdout=subprocess.PIPE, text=True)
        assert taking.stdout is not None
        taking.stdout.readline()
        subprocess.run([*near, *here, "send", str(seconds)], check=True)
        out, _ = taking.communicate()
        dropped = sum(_dropped(end) for end in (near, far)) if lost else 0
    delays = np.array([float(line) for line in out.split()])
    late = 1e3 * (delays - delays.min())
    held = late > 1e3 * PERIOD
    spells = int(np.sum(np.diff(held.astype(int), prepend=0) == 1))
    figures = {
        f"late_p{share:g}_ms": float(np.percentile(late, share)) for share in (50.0, 99.0, 99.9, 99.99)
    }
    spans = np.split(late, np.flatnonzero(np.diff(held.astype(int))) + 1)
    longest = sorted(float(span.max()) for span in spans if span[0] > 1e3 * PERIOD)
    return {
        "lost_percent": 1e2 * lost,
        "packages": len(late),
        "packets_dropped": dropped,
        "spells_later_than_a_period": spells,
        **figures,
        "spell_median_ms": float(np.median(longest)) if longest else 0.0,
        "late_max_ms": float(late.max()),
        "later_than_36_ms": int((late > 36.0).sum()),
    }


def _dropped(end: Sequence[str]) -> int:
    said = _do(*end, "nft", "list", "table", "ip", "tvist")
    return int(said.partition("packets ")[2].split()[0])


def _take() -> None:
    with socket.create_server((FAR, PORT)) as listening:
        print("ready", flush=True)
        connection, _ = listening.accept()
        rest, delays = b"", list[float]()
        with connection:
            while data := connection.recv(1 << 16):
                now, rest = time.monotonic(), rest + data
                whole = len(rest) // _PACKAGE.size * _PACKAGE.size
                delays += [now - sent for (sent,) in _PACKAGE.iter_unpack(rest[:whole])]
                rest = rest[whole:]
    print("\n".join(map(str, delays)))


def _send(seconds: float) -> None:
    with socket.create_connection((FAR, PORT)) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        begun = time.monotonic()
        for number in range(round(seconds / PERIOD)):
            time.sleep(max(0.0, begun + number * PERIOD - time.monotonic()))
            connection.sendall(_PACKAGE.pack(time.monotonic()))


if __name__ == "__main__":
    if sys.argv[1] == "take":
        _take()
    else:
        _send(float(sys.argv[2]))
