"""A process with an object of ur-rtde, whose threads could outlive the test otherwise.

python ur_caller.py MODULE CLASS ADDRESS [NUMBER]

It makes the object, then reads calls from stdin, each a line with a JSON list [METHOD, ARGUMENT…].
For each step it prints {"returned": …} or {"raised": …}.
"""

import importlib
import json
import os
import sys


def answer(call, *arguments):
    """Make a call, print its result, and return whether it succeeded."""
    try:
        said = {"returned": call(*arguments)}
    except Exception as error:  # noqa: BLE001  the test reads it
        said = {"raised": str(error)}
    print(json.dumps(said), flush=True)  # noqa: T201  the test reads it
    return "returned" in said


def main(module, kind, address, *numbers):
    made, numbers = [], map(float, numbers)
    if answer(lambda: made.append(getattr(importlib.import_module(module), kind)(address, *numbers))):
        for line in sys.stdin:
            method, *arguments = json.loads(line)
            answer(getattr(made[0], method), *arguments)
    os._exit(0)


main(*sys.argv[1:])
