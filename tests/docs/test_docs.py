"""The documentation is correct: snippets run, commands and options exist, links have targets."""

import doctest
import functools
import html
import importlib.util
import io
import itertools
import json
import os
import re
import shlex
import signal
import textwrap
import tomllib
from importlib.metadata import entry_points
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from rich.console import Console
from tests.acceptance import report
from tests.conformance.conftest import realtime  # noqa: F401  a fixture
from tests.conformance.served import Served, finished
from tests.fences import FENCE
from tests.places import own_address

from tvist_cli.main import application
from tvist_client.blocking import Robot

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIAL = DOCS / "tutorials" / "first-motion.md"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
LINKED = sorted({*PAGES, *ROOT.glob("*.md"), *ROOT.glob("*/README.md"), *ROOT.glob("*/*/README.md")})
ENDPOINT = "tcp/127.0.0.1:7447"

LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
TEXTS = [page.read_text(encoding="utf-8") for page in PAGES]
SAVED = {name for text in TEXTS for name in re.findall(r"[Ss]ave this as `([\w.]+)`", text)}
"""Files that readers save according to pages."""
SPAN = re.compile(r"`(?P<code>tvist [a-z][^`]*)`")


def named(path):
    return str(path.relative_to(ROOT))


def blocks(*kinds):
    """Return each fenced block of these kinds as a parameter, with page and line as id."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in FENCE.finditer(text):
            if match["kind"] in kinds:
                line = text.count("\n", 0, match.start()) + 1
                found.append(pytest.param(textwrap.dedent(match["text"]), id=f"{named(page)}:{line}"))
    return found


def without_code(text):
    return re.sub(r"`[^`\n]*`", "", FENCE.sub("", text))


def run(*arguments, cwd=ROOT):
    """Run a Python program, which must succeed; return its stdout."""
    ended = finished(*arguments, cwd=cwd, env={**os.environ, "COLUMNS": "100"})
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


class TestLinks:
    @pytest.mark.parametrize("page", LINKED, ids=named)
    def test_each_link_leads_to_an_existing_file_and_heading(self, page):
        for match in LINK.finditer(without_code(page.read_text(encoding="utf-8"))):
            target, _, anchor = match["target"].partition("#")
            if target.startswith(("http://", "https://")):
                address = urlsplit(target)
                assert address.scheme == "https", f"{named(page)} links to {target}, which is not encrypted"
                assert re.fullmatch(r"[\w-]+(\.[\w-]+)+", address.netloc), f"{named(page)} links to {target}"
                continue
            linked = (page.parent / target).resolve() if target else page
            assert linked.exists(), f"{named(page)} links to {match['target']}"
            assert linked.is_relative_to(ROOT), f"{named(page)} links out of the project"
            if linked.suffix == ".html":  # the part behind # is an argument of the page
                continue
            assert not anchor or anchor in anchors(linked), f"{named(page)} links to {match['target']}"

    def test_index_names_each_page(self):
        index = DOCS / "README.md"
        text = index.read_text(encoding="utf-8")
        linked = {(DOCS / match["target"]).resolve() for match in LINK.finditer(text)}
        assert set(DOCS.rglob("*.md")) - linked == {index}

    @pytest.mark.parametrize("page", LINKED, ids=named)
    def test_each_row_of_a_table_has_as_many_cells_as_its_header(self, page):
        rows = [cells(line) for line in page.read_text(encoding="utf-8").splitlines()]
        for number, (above, row) in enumerate(itertools.pairwise(rows), start=2):
            assert 0 in {above, row} or above == row, f"{named(page)}:{number} has {row} cells, not {above}"

    def test_picture_of_the_packages_equals_the_import_contract(self):
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
        contract = project["tool"]["importlinter"]["contracts"][0]
        layers = [layer.split(" | ") for layer in contract["layers"]]
        picture = (DOCS / "images" / "architecture.svg").read_text(encoding="utf-8")
        rows = [re.findall(r">(tvist_\w+)<", line) for line in picture.splitlines()]
        drawn = [row for row in rows if row]
        assert drawn == layers

    def test_picture_of_the_protocol_has_its_keys_and_senders(self):
        text = (DOCS / "reference" / "generated" / "protocol.md").read_text(encoding="utf-8")
        keys = dict(re.findall(r"^\| `tvist/<robot>/([^`]+)` \| \w+ \| (\w+) \|", text, re.MULTILINE))
        picture = (DOCS / "images" / "protocol.svg").read_text(encoding="utf-8")
        arrows = re.findall(r'd="M(150|600),\d+H\d+"/>\n<text[^>]*>([^<]+)<', picture)
        drawn = {html.unescape(key): "client" if x == "150" else "server" for x, key in arrows}
        assert drawn == keys

    def test_readme_counts_the_mismatches_of_the_paper_page(self):
        origin = "(fitted|tuned|predicted|not matched)"
        page = (DOCS / "results" / "paper.md").read_text(encoding="utf-8")
        rows = re.findall(rf"\| {origin} \| [^|]+ \| {origin} \|$", page, re.MULTILINE)
        first, second = zip(*rows, strict=True)
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        pattern = r"Of (\d+) comparable figures.* misses (\d+),.* motors, (\d+):"
        said = re.search(pattern, readme, re.DOTALL)
        counted = [len(first), first.count("not matched"), second.count("not matched")]
        assert counted == list(map(int, said.groups()))

    @pytest.mark.parametrize("page", [page for page in LINKED if page.name != "CHANGELOG.md"], ids=named)
    def test_page_with_an_install_command_links_to_the_installation(self, page):
        text = page.read_text(encoding="utf-8")
        if re.search(r"pip install [\"']?tvist", text) and page != DOCS / "how-to" / "install.md":
            assert "how-to/install.md" in text or "(install.md)" in text


def cells(line):
    """Return the number of cells of a table's row; 0 for any other line."""
    return len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else 0


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


