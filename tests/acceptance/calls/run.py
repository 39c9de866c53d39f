"""Run calls of a client against a robot: python run.py CALLS HOST; each answer is a line NAME, tab, what came of it.

A line `> CODE` prepares; a line `NAME: EXPRESSION` has worked if its value is true.
"""

import sys
from pathlib import Path

told = {"HOST": sys.argv[2]}
for line in Path(sys.argv[1]).read_text().splitlines():
    name, _, code = line.partition(" ")
    try:
        if name == ">":
            exec(code, told)  # noqa: S102  that is what the file is for
        elif name:
            value = eval(code, told)  # noqa: S307
            print(name.removesuffix(":"), "passed" if value else f"is {value!s:.60}", sep="\t", flush=True)
    except Exception as error:  # noqa: BLE001
        print(name.removesuffix(":"), f"raises {error!s:.160}", sep="\t", flush=True)
