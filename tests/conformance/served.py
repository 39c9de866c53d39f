"""`tvist serve`: a process, a free port, and what it says on stderr."""

import os
import signal
import subprocess
import sys
import threading

from tests import forked
from tests.places import free_endpoint

PATIENCE = 300.0
"""After how long something is taken to hang [s], on the slowest of machines: no test looks at how fast it is."""
NOISE = ("Traceback", "leaked", "nanobind", "Exception ignored", "Fatal Python error", "panicked")
"""What no process says that ended well."""


def finished(*words, timeout=PATIENCE, run=forked.run, **more):
    """A program of Python's that has ended, well or not: its exit code, and what it said."""
    command = [sys.executable, *map(str, words)]
    return run(command, capture_output=True, text=True, timeout=timeout, check=False, **more)


def refused_to_start(*options, endpoint=None):
    """What `tvist serve` says when it does not begin, and its exit code."""
    with_port = ("--listen", endpoint or free_endpoint())
    refused = finished("-m", "tvist_cli", "serve", *with_port, *options)
    assert refused.stdout == ""
    assert refused.stderr.count("\n") == 1, refused.stderr
    assert refused.stderr.startswith("tvist: ")
    return refused.returncode, refused.stderr


class Served:
    """A robot in a process of its own; several where there is no name but the option --robots.

    Args:
        options: Further options.
        name: Name of the robot.
        endpoint: Where it listens.
        router: Where it connects to instead.
        around: Words before the command line, such as `ip netns exec`.
        cold: Whether it starts from nothing, as its environment or its start matters.
        python: The Python of another environment that runs it; it then starts from nothing.
    """

    program = ("-m", "tvist_cli", "serve")  # what Python runs

    def __init__(self, *options, name="ur5e", endpoint=None, router=None, around=(), cold=False, python=None):
        self.name, self.endpoint = name, router or endpoint or free_endpoint()
        self.lines = []
        where = "--listen" if router is None else "--connect"
        named = () if name is None else ("--name", name)
        self._news = threading.Condition()
        start = subprocess.Popen if around or cold or python else forked.Popen
        self.process = start(
            [*around, python or sys.executable, *self.program, where, self.endpoint, *named, *options],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_until_ready(self):
        """Wait until it says that it listens."""

        def said():
            return any("listens " in line for line in self.lines) or not self._reader.is_alive()

        with self._news:
            listens = self._news.wait_for(said, PATIENCE) and "listens " in self.said
        if not listens:
            self.kill()
            raise AssertionError(f"tvist serve did not come up: {self.said}")

    def wait_until_said(self, words):
        """Wait until it says something on stderr."""
        with self._news:
            assert self._news.wait_for(lambda: words in self.said, PATIENCE), self.said

    @property
    def said(self):
        return "".join(self.lines)

    def end(self, number=signal.SIGTERM):
        """Send a signal and wait for the end; the exit code."""
        self.process.send_signal(number)
        return self.wait()

    def wait(self):
        """Wait for it to end; the exit code."""
        code = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code

    def kill(self):
        """Make sure that it is gone, and its pipe closed."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        self.process.stderr.close()

    def assert_quiet(self):
        """Nothing on stderr that looks like an error nobody foresaw."""
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
