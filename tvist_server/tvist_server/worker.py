"""One of several processes that serve robots: it does what the first process tells it, and ends with it."""

import asyncio
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection

from tvist_plant.user_file import UserFileError
from tvist_server.config import ConfigError, ServeConfig
from tvist_server.ending import Ending
from tvist_server.gateways.base import GatewayError
from tvist_server.recording import RecorderError
from tvist_server.server import Recording, Server
from tvist_server.spread import Share
from tvist_server.ur_ports import InterfaceName


@dataclass(frozen=True)
class Refused:
    """The robots cannot be served."""

    why: str
    misuse: bool
    """Whether an option is wrong."""


@dataclass(frozen=True)
class Made:
    """The robots exist, and nothing ticks yet."""

    ur: list[tuple[str, dict[InterfaceName, int]]]
    """Address and ports of each robot's UR interfaces."""


@dataclass(frozen=True)
class Ready:
    """The robots tick and answer."""


@dataclass(frozen=True)
class Ended:
    """The robots have stopped, and their recordings are closed."""

    failure: str | None
    """Why a robot had stopped ticking before."""
    recordings: list[Recording]


News = Refused | Made | Ready | Ended


def work(config: ServeConfig, share: Share, first: Connection) -> None:
    """Serve robots until the first process says that it is over, or has died.

    The conversation: this process makes its robots and says `Made`; told to go on, it starts them and says `Ready`;
    told to end, it says `Ended`. Signals are the first process's to hear: a terminal sends them to all processes.

    Args:
        config: Configuration of all robots.
        share: The robots of this process.
        first: Connection to the first process.
    """
    ending = Ending()
    ending.close()  # hears no signals
    try:
        server = Server(config, share=share)
    except (ConfigError, UserFileError, GatewayError, RecorderError) as error:
        _say(first, Refused(str(error), isinstance(error, ConfigError)))
        return
    _say(first, Made(server.ur))
    if not _told(first):
        server.discard()
        return

    def ready() -> None:
        _say(first, Ready())
        threading.Thread(target=_wait, args=(first, ending.request), name="tvist-end", daemon=True).start()

    asyncio.run(server.run(ready, ending))
    _say(first, Ended(server.failure, server.recordings))
    if not server.left:  # Zenoh would wait for ten seconds
        os._exit(0)


def _told(first: Connection) -> bool:
    """Wait for a word of the first process; False if it has died, or wants no robots."""
    try:
        return bool(first.recv())
    except (EOFError, OSError):
        return False


def _wait(first: Connection, over: Callable[[], None]) -> None:
    _told(first)
    over()


def _say(first: Connection, news: News) -> None:
    try:
        first.send(news)
    except OSError:  # the first process has died, which is noticed where its words are awaited
        return
