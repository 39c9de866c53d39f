"""The program `tvist`, and its output."""

import json
import subprocess
import sys
from typing import NamedTuple

from tests import forked
from tests.conformance.served import NOISE, finished


class Ended(NamedTuple):
    code: int
    out: str
    err: str

    @property
    def json(self):
        """Return the only JSON object on stdout."""
        (line,) = self.out.splitlines()
        value = json.loads(line)
        assert isinstance(value, dict)
        return value

    def assert_failed(self, code, *words):
        """It ended with this exit code and one line on stderr that has these words."""
        assert self.code == code, self.err
        assert self.err.startswith("tvist: ")
        assert self.err.count("\n") == 1, self.err
        assert all(word in self.err for word in words), self.err
        return self

    def assert_done(self):
        assert self.code == 0, self.err
        assert not [word for word in NOISE if word in self.err], self.err
        return self


def python(*arguments, **options):
    done = finished(*arguments, **options)
    return Ended(done.returncode, done.stdout, done.stderr)


def tvist(*arguments, **options):
    return python("-m", "tvist_cli", *arguments, **options)


class Begun(forked.Popen):
    def __exit__(self, *error):
        self.kill()
        super().__exit__(*error)


def begun(*arguments, **options):
    """Start the program, and return its process; a `with` kills it at its end."""
    words = [sys.executable, "-m", "tvist_cli", *map(str, arguments)]
    return Begun(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
