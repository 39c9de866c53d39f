"""`python -m tools.kernels`: what each kernel of a served robot costs to compile and to load, and which ones call it.

Compiles everything once in a folder of its own, which takes a minute or two, and loads it again in a second process.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table

Costs = dict[str, dict[str, Any]]
"""For each kernel: `seconds` of processor time, without those of the kernels that it calls, `times`, and `callers`."""


def measured() -> Costs:
    """Compile or load in this process what a served robot calls; what is on disk is loaded."""
    from numba.core.dispatcher import Dispatcher

    from tvist_server.kernels import PARTS

    costs: Costs = defaultdict(lambda: {"seconds": 0.0, "times": 0, "callers": []})
    inner: list[tuple[str, list[float]]] = []
    compile_one: Callable[..., Any] = Dispatcher.compile

    def watched(self: Any, sig: object) -> Any:
        if sig in self.overloads:
            return compile_one(self, sig)
        name = f"{self.py_func.__module__}.{self.py_func.__qualname__}"
        within: list[float] = []
        callers = costs[name]["callers"]
        caller = inner[-1][0] if inner else "Python"
        if caller not in callers:
            callers.append(caller)
        inner.append((name, within))
        began = time.process_time()
        try:
            return compile_one(self, sig)
        finally:
            took = time.process_time() - began
            inner.pop()
            costs[name]["seconds"] += took - sum(within)
            costs[name]["times"] += 1
            if inner:
                inner[-1][1].append(took)

    Dispatcher.compile = watched  # type: ignore[method-assign]
    for part in PARTS.values():
        part()
    return costs


def _elsewhere(folder: str) -> Costs:
    """Measure in a process whose kernels are in a folder."""
    found = subprocess.run(
        [sys.executable, "-m", "tools.kernels", "--here"],
        env={**os.environ, "NUMBA_CACHE_DIR": folder},
        stdout=subprocess.PIPE,
        check=True,
    )
    costs: Costs = json.loads(found.stdout)
    return costs


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tools.kernels", description=__doc__)
    parser.add_argument("--here", action="store_true", help="measure this process, and print JSON")
    if parser.parse_args().here:
        print(json.dumps(measured()))
        return
    with TemporaryDirectory() as folder:
        compiled, loaded = _elsewhere(folder), _elsewhere(folder)
    table = Table("kernel", "compile [s]", "types", "load [ms]", "called by")
    for name, cost in sorted(compiled.items(), key=lambda one: -one[1]["seconds"]):
        load = f"{1e3 * loaded[name]['seconds']:.1f}" if name in loaded else ""
        callers = ", ".join(caller.rpartition(".")[2] for caller in cost["callers"])
        table.add_row(name.partition("_")[2], f"{cost['seconds']:.2f}", str(cost["times"]), load, callers)
    together = [f"{sum(cost['seconds'] for cost in costs.values()):.2f}" for costs in (compiled, loaded)]
    table.add_row("all", together[0], "", f"{1e3 * float(together[1]):.0f}", "")
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
