"""An object of ur-rtde in a process of its own, since its threads may outlive it, and the calls to it.

python ur_caller.py MODULE CLASS ADDRESS [NUMBER]

Reads calls, one JSON list [METHOD, ARGUMENT…] a line, and prints what each returned, {"returned": …}, or raised,
{"raised": …}; first of all what came of making the object.
"""

import importlib
import json
import os
import sys


def answer(call, *arguments):
    """Whether it went well."""
    try:
        said = {"returned": call(*arguments)}
    except Exception as error:  # noqa: BLE001  whoever asked is told
        said = {"raised": str(error)}
    print(json.dumps(said), flush=True)  # noqa: T201  that is how
    return "returned" in said


def main(module, kind, address, *numbers):
    made, numbers = [], map(float, numbers)
    if answer(lambda: made.append(getattr(importlib.import_module(module), kind)(address, *numbers))):
        for line in sys.stdin:
            method, *arguments = json.loads(line)
            answer(getattr(made[0], method), *arguments)
    os._exit(0)


main(*sys.argv[1:])
