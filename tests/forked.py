"""`subprocess.run` and `subprocess.Popen` for Python programs, forked from a process that has imported everything.

Otherwise a short test would spend most of its time starting Python and importing. A forked program is a process of its
own with real signals, streams and an exit code; only the interpreter's clean-up at its end is missing. Tests of how a
program starts or ends use `subprocess`.
"""

import atexit
import json
import os
import select
import socket
import subprocess
import sys
import threading
from pathlib import Path

ROOT = Path(__file__).parents[1]
PATIENCE = 600.0
READ_AT_START = ("NUMBA_", "LD_", "XDG_")
"""Prefixes of variables that Python or its libraries read when they start."""


class Nursery:
    """The process from which this test process forks programs; it starts with the first of them, or before."""

    def __init__(self):
        self._process = None
        self._environment = dict(os.environ)
        self._lock = threading.Lock()

    def fork(self, request, streams):
        """Fork a program; return its process number and the socket that will receive its exit code."""
        told, theirs = socket.socketpair()
        with theirs, self._lock:
            self.start()
            socket.send_fds(self._requests, [json.dumps(request).encode()], [*streams, theirs.fileno()])
        told.settimeout(PATIENCE)
        return received(told), told

    def start(self):
        """Start the process unless it runs; it takes seconds to get ready."""
        if self._process is not None:
            return
        self._requests, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "tests.nursery", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                # A process with threads cannot fork safely.
                env={
                    **self._environment,
                    "OPENBLAS_NUM_THREADS": "1",
                    "OMP_NUM_THREADS": "1",
                    "PYTHONSAFEPATH": "",  # it is found in its folder; what it forks minds its own
                },
                cwd=ROOT,
            )
        atexit.register(self._close)

    def unlike(self, environment):
        """Return the variables for which a program of this environment would need a process of its own."""
        differ = environment.items() ^ self._environment.items()
        return {name for name, _ in differ if name.startswith(READ_AT_START)}

    def _close(self):
        self._requests.close()
        self._process.wait()


def received(told):
    number = told.recv(8)
    if not number:
        raise RuntimeError("the process that programs are forked from has ended")
    return int.from_bytes(number, "little", signed=True)


NURSERY = Nursery()


class Popen(subprocess.Popen):
    """Python with `-m`, `-c` or a file, perhaps `-W` before it, and options of `subprocess.Popen`."""

    def _execute_child(self, args, executable, preexec_fn, _close_fds, pass_fds, cwd, env, *rest):
        python, *words = map(os.fspath, args)
        environment = dict(os.environ if env is None else env)
        forkable = python == sys.executable and not (executable or preexec_fn or pass_fds)
        assert forkable, f"start {args} with subprocess"
        assert not (new := NURSERY.unlike(environment)), f"read at a program's start: {new}; use subprocess"
        given = (rest[3], rest[6], rest[8])  # the program's standard streams; -1: those of this process
        request = {
            "words": words, "environment": environment, "folder": str(Path(cwd or ".").resolve()),
            "session": bool(rest[14]),
        }  # fmt: skip
        streams = [ours if theirs < 0 else theirs for ours, theirs in enumerate(given)]
        self.pid, self._told = NURSERY.fork(request, streams)
        self._child_created = True
        self._close_pipe_fds(*rest[3:9])

    def _internal_poll(self, _deadstate=None, **_options):
        return self._ended(0)

    def _wait(self, timeout):
        if self._ended(timeout) is None:
            raise subprocess.TimeoutExpired(self.args, timeout)
        return self.returncode

    def _ended(self, timeout):
        with self._waitpid_lock:
            if self.returncode is None and select.select([self._told], [], [], timeout)[0]:
                with self._told:
                    self.returncode = received(self._told)
            return self.returncode


def run(words, *, capture_output=False, timeout=None, check=False, **options):
    """Like `subprocess.run`; a program that reads its input is a `Popen`."""
    if capture_output:
        options |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with Popen(words, **options) as process:
        try:
            said = process.communicate(timeout=timeout)
        except BaseException:
            process.kill()
            raise
    done = subprocess.CompletedProcess(words, process.returncode, *said)
    if check:
        done.check_returncode()
    return done
