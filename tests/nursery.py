"""The process from which `tests.forked` forks Python programs, after it has imported libraries and loaded kernels.

`python -m tests.nursery FD` reads from that socket one message per program: JSON with its words, environment and
folder, together with the program's standard streams and a socket, which receives its process number and later its exit
code. All programs end with the process that requested them.
"""

import atexit
import contextlib
import gc
import importlib
import io
import json
import os
import runpy
import select
import signal
import socket
import sys
import tempfile
import threading
import types
import warnings
from pathlib import Path

LONGEST = 1 << 17  # longest message [bytes]
LIBRARIES = (
    "cryptography.x509", "cyclopts", "lark", "matplotlib.pyplot", "mcap.reader", "mcap.writer", "mujoco", "polars",
    "psutil", "rich.console", "rich.live", "rich.progress", "rich.table", "scipy.linalg", "scipy.optimize",
    "scipy.signal", "scipy.stats", "tvist_client.blocking", "tvist_client.transports.zenoh", "tvist_server.server",
    "tvist_server.workers", "websockets.asyncio.server", "zenoh",
)  # fmt: skip
"""Libraries that take long to import; not the command line, whose consoles read the environment on import."""


def warm_up():
    """Import and load what programs need; keep garbage collections from touching, and so copying, it."""
    from tvist_testing.nursery import warm_up as move_a_robot

    for name in LIBRARIES:
        importlib.import_module(name)
    move_a_robot()
    gc.collect()
    gc.freeze()


def main(requests):
    """Fork programs until the socket closes, then return None; return its request in a forked program."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    woken, wakes = os.pipe()
    os.set_blocking(wakes, False)
    signal.set_wakeup_fd(wakes)
    running = {}
    while True:
        ready, _, _ = select.select([requests, woken], [], [])
        if woken in ready:
            os.read(woken, 4096)
            tell_ended(running)
        if requests in ready:
            message, descriptors, _, _ = socket.recv_fds(requests, LONGEST, 4)
            if not message:
                for child in running:
                    os.kill(child, signal.SIGKILL)
                return None
            child = os.fork()
            if not child:
                begin(descriptors)
                return json.loads(message)
            running[child] = socket.socket(fileno=descriptors.pop())
            for one in descriptors:
                os.close(one)


def tell_ended(running):
    """Send the exit codes of programs that have ended."""
    while running:
        child, status = os.waitpid(-1, os.WNOHANG)
        if not child:
            return
        with running.pop(child) as told, contextlib.suppress(OSError):
            told.sendall(os.waitstatus_to_exitcode(status).to_bytes(8, "little", signed=True))


def begin(descriptors):
    """Set signals and open files as in a new process, and send its number."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    *streams, told = descriptors
    for place, given in enumerate(streams):
        os.dup2(given, place)
    os.write(told, os.getpid().to_bytes(8, "little"))
    os.closerange(3, 1024)


def become(words, environment, folder, session):
    """Run `python WORDS`."""
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    tempfile.tempdir = None  # TMPDIR may have changed
    if session:
        os.setsid()
    sys.stdin, sys.stdout, sys.stderr = open(0, closefd=False), stream(1), stream(2)  # noqa: SIM115
    if words[0] == "-W":
        warnings.simplefilter(words[1])
        words = words[2:]
    first, *rest = words
    first_of_all = {"-m": folder, "-c": ""}.get(first, str(Path(first).parent))
    sys.path[:0] = filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))
    if not environment.get("PYTHONSAFEPATH"):
        sys.path.insert(0, first_of_all)
    if first == "-m":
        sys.argv = rest
        runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    elif first == "-c":
        sys.argv = ["-c", *rest[1:]]
        sys.modules["__main__"] = module = types.ModuleType("__main__")
        exec(compile(rest[0], "<string>", "exec"), module.__dict__)  # noqa: S102  the requested program
    else:
        sys.argv = words
        runpy.run_path(first, run_name="__main__")


def stream(number):
    """Return standard output or error, as Python opens it."""
    at_once = bool(os.environ.get("PYTHONUNBUFFERED"))
    return io.TextIOWrapper(
        open(number, "wb", buffering=0 if at_once else -1, closefd=False),
        encoding="utf-8",
        errors="backslashreplace" if number == 2 else "strict",
        line_buffering=number == 2 or os.isatty(number),
        write_through=at_once,
    )


def end_as(does):
    """Call it and end like Python, but without the clean-up of imported modules, which takes 0.2 s."""
    code = 0
    try:
        does()
    except SystemExit as wish:
        code = wish.code if isinstance(wish.code, int) else int(wish.code is not None)
        if isinstance(wish.code, str):
            sys.stderr.write(f"{wish.code}\n")
    except BaseException as error:  # noqa: BLE001  as Python does
        code = -signal.SIGINT if isinstance(error, KeyboardInterrupt) else 1
        sys.excepthook(type(error), error, error.__traceback__)
    threading._shutdown()
    atexit._run_exitfuncs()
    for each in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            each.flush()
    if code < 0:
        signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code & 0xFF)


if __name__ == "__main__":
    warm_up()
    wanted = main(socket.socket(fileno=int(sys.argv[1])))
    if wanted:
        end_as(lambda: become(**wanted))
