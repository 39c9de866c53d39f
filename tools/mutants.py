"""Draw mutants of the product's last commit, and check whether the tests of that commit find them.

A mutant changes one operator, constant or branch. Before you run mutants, record with `tools.executed` which
test executes which line. Lines in kernels and lines that run at import are not recorded. Their tests are
those that execute a line which mentions the kernel or the assigned name, or if none does, any line of the
file.
"""

import ast
import copy
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

from cyclopts import App

from tools.executed import ROOT, executed, shortest

LIMIT, HANGS, COMPILING = 60.0, 20, 400.0
"""Time limits of a run of pytest, of one test in it, and of compiling the kernels beforehand [s]."""
SAME = ("file", "owner", "text", "kind", "before", "after")
"""Fields by which a mutant is found again when its line has moved."""
SOURCES = (
    "cli", "clients", "controller", "lab", "protocol", "shaping", "sim_plant", "testing", "tvist_server", "urscript",
    "view",
)  # fmt: skip
PAIRS = (
    "Lt LtE", "Gt GtE", "Eq NotEq", "Is IsNot", "In NotIn", "And Or", "Add Sub", "Mult Div", "FloorDiv Mult",
    "Mod Mult", "Pow Mult", "USub UAdd",
)  # fmt: skip
"""Operators that replace each other. `|` and `&` are left out, since they mostly occur in types."""
OTHER = {new: old for old, new in map(str.split, PAIRS[:8])} | dict(map(str.split, PAIRS))
Mutant = dict[str, Any]
app = App(name="python -m tools.mutants", help=__doc__)


