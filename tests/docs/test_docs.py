"""The documentation is true: its snippets run, its commands and options exist, its links lead somewhere."""

import doctest
import functools
import html
import importlib.util
import itertools
import json
import os
import re
import shlex
import signal
import textwrap
import tomllib
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.acceptance import report
from tests.conformance.served import Served, finished
from tests.fences import FENCE
from tests.places import own_address

from tvist_client.blocking import Robot

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
TUTORIAL = DOCS / "tutorials" / "first-motion.md"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
LINKED = sorted(
    {
        *PAGES,
        *ROOT.glob("*.md"),
        *ROOT.glob("*/README.md"),
        *ROOT.glob("*/*/README.md"),
    }
)
ENDPOINT = "tcp/127.0.0.1:7447"

LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
SAVED = {
    name
    for page in PAGES
    for name in re.findall(r"[Ss]ave this as `([\w.]+)`", page.read_text(encoding="utf-8"))
}
"""Files that pages have their readers save."""
SPAN = re.compile(r"`(?P<code>tvist [a-z][^`]*)`")


def named(path):
    return str(path.relative_to(ROOT))


def blocks(*kinds):
    """(page, number of the line, text) of every fenced block of a kind."""
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
    """What a program of Python's says on stdout, that ends well."""
    ended = finished(*arguments, cwd=cwd, env={**os.environ, "COLUMNS": "100"})
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


class TestLinks:
    @pytest.mark.parametrize("page", LINKED, ids=named)
    def test_every_link_leads_to_a_file_and_a_heading(self, page):
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
            if linked.suffix == ".html":  # what stands behind # is what the page is to show
                continue
            assert not anchor or anchor in anchors(linked), f"{named(page)} links to {match['target']}"

    def test_the_index_names_every_page(self):
        index = DOCS / "README.md"
        text = index.read_text(encoding="utf-8")
        linked = {(DOCS / match["target"]).resolve() for match in LINK.finditer(text)}
        assert set(DOCS.rglob("*.md")) - linked == {index}

    @pytest.mark.parametrize("page", LINKED, ids=named)
    def test_every_row_of_a_table_has_the_cells_of_its_header(self, page):
        rows = [cells(line) for line in page.read_text(encoding="utf-8").splitlines()]
        for number, (above, row) in enumerate(itertools.pairwise(rows), start=2):
            assert not above or not row or above == row, (
                f"{named(page)}:{number} has {row} cells, not {above}"
            )

    def test_the_picture_of_the_packages_is_the_contract_of_imports(self):
        contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
            "importlinter"
        ]
        layers = [layer.split(" | ") for layer in contracts["contracts"][0]["layers"]]
        picture = (DOCS / "images" / "architecture.svg").read_text(encoding="utf-8")
        rows = [re.findall(r">(tvist_\w+)<", line) for line in picture.splitlines()]
        drawn = [row for row in rows if row]
        assert drawn == layers

    def test_the_picture_of_the_protocol_has_its_keys_and_who_sends_them(self):
        text = (DOCS / "reference" / "generated" / "protocol.md").read_text(encoding="utf-8")
        keys = dict(re.findall(r"^\| `tvist/<robot>/([^`]+)` \| \w+ \| (\w+) \|", text, re.MULTILINE))
        picture = (DOCS / "images" / "protocol.svg").read_text(encoding="utf-8")
        arrows = re.findall(r'd="M(150|600),\d+H\d+"/>\n<text[^>]*>([^<]+)<', picture)
        drawn = {html.unescape(key): "client" if x == "150" else "server" for x, key in arrows}
        assert drawn == keys

    def test_the_readme_counts_what_the_paper_page_does_not_match(self):
        origin = "(fitted|tuned|predicted|not matched)"
        page = (DOCS / "results" / "paper.md").read_text(encoding="utf-8")
        first, second = zip(
            *re.findall(rf"\| {origin} \| [^|]+ \| {origin} \|$", page, re.MULTILINE), strict=True
        )
        said = re.search(
            r"Of (\d+) comparable figures.* misses (\d+),.* misses (\d+):",
            (ROOT / "README.md").read_text("utf-8"),
            re.DOTALL,
        )
        counted = [len(first), first.count("not matched"), second.count("not matched")]
        assert counted == list(map(int, said.groups()))

    @pytest.mark.parametrize("page", [page for page in LINKED if page.name != "CHANGELOG.md"], ids=named)
    def test_a_page_that_installs_what_is_not_published_says_what_to_do_until_then(self, page):
        text = page.read_text(encoding="utf-8")
        if re.search(r"pip install [\"']?tvist", text) and page != DOCS / "how-to" / "install.md":
            assert "how-to/install.md" in text or "(install.md)" in text


def cells(line):
    """Number of cells of a row of a table; 0 for any other line."""
    return len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else 0


