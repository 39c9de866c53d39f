"""Draw small random faults in the product, and check whether its tests find them; all refers to the last commit.

    python -m tools.mutants draw LIST.json COUNT SEED           draw mutants, or replace those of LIST that are gone
    python -m tools.mutants run LIST.json FOLDER [NUMBER ...]    run all or some, and write the outcomes into LIST

FOLDER is the output of `tools.executed`. That records neither kernels nor uses of values computed at import.
The tests of such a line are those that execute a line which mentions the kernel or the name, or else any line
of the file.
"""

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tools.executed import ROOT, executed, shortest
from tools.mutations import SOURCES, Mutant, product

LIMIT, HANGS, COMPILING = 60.0, 20, 400.0
"""Time limits of a run of pytest, of one test in it, and of compiling the kernels beforehand [s]."""
SAME = ("file", "owner", "text", "kind", "before", "after")
"""Fields by which a mutant is found again when its line has moved."""


def draw(path: Path, count: int, seed: int) -> list[Mutant]:
    """Keep the mutants of a list whose line still exists, and draw the others."""
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
    return drawn


def tests_of(mutant: Mutant, folder: Path) -> set[str]:
    """Return the tests that execute a mutant."""
    lines, span = executed(folder, mutant["file"]), range(mutant["span"][0], mutant["span"][1] + 1)
    found = {one for line in span for one in lines.get(line, ()) if not mutant["hidden"]}
    waiting = [] if found else [mutant["owner"]]
    for name in waiting:  # it grows in the loop
        for place in product()[1][name]:
            if not place["hidden"]:
                found |= executed(folder, place["file"]).get(place["line"], set())
            elif place["owner"] not in waiting:
                waiting.append(place["owner"])
    return found or set().union(*lines.values())


def ran(where: Path, tests: list[str]) -> tuple[int | None, str]:
    """Compile changed kernels, and run tests until one fails; return the result of `ended`."""
    for kernel in (one for source in SOURCES for one in (ROOT / source).rglob("*.kernel")):
        (where / kernel.relative_to(ROOT).parent).mkdir(exist_ok=True)
        shutil.copy2(kernel, where / kernel.relative_to(ROOT))
    ended(where, COMPILING, "tvist_cli", "serve", "--compile", "2")
    listed = where.parent / "tests"
    listed.write_text("\n".join(tests), encoding="utf-8")
    return ended(
        where, LIMIT, "pytest", "-xq", "-rfE", "-pno:cacheprovider", f"--timeout={HANGS}", f"@{listed}"
    )


def ended(where: Path, limit: float, *words: str) -> tuple[int | None, str]:
    """Run a program of the copy; return its exit code (None if it had to be killed) and its output."""
    paths = os.pathsep.join(str(where / one) for one in ["", *SOURCES])  # they precede the checkout's
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
    """Run a mutant's tests; a test that fails without the mutant, too, does not count."""
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


def main(what: str, path: Path, *more: str) -> None:
    """Draw mutants or run them."""
    if what == "draw":
        drawn = draw(path, *map(int, more))
        path.write_text(json.dumps(drawn, indent=1, ensure_ascii=False), encoding="utf-8")
        return
    mutants, numbers = json.loads(path.read_text(encoding="utf-8")), [int(one) for one in more[1:]]
    with tempfile.TemporaryDirectory() as temporary:
        where = Path(temporary) / "copy"
        subprocess.run(["git", "worktree", "add", "--detach", where], cwd=ROOT, check=True)
        try:
            for number in numbers or range(len(mutants)):
                one = mutants[number]
                one |= judged(one, where, Path(more[0]).resolve())
                told = (one[key] for key in ("outcome", "file", "line", "before", "after"))
                print(number, *told, flush=True)
                path.write_text(json.dumps(mutants, indent=1, ensure_ascii=False), encoding="utf-8")
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", where], cwd=ROOT, check=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