class TestCommands:
    @pytest.mark.parametrize("text", blocks("sh"))
    def test_commands_in_blocks_and_their_options_exist(self, text):
        for line in text.splitlines():
            if words := shlex.split(line, comments=True):
                check_command(words)

    @pytest.mark.parametrize("page", PAGES, ids=named)
    def test_commands_in_sentences_and_their_options_exist(self, page):
        for match in SPAN.finditer(FENCE.sub("", page.read_text(encoding="utf-8"))):
            check_command(shlex.split(match["code"]))


def check_command(words):
    program, *arguments = words
    match program.removeprefix(".venv/bin/"):
        case "tvist" | "marimo" as name:
            verbs = list(itertools.takewhile(lambda word: re.fullmatch(r"[a-z][\w-]*,?", word), arguments))
            words = None if name == "marimo" else 1 + (verbs[:1] == ["log"])
            verbs = [word.rstrip(",") for word in verbs][:words]
            unknown = {word for word in arguments if word.startswith("--")} - options(name, *verbs)
            assert not unknown, f"{name} {' '.join(verbs)} does not know {unknown}"
            assert all((ROOT / word).exists() for word in arguments if word.startswith("lab/"))
        case "make":
            targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
            assert {word for word in arguments if "=" not in word} <= set(targets)
        case "python" if arguments[0] == "-m":
            assert importlib.util.find_spec(arguments[1]) is not None, arguments[1]
        case "python" | "cp":
            assert (ROOT / arguments[0]).exists() or arguments[0] in SAVED, arguments[0]
        case ".":
            assert arguments == [".venv/bin/activate"]
        case _:
            raise AssertionError(f"nobody checks {shlex.join(words)}")


@functools.cache
def options(program, *verbs):
    if program == "tvist":
        stream = io.StringIO()
        application(verbs).help_print(verbs, console=Console(file=stream, width=100))
        told = stream.getvalue()
        assert f"tvist {' '.join(verbs)}" in told
        return set(re.findall(r"--[\w-]+", told))
    (script,) = entry_points(group="console_scripts", name=program)
    command = script.load()
    for verb in verbs:
        command = command.commands[verb]
    return {option for parameter in command.params for option in parameter.opts}


