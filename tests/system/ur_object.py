"""Objects of ur-rtde, each in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

CALLER = Path(__file__).with_name("ur_caller.py")


class Client:
    """An object of ur-rtde with its methods. What they raise becomes an AssertionError."""

    def __init__(self, module, kind, host, *numbers):
        command = [sys.executable, CALLER, module, kind, host, *map(str, numbers)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        try:
            self._answer()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *error):
        self.process.kill()
        self.process.communicate()

    def __getattr__(self, method):
        def call(*arguments):
            self.process.stdin.write(json.dumps([method, *arguments]) + "\n")
            self.process.stdin.flush()
            return self._answer()

        return call

    def _answer(self):
        said = json.loads(self.process.stdout.readline())
        assert "raised" not in said, said["raised"]
        return said["returned"]
