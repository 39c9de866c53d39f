"""docs/how-to/change-a-shaper.md, followed literally: its file is written, its commands are run in their order."""

import re
import shlex
import signal

import pytest
from tests.conformance.served import Served
from tests.docs.test_docs import DOCS, FENCE, run

from tvist_client.blocking import Robot

pytestmark = pytest.mark.realtime

PAGE = DOCS / "how-to" / "change-a-shaper.md"
TEXT = PAGE.read_text(encoding="utf-8")
NEVER_SERVED = {"shapers", "evaluate", "shaperbench", "log"}


def blocks(kind):
    return [match["text"] for match in FENCE.finditer(TEXT) if match["kind"] == kind]


def commands():
    lines = [line for block in blocks("sh") for line in block.splitlines()]
    words = [shlex.split(line, comments=True) for line in lines]
    assert all(program == "tvist" for program, *_ in words)
    return [rest for _, *rest in words]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the page's file."""
    place = tmp_path_factory.mktemp("own")
    (name,) = re.findall(r"^Save this as `(\w+\.py)`:$", TEXT, re.MULTILINE)
    (place / name).write_text(blocks("python")[0], encoding="utf-8")
    return place


@pytest.mark.nightly
def test_every_command_works_in_its_order(folder, monkeypatch):
    monkeypatch.chdir(folder)
    before = commands()[: [words[0] for words in commands()].index("serve")]
    (_, *how), *after = commands()[len(before) :]
    said = [run("-m", "tvist_cli", *words, cwd=folder) for words in before]
    with Served(*how) as served:
        assert "shaper early" in served.said
        for words in after:
            if words[0] == "log":
                assert served.end(signal.SIGINT) == 0
            at = [] if words[0] in NEVER_SERVED else ["--endpoint", served.endpoint]
            said.append(run("-m", "tvist_cli", *words, *at, cwd=folder))
            if words[0] == "move":
                with Robot.connect(served.endpoint) as robot:
                    chosen = words[words.index("--shaper") + 1] if "--shaper" in words else "early"
                    assert robot.info().shaper == chosen
                    assert "early" in robot.info().shapers
    assert [words[0] for words in [*before, *after]] == [
        "shapers", "evaluate", "evaluate", "shaperbench", "move", "move", "move", "log"
    ]  # fmt: skip
    for told, name in zip(said[:4], ("early", "early", "bell", "early"), strict=True):
        assert name in told
    assert "bell" in said[0]
    assert "every state equal to the last bit" in said[-1]


def test_the_comparison_prints_what_the_page_says(folder):
    (script,) = [text for text in blocks("python") if "asyncio.run" in text]
    (folder / "compare.py").write_text(script, encoding="utf-8")
    assert run("-W", "error", "compare.py", cwd=folder) == blocks("text")[0]
