"""One first command, tried in an empty folder with an installed environment."""

import contextlib
import shlex
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

from tools.release.environments import FailedError, run
from tools.release.first_commands import First, fences

PATIENCE_S = 900.0
"""After how long a command is taken to hang, on a busy machine with two cores."""


def attempt(
    first: First, root: Path, folder: Path, python: Callable[[str], Path], env: dict[str, str]
) -> None:
    """Do the first command of a page.

    Args:
        first: The command, and what it needs.
        root: Folder of the checkout, for its files.
        folder: Where it runs, an empty folder.
        python: Tells the folder of programs of the environment of an installation.
        env: Variables of its process.

    Raises:
        FailedError: It, or what it needs, did not do as it should; or ended with an exit code other than 0.
    """
    for name, source in first.files.items():
        _write(folder / name, source, root, first.page)
    programs = python(first.install)
    with contextlib.ExitStack() as beside:
        if first.robot is not None:
            serve = [str(python("tvist[server]") / "tvist"), "serve", *first.robot]
            beside.enter_context(_listening(serve, folder, env))
        for command in filter(None, (first.before, first.command)):
            program, *rest = shlex.split(command)
            words = [str(programs / program), *rest]
            if first.listens and command == first.command:
                beside.enter_context(_listening(words, folder, env))
            else:
                run(*words, cwd=folder, env=env, seconds=PATIENCE_S)


def _write(file: Path, source: str, root: Path, page: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    if (root / source).is_file():
        file.write_bytes((root / source).read_bytes())
    else:
        shown = fences((root / page).read_text(encoding="utf-8"))
        file.write_text(next(text for kind, text in shown if kind == source), encoding="utf-8")


@contextlib.contextmanager
def _listening(words: list[str], folder: Path, env: dict[str, str]) -> Iterator[None]:
    """Start a server, wait until it says that it listens, and end it with SIGTERM and exit code 0 after all."""
    process = subprocess.Popen(
        words, cwd=folder, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    timer = threading.Timer(PATIENCE_S, process.kill)
    timer.start()
    said = []
    with process:
        try:
            for line in process.stderr or ():
                said.append(line)
                if "listens on" in line:
                    break
            else:
                raise FailedError(f"exit code {process.wait()} before it listened: {''.join(said)}")
            yield
            process.terminate()
            said.append(process.communicate()[1])
        finally:
            process.kill()
            timer.cancel()
    if process.returncode:
        raise FailedError(f"exit code {process.returncode} after SIGTERM: {''.join(said)}")
