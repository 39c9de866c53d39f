"""The page about a real arm, followed literally: its files are saved and its commands run in their order."""

import re
import shlex

import pytest
from tests.conformance.served import Served, finished
from tests.docs.test_docs import DOCS, FENCE
from tests.places import free_endpoint, own_address
from tests.view.browser import Page

pytestmark = [pytest.mark.realtime, pytest.mark.nightly]

ROBOT, ARM = free_endpoint(), free_endpoint()
PLACES = {
    "127.0.0.10": own_address(71), "127.0.0.20": own_address(72), "tcp/127.0.0.1:7447": ROBOT,
    "tcp/127.0.0.1:7448": ARM,
}  # fmt: skip
UNLOCK = ("-m", "tvist_cli", "unlock", "--power-on", ARM, "--name", "arm")
ATTEMPTS = 20


@pytest.fixture
def page():
    """The page, with addresses and ports of this process."""
    text = (DOCS / "how-to" / "use-a-real-arm.md").read_text(encoding="utf-8")
    for said, here in PLACES.items():
        text = text.replace(said, here)
    return text


@pytest.fixture
def served():
    """Running servers by their names."""
    running = {}
    yield running
    for server in running.values():
        server.kill()


def serve(served, words):
    """Start a server, which replaces the one of its name."""
    name = words[words.index("--name") + 1]
    if name in served:
        served.pop(name).__exit__(None, None, None)
    endpoint = ARM if ARM in words else ROBOT
    options = [word for word in words if word not in ("--listen", ARM)]
    served[name] = Served(*options, name=None, endpoint=endpoint).__enter__()


def run(words, code, *, moves):
    """Run a command until it ends with its exit code, since a machine under load may lose the moved arm."""
    for _ in range(ATTEMPTS):
        ended = finished(*words)
        if ended.returncode == code or not moves:
            break
        if not code:
            finished(*UNLOCK)
    assert ended.returncode == code, f"{words}: {ended.stdout}{ended.stderr}"
    assert "Traceback" not in ended.stderr


def test_commands_of_the_page_work_in_their_order(page, served, tmp_path, monkeypatch):
    pytest.importorskip("rtde_control")
    monkeypatch.chdir(tmp_path)
    for name, text in re.findall(r"ave this as `(\w+\.py)`.*?```python\n(.*?)```", page, re.DOTALL):
        (tmp_path / name).write_text(text, encoding="utf-8")
    moves = False
    shell = "".join(match["text"] for match in FENCE.finditer(page) if match["kind"] == "sh")
    for line in shell.splitlines():
        program, *words = shlex.split(line, comments=True)
        code = int(re.search(r"# exit code (\d)|$", line)[1] or 0)
        if words[0] == "serve" and not code:
            serve(served, words[1:])
            moves = "--enable-motion" in words
        elif words[0] == "view":
            with Page(*words[1:]):  # it comes up
                pass
        else:
            if words[0] == "log":
                served.pop("arm").__exit__(None, None, None)
            run(words if program == "python" else ("-m", "tvist_cli", *words), code, moves=moves)
    assert (tmp_path / "arm.html").stat().st_size > 0
