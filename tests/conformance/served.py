"""`tvist serve` in a process of its own, with a free port."""

import os
import signal
import subprocess
import sys
import threading

from tests import forked
from tests.places import free_endpoint

PATIENCE = 300.0
"""Longest wait, on the slowest machine [s]: no test measures speed."""
NOISE = ("Traceback", "leaked", "nanobind", "Exception ignored", "Fatal Python error", "panicked")
"""Words on stderr that only a fault causes."""
NOT_REPEATED = {"tvist_server.clock.REPEAT_EVERY": 3600.0}
"""Constants with which a robot in lockstep does not publish its last state again."""
SLOWER = ("--speed", "0.6")
"""Options of a robot whose streams survive a pause of 0.4 s of their client."""


def finished(*words, timeout=PATIENCE, run=forked.run, **more):
    """Run a Python program to its end; return its exit code and output."""
    command = [sys.executable, *map(str, words)]
    return run(command, capture_output=True, text=True, timeout=timeout, check=False, **more)


def refused_to_start(*options, endpoint=None):
    """Return exit code and message of a `tvist serve` that refuses to start."""
    with_port = ("--listen", endpoint or free_endpoint())
    refused = finished("-m", "tvist_cli", "serve", *with_port, *options)
    assert refused.stdout == ""
    assert refused.stderr.count("\n") == 1, refused.stderr
    assert refused.stderr.startswith("tvist: ")
    return refused.returncode, refused.stderr


def with_constants(constants):
    """Return the words for a Python that sets constants, which must exist, and becomes `tvist serve`."""
    lines = [
        f"import {name.rpartition('.')[0]}; {name}; {name} = {value}" for name, value in constants.items()
    ]
    lines += ["import sys", "from tvist_cli.main import main", "sys.argv[:1] = ['tvist', 'serve']", "main()"]
    return "-c", "\n".join(lines)


class Served:
    """A robot in a process of its own, or several if `name` is None and --robots is given.

    Args:
        options: Further options.
        name: Name of the robot.
        endpoint: Where it listens.
        router: Where it connects to instead.
        around: Words before the command line, such as `ip netns exec`.
        cold: Whether a new interpreter runs it instead of a fork, because its environment or start matters.
        python: Interpreter of another environment, which implies `cold`.
        constants: Values of constants in modules, by their full names.
    """

    program = ("-m", "tvist_cli", "serve")  # what Python runs

    def __init__(
        self,
        *options,
        name="ur5e",
        endpoint=None,
        router=None,
        around=(),
        cold=False,
        python=None,
        constants=None,
    ):
        self.name, self.endpoint = name, router or endpoint or free_endpoint()
        where = "--listen" if router is None else "--connect"
        named = () if name is None else ("--name", name)
        program = with_constants(constants) if constants else self.program
        start = subprocess.Popen if around or cold or python else forked.Popen
        words = [*around, python or sys.executable, *program, where, self.endpoint, *named, *options]
        self._begin(start, words, {**os.environ, "PYTHONUNBUFFERED": "1"})

    def _begin(self, start, words, environment):
        """Start a program, and read what it writes to stderr."""
        self.lines, self._news = [], threading.Condition()
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        self.process = start(words, env=environment, **pipes)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_until_ready(self):
        def said():
            return any("listens " in line for line in self.lines) or not self._reader.is_alive()

        with self._news:
            listens = self._news.wait_for(said, PATIENCE) and "listens " in self.said
        if not listens:
            self.kill()
            raise AssertionError(f"tvist serve did not come up: {self.said}")

    def wait_until_said(self, words):
        with self._news:
            assert self._news.wait_for(lambda: words in self.said, PATIENCE), self.said

    @property
    def said(self):
        return "".join(self.lines)

    def end(self, number=signal.SIGTERM):
        """Send a signal, wait for the end, and return the exit code."""
        self.process.send_signal(number)
        return self.wait()

    def wait(self):
        """Wait for the end, and return the exit code."""
        code = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code

    def kill(self):
        """Kill it if it still runs, and close its pipe."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        self.process.stderr.close()

    def assert_quiet(self):
        """Check that stderr shows no unforeseen error."""
        assert not [word for word in NOISE if word in self.said], self.said

    def __enter__(self):
        try:
            self.wait_until_ready()
        except BaseException:
            self.kill()
            raise
        return self

    def __exit__(self, *error):
        try:
            if self.process.poll() is None:
                assert self.end() == 0, self.said
            self.assert_quiet()
        finally:
            self.kill()

    def _read(self):
        for line in self.process.stderr:
            with self._news:
                self.lines.append(line)
                self._news.notify_all()
        with self._news:
            self._news.notify_all()
