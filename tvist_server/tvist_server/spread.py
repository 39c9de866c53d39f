"""Distribution of a server's robots over processes, and the options that it excludes."""

import multiprocessing
from dataclasses import dataclass
from itertools import pairwise

from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError

LOCAL = "unixsock-stream/"  # prefix of the endpoints reserved for the server's own processes


@dataclass(frozen=True)
class Share:
    """The robots that one of several processes serves."""

    numbers: range  # indices of the robots in the list of all
    router: str | None = None
    """Endpoint of the process that clients connect to; None if this process has the configured endpoints."""


def shares(robots: int, workers: int) -> list[range]:
    """Return the robots of each process: consecutive ones, in parts whose sizes differ by at most one."""
    bounds = [worker * robots // workers for worker in range(workers + 1)]
    return [range(first, last) for first, last in pairwise(bounds)]


def check_together(config: ServeConfig, robots: int) -> None:
    """Check durations, folders, and the options for network and processes; StartError if one is wrong or excluded."""
    config.keep_ticks()
    config.dump_folder()
    config.program_folder(config.name)
    config.allowed_hosts()
    if config.connect and config.endpoints and config.security is not None:
        raise StartError(
            "connect, listen and security exclude each other: the router checks certificates, so leave listen out"
        )
    if config.workers == 1:
        return
    if config.workers > robots:
        raise StartError(f"workers is {config.workers}: must be at most the number of robots, {robots}")
    if "fork" not in multiprocessing.get_all_start_methods():
        raise StartError(f"workers is {config.workers}: this system cannot fork processes, so give 1")
    if config.connect and config.endpoints:
        raise StartError(
            "connect, listen and workers exclude each other: each process connects to the router, so leave listen out"
        )
    if config.connect and config.metrics is not None:
        raise StartError(
            "connect, metrics and workers exclude each other: run a server for each process, with metrics on ports of "
            "their own"
        )
    for endpoint in config.endpoints:
        if endpoint.startswith(LOCAL):
            raise StartError(
                f"listen is {endpoint}, and workers is {config.workers}: Unix sockets are for the server's own "
                "processes, so listen on tcp/ or tls/"
            )