@pytest.fixture(scope="module")
def interfaces():
    """Address of a robot whose UR interfaces are open."""
    pytest.importorskip("rtde_receive")
    address = own_address(1)
    with Served("--ur", "--ur-address", address):
        yield address


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """Folder and output of the tutorial's commands."""
    folder = tmp_path_factory.mktemp("tutorial")
    text = TUTORIAL.read_text(encoding="utf-8")
    shell = "".join(match["text"] for match in FENCE.finditer(text) if match["kind"] == "sh")
    lines = [shlex.split(line, comments=True) for line in shell.splitlines()]
    commands = [words[1:] for words in lines if words and words[0] == "tvist"]
    (_, *how), *rest = commands
    assert commands[0][0] == "serve"
    recording = how.index("--record") + 1
    how[recording] = str(folder / how[recording])
    said = []
    with Served(*how) as served:
        endpoint = served.endpoint
        at = {"move": ["--endpoint", endpoint], "check": [endpoint], "watch": [endpoint, "--seconds", "1"]}
        for words in rest:
            if words[0] == "log" and served.process.poll() is None:
                assert served.end(signal.SIGINT) == 0
            said.append((words, run("-m", "tvist_cli", *words, *at.get(words[0], ()), cwd=folder)))
            if words[0] == "move":  # wait for a second, like a person
                with Robot.connect(endpoint) as robot:
                    robot.advance(500)
    return folder, said


@pytest.mark.realtime
@pytest.mark.nightly
def test_first_motion_tutorial_works_and_shaping_reduces_the_vibration(story):
    folder, said = story
    assert [words[0] for words, _ in said] == ["check", "watch", *["move"] * 4, "log", "log"]
    assert "every state equal to the last bit" in said[-1][1]
    for name in re.findall(r"first-figures/\w+\.png", TUTORIAL.read_text(encoding="utf-8")):
        assert (folder / name).exists()
    found = json.loads(run("-m", "tvist_cli", "log", "analyze", "first.mcap", "--json", cwd=folder))
    unshaped, shaped = found["motions"][:2], found["motions"][2:]
    for before, after in zip(unshaped, shaped, strict=True):
        assert after["delay_ms"] == pytest.approx(72, abs=4)
        assert after["residual_vibration_m_s2"] < 0.25 * before["residual_vibration_m_s2"]
        assert after["still_after_ms"] < before["still_after_ms"] - 40


class TestSnippets:
    @pytest.mark.parametrize("text", blocks("pycon"))
    def test_sessions_have_the_documented_output(self, text):
        examples = doctest.DocTestParser().get_doctest(text, {}, "snippet", None, 0)
        results = doctest.DocTestRunner().run(examples)
        assert results.attempted > 0
        assert results.failed == 0

    @pytest.mark.parametrize("package", ["shaping", "sim_plant"])
    def test_session_of_a_package_readme_has_the_documented_output(self, package):
        results = doctest.testfile(str(ROOT / package / "README.md"), module_relative=False)
        assert results.attempted > 5
        assert results.failed == 0

    @pytest.mark.realtime
    @pytest.mark.nightly
    @pytest.mark.parametrize("text", blocks("python"))
    def test_scripts_run(self, text, request, tmp_path):
        folder = ROOT
        if "Robot.connect()" in text or ENDPOINT in text:
            endpoint = request.getfixturevalue("realtime").endpoint
            text = text.replace("Robot.connect()", f'Robot.connect("{endpoint}")').replace(ENDPOINT, endpoint)
        if '"127.0.0.1"' in text:
            text = text.replace("127.0.0.1", request.getfixturevalue("interfaces"))
        if "import urx" in text:
            pytest.importorskip("urx")  # it needs older packages
        if "mine.py" in text:
            pytest.skip("test_tutorials.py runs it with its file")
        if "127.0.0.10" in text or "127.0.0.20" in text:
            pytest.skip("test_rehearsal.py runs it in the order of its page")
        if "first.mcap" in text:
            folder = request.getfixturevalue("story")[0]
        script = tmp_path / "test_snippet.py"
        script.write_text(text, encoding="utf-8")
        if "def test_" in text:
            (tmp_path / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
            run("-m", "pytest", "-q", "-p", "no:cacheprovider", script, cwd=tmp_path)
        else:
            run("-W", "error", script, cwd=folder)


def test_page_of_tested_clients_has_the_results_of_the_acceptance_tests():
    page = report.PAGE.read_text()
    assert report.with_results(page, json.loads(report.RESULTS.read_text())) == page
    assert page.count(report.BEGIN) == page.count(report.END) == 1