def anchors(page):
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


class TestCommands:
    @pytest.mark.parametrize("text", blocks("sh"))
    def test_commands_in_blocks_exist_with_their_options(self, text):
        for line in text.splitlines():
            if words := shlex.split(line, comments=True):
                check_command(words)

    @pytest.mark.parametrize("page", PAGES, ids=named)
    def test_commands_in_sentences_exist_with_their_options(self, page):
        for match in SPAN.finditer(FENCE.sub("", page.read_text(encoding="utf-8"))):
            check_command(shlex.split(match["code"]))


def check_command(words):
    program, *arguments = words
    match program.removeprefix(".venv/bin/"):
        case "tvist" | "marimo" | "dask" as name:
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
    told = run("-m", {"tvist": "tvist_cli"}.get(program, program), *verbs, "--help")
    assert program != "tvist" or not verbs or f"tvist {' '.join(verbs)}" in told
    return set(re.findall(r"--[\w-]+", told))


@pytest.fixture(scope="module")
def realtime():
    """A robot in real time."""
    with Served() as served:
        yield served


@pytest.fixture(scope="module")
def interfaces():
    """Address of a robot whose UR interfaces are open."""
    pytest.importorskip("rtde_receive")
    address = own_address(1)
    with Served("--ur", "--ur-address", address):
        yield address


@pytest.fixture(scope="module")
def story(tmp_path_factory):
    """What the tutorial's commands leave and say: its folder, and the words of each command."""
    folder = tmp_path_factory.mktemp("tutorial")
    text = TUTORIAL.read_text(encoding="utf-8")
    lines = [
        line for match in FENCE.finditer(text) if match["kind"] == "sh" for line in match["text"].splitlines()
    ]
    commands = [
        words[1:] for line in lines if (words := shlex.split(line, comments=True)) and words[0] == "tvist"
    ]
    (_, *how), *rest = commands
    assert commands[0][0] == "serve"
    recording = how.index("--record") + 1
    how[recording] = str(folder / how[recording])
    said = []
    with Served(*how) as served:
        for words in rest:
            if words[0] == "log" and served.process.poll() is None:
                assert served.end(signal.SIGINT) == 0
            said.append((words, tell(folder, words, served.endpoint)))
    return folder, said


def tell(folder, words, endpoint):
    """Do one of the tutorial's commands as a person would, who leaves a second between motions."""
    at = {"move": ["--endpoint", endpoint], "check": [endpoint], "watch": [endpoint, "--seconds", "1"]}
    told = run("-m", "tvist_cli", *words, *at.get(words[0], ()), cwd=folder)
    if words[0] == "move":
        with Robot.connect(endpoint) as robot:
            robot.advance(500)
    return told


@pytest.mark.realtime
@pytest.mark.nightly
class TestTutorial:
    def test_every_command_works_in_its_order(self, story):
        _, said = story
        assert [words[0] for words, _ in said] == ["check", "watch", *["move"] * 4, "log", "log"]
        assert "every state equal to the last bit" in said[-1][1]

    def test_figures_are_where_it_says(self, story):
        folder, _ = story
        for name in re.findall(r"first-figures/\w+\.png", TUTORIAL.read_text(encoding="utf-8")):
            assert (folder / name).exists()

    def test_the_shaped_motions_end_later_and_are_still_earlier(self, story):
        folder, _ = story
        found = json.loads(run("-m", "tvist_cli", "log", "analyze", "first.mcap", "--json", cwd=folder))
        unshaped, shaped = found["motions"][:2], found["motions"][2:]
        assert len(shaped) == 2
        for before, after in zip(unshaped, shaped, strict=True):
            assert after["delay_ms"] == pytest.approx(72, abs=4)
            assert after["residual_vibration_m_s2"] < 0.25 * before["residual_vibration_m_s2"]
            assert after["still_after_ms"] < before["still_after_ms"] - 40


class TestSnippets:
    @pytest.mark.parametrize("text", blocks("pycon"))
    def test_sessions_print_what_they_say(self, text):
        examples = doctest.DocTestParser().get_doctest(text, {}, "snippet", None, 0)
        results = doctest.DocTestRunner().run(examples)
        assert results.attempted > 0
        assert results.failed == 0

    @pytest.mark.parametrize("package", ["shaping", "sim_plant"])
    def test_a_package_s_readme_is_a_session_that_prints_what_it_says(self, package):
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
            pytest.importorskip("urx")  # needs older packages than this project
        if "mine.py" in text:
            pytest.skip("test_tutorials.py runs it beside its file")
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


def test_the_page_of_tested_clients_says_what_came_of_the_acceptance_tests_and_nothing_else():
    page = report.PAGE.read_text()
    assert report.with_results(page, json.loads(report.RESULTS.read_text())) == page
    assert page.count(report.BEGIN) == page.count(report.END) == 1