def walk(node: ast.AST, owner: str, hidden: bool, span: tuple[int, int]) -> Iterator[tuple[ast.AST, Mutant]]:
    """Yield nodes that run, each with its function or variable, whether coverage misses it, and its lines."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.If) and "TYPE_CH" in ast.unparse(node.test)):
        return  # positions in f-strings are wrong before Python 3.12
    if isinstance(node, ast.stmt):
        body = getattr(node, "body", None)
        span = node.lineno, max(node.lineno, body[0].lineno - 1 if body else node.end_lineno or 0)
    if isinstance(node, ast.Assign | ast.AnnAssign) and hidden and not owner:
        owner = ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
    yield node, {"owner": owner, "hidden": hidden, "span": span}
    for field, value in ast.iter_fields(node):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            kernel = any("compiled" in ast.unparse(one) for one in node.decorator_list)
            owner, hidden = node.name, kernel or field != "body"
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and field not in {"annotation", "returns"}:
                yield from walk(child, owner, hidden, span)


def changes(node: ast.AST) -> Iterator[tuple[str, Any, str]]:
    """Yield the mutants of a node: kind, the replaced node, and its replacement."""
    if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
        yield "branch", node.test, f"(not ({ast.unparse(node.test)}))"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        yield "constant", node, repr(not node.value if isinstance(node.value, bool) else node.value * 2 or 1)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield "operator", node, f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Compare | ast.BinOp | ast.BoolOp | ast.UnaryOp | ast.AugAssign):
        other: Any = copy.copy(node)
        operator = type(node.ops[0] if isinstance(node, ast.Compare) else node.op).__name__
        if operator in OTHER:
            changed = getattr(ast, OTHER[operator])()
            other.op, other.ops = changed, [changed, *getattr(node, "ops", ())[1:]]
            after = ast.unparse(other)
            yield "operator", node, after if isinstance(node, ast.stmt) else f"({after})"


@cache
def product() -> tuple[list[Mutant], dict[str, list[Mutant]]]:
    """Return all mutants, and for each name the places that mention it."""
    command = ["git", "ls-files", *(f"{source}/tvist_*.py" for source in SOURCES)]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    mutants, mentions = [], defaultdict(list)
    for file in listed.stdout.split():
        text = (ROOT / file).read_bytes()
        lines = text.splitlines(keepends=True)
        starts = list(accumulate(map(len, lines), initial=0))
        for node, place in walk(ast.parse(text), "", True, (0, 0)):
            if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Load):
                name = node.id if isinstance(node, ast.Name) else node.attr
                mentions[name].append({"file": file, "line": node.lineno, **place})
            for kind, old, after in changes(node):
                start = starts[old.lineno - 1] + old.col_offset
                end = starts[old.end_lineno - 1] + old.end_col_offset
                line, before = lines[old.lineno - 1].decode().strip(), text[start:end].decode()
                where = {"file": file, "line": old.lineno, "column": old.col_offset, "text": line}
                mutants.append({**where, "kind": kind, "before": before, "after": after, **place})
    return mutants, mentions


@app.command
def draw(path: Path, count: int, seed: int) -> None:
    """Draw mutants into the file PATH; one that it already has stays if its line still exists."""
    listed = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    mutants, chosen, drawn = product()[0], random.Random(seed + len(listed)), []  # noqa: S311
    for old in listed:
        same = [new for new in mutants if all(new[name] == old[name] for name in SAME)]
        drawn += sorted(same, key=lambda new: [abs(new[way] - old[way]) for way in ("line", "column")])[:1]
    print(f"{len(drawn)} of {len(listed)} are still there; {count - len(drawn)} are drawn")
    while len(drawn) < count:
        kind = chosen.choice(("operator", "constant", "branch"))
        new = chosen.choice([one for one in mutants if one["kind"] == kind])
        drawn += [new] if new not in drawn else []
    write(path, drawn)


def write(path: Path, mutants: list[Mutant]) -> None:
    """Write a list of mutants."""
    path.write_text(json.dumps(mutants, indent=1, ensure_ascii=False), encoding="utf-8")


def tests_of(mutant: Mutant, folder: Path) -> set[str]:
    """Return the tests that execute a mutant."""
    lines, span = executed(folder, mutant["file"]), range(mutant["span"][0], mutant["span"][1] + 1)
    found = {one for line in span for one in lines.get(line, ()) if not mutant["hidden"]}
    waiting = [] if found else [mutant["owner"]]
    for name in waiting:  # the loop extends this list
        for place in product()[1][name]:
            if not place["hidden"]:
                found |= executed(folder, place["file"]).get(place["line"], set())
            elif place["owner"] not in waiting:
                waiting.append(place["owner"])
    return found or set().union(*lines.values())


def ran(where: Path, tests: list[str]) -> tuple[int | None, str]:
    """Compile changed kernels, and run tests until one fails; return the result of `ended`."""
    ended(where, COMPILING, "tvist_cli", "serve", "--compile", "2")
    listed = where.parent / "tests"
    listed.write_text("\n".join(tests), encoding="utf-8")
    return ended(
        where, LIMIT, "pytest", "-xq", "-rfE", "-pno:cacheprovider", f"--timeout={HANGS}", f"@{listed}"
    )


def ended(where: Path, limit: float, *words: str) -> tuple[int | None, str]:
    """Run a program of the copy; return its exit code (None if it had to be killed) and its output."""
    paths = os.pathsep.join(str(where / one) for one in ["", *SOURCES])  # before those of the checkout
    around = {**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(
            [sys.executable, "-m", *words], cwd=where, env=around, stdout=out, stderr=out, process_group=0
        )
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            code = None
        out.seek(0)
        return code, out.read().decode(errors="replace")


def judged(mutant: Mutant, where: Path, folder: Path) -> Mutant:
    """Run a mutant's tests; ignore tests that also fail without the mutant."""
    there, tests, file = tests_of(mutant, folder), [], where / mutant["file"]
    whole, before, start = file.read_bytes(), mutant["before"].encode(), time.monotonic()
    at = sum(map(len, whole.splitlines(keepends=True)[: mutant["line"] - 1])) + mutant["column"]
    assert whole[at:].startswith(before), "the checkout differs from its last commit"
    changed = whole[:at] + mutant["after"].encode() + whole[at + len(before) :]
    while tests := shortest(there, LIMIT / 2):
        file.write_bytes(changed)
        code, said = ran(where, tests)
        file.write_bytes(whole)
        failed = re.findall(r"^(?:FAILED|ERROR) (tests/\S+::.*?)(?: - .*)?$", said, re.MULTILINE)[:1]
        gone = re.findall(r"not found: \S*?(tests/[^[\n]*)", said)
        missing = {one for one in tests if one.partition("[")[0] in gone}
        if not missing and (code != 1 or not failed or ran(where, failed)[0] == 0):
            hung = code is None or "Timeout (>" in said
            outcome = "timed out" if hung else "survived" if code == 0 else "found"
            took, of = round(time.monotonic() - start, 1), [len(tests), len(there)]
            return {"outcome": outcome, "by": failed or said.splitlines()[-1:], "tests": of, "seconds": took}
        there -= missing or {*failed, failed[0].partition("::")[0]}
    return {"outcome": "no test"}


@app.command(name="run")
def run_all(path: Path, folder: Path, *numbers: int) -> None:
    """Run mutants of the file PATH, all or some by number, and write the outcomes into it.

    FOLDER is the output of `tools.executed`.
    """
    mutants = json.loads(path.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as temporary:
        where = Path(temporary) / "copy"
        subprocess.run(["git", "worktree", "add", "--detach", where], cwd=ROOT, check=True)
        try:
            for number in numbers or range(len(mutants)):
                one = mutants[number]
                one |= judged(one, where, folder.resolve())
                told = (one[key] for key in ("outcome", "file", "line", "before", "after"))
                print(number, *told, flush=True)
                write(path, mutants)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", where], cwd=ROOT, check=True)


if __name__ == "__main__":
    app()
