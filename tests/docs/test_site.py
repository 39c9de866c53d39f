"""The site of the documentation: its navigation has each page, and it is built without warnings."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from tools.site import commands, navigation, reference, stage, tree

from tvist_cli.main import examples

ROOT = Path(__file__).parents[2]
BUILDER = ROOT / ".venv-docs" / "bin" / "python"
LOADED = re.compile(
    r"<(?:script|img|iframe|source)[^>]*\ssrc=[\"']?([^\"'\s>]+)|<link[^>]*\shref=[\"']?([^\"'\s>]+)"
)

EMPTY_ROW = re.compile(r"<tr>\s*(?:<td></td>\s*)+</tr>")
"""MkDocs adds it to a table that has only a header."""


@pytest.fixture(scope="module")
def collected():
    return tree.collect()


def listed(section):
    """Yield the paths of the pages of a navigation."""
    for item in section:
        for value in item.values():
            yield from ([value] if isinstance(value, str) else listed(value))


def test_navigation_has_each_page_once(collected):
    pages, _ = collected
    nav = list(listed(navigation.navigation([], {})))
    assert len(nav) == len(set(nav))
    named = {path.relative_to(ROOT).as_posix() for path in pages}
    linked = {"tests/acceptance/README.md", "tests/journals/README.md"}  # from the page about tests
    assert named - set(nav) <= linked


def test_navigation_has_a_section_for_each_kind_of_reader():
    titles = [title for item in navigation.navigation([], {}) for title in item]
    readers = ["Try it", "Test programs", "Quiet a robot", "Study shapers", "Simulate arms", "Operate robots"]
    assert titles == ["Home", *readers, "Commands", "API", "Project"]


def test_each_importable_package_has_a_page():
    packages = {path.parent.name for path in ROOT.glob("*/tvist_*/__init__.py")}
    modules = reference.modules()
    assert {module.name.partition(".")[0] for module in modules} == packages - reference.PROGRAMS
    assert not [module.name for module in modules if not module.about]


@pytest.mark.parametrize(
    ("repository", "shown"),
    [("", "see ci, or x"), ("https://h/o/r", "see [ci](https://h/o/r/blob/main/.ci/run), or x")],
)
def test_link_to_a_source_file_leads_to_the_repository(repository, shown, monkeypatch):
    monkeypatch.setattr(stage, "REPOSITORY", repository)
    text = "see [ci](.ci/run), or x"
    (link,) = tree.links(text)
    assert stage.to_repository(text, link.start(), link.end(), ROOT / ".ci" / "run") == shown


@pytest.mark.parametrize(("text", "targets"), [
    ("see [a](b.md) and ![c](d.png)", ["b.md", "d.png"]),
    ('<source srcset="a.webp"> <img src="b.gif">', ["a.webp", "b.gif"]), ("`[a](b.md)` is code", []),
    ("```md\n[a](b.md)\n```\n[`x`](y.md#z)", ["y.md#z"]), ("[out](https://example.org)", []),
])  # fmt: skip
def test_links_are_found_outside_code(text, targets):
    assert [match["target"] for match in tree.links(text)] == targets


@pytest.mark.parametrize("target", ["../../../etc/passwd", "missing.md"])
def test_link_without_a_target_is_refused(target):
    with pytest.raises(tree.LinkError, match=f"docs/README.md links to {re.escape(target)}"):
        tree.linked(tree.INDEX, target)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built with warnings as errors into a folder that is not empty."""
    if not BUILDER.exists():
        pytest.skip("make docs installs what builds the site")
    folder = tmp_path_factory.mktemp("site")
    (folder / "old").mkdir()
    command = [BUILDER, "-m", "tools.site", "--folder", folder]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return folder


@pytest.mark.nightly
class TestBuilt:
    def test_folder_is_emptied_first(self, site):
        assert not (site / "old").exists()

    @pytest.mark.parametrize("page", ["tvist_client-arm", "tvist_client.blocking"])
    def test_reference_describes_methods_that_exist_only_at_run_time(self, site, page):
        html = (site / "html" / "api" / f"{page}.html").read_text(encoding="utf-8")
        assert "Largest jerk of any joint" in html

    def test_nothing_is_loaded_from_outside(self, site):
        for page in (site / "html").rglob("*.html"):
            for match in LOADED.finditer(page.read_text(encoding="utf-8")):
                assert not (match[1] or match[2]).startswith(("http:", "https:", "//")), page

    def test_pages_have_the_lists_and_tables_of_commonmark(self, site, collected):
        """MkDocs' dialect of Markdown differs from CommonMark in how lists are nested and interrupted."""
        forge = MarkdownIt("commonmark").enable("table")
        for page in collected[0]:
            inside = page.relative_to(ROOT)
            name = "index.html" if inside.name == "README.md" else f"{inside.stem}.html"
            html = (site / "html" / inside.with_name(name)).read_text(encoding="utf-8")
            article = EMPTY_ROW.sub("", html.partition("<article")[2].partition("</article>")[0])
            shown = forge.render(page.read_text(encoding="utf-8"))
            for tag in ("li", "tr"):
                assert article.count(f"<{tag}>") == shown.count(f"<{tag}>"), f"{inside}: {tag}"

    def test_exported_names_are_on_the_page_of_their_package(self, site):
        exported = (("robot", "Robot"), ("arm", "Arm"), ("motion", "Motion"), ("errors", "RefusedError"))
        for part, name in exported:
            page = (site / "html" / "api" / f"tvist_client-{part}.html").read_text(encoding="utf-8")
            assert f'id="tvist_client.{name}"' in page

    def test_blocking_client_is_documented_with_its_arguments(self, site):
        page = (site / "html" / "api" / "tvist_client.blocking.html").read_text(encoding="utf-8")
        of = page.partition('id="tvist_client.blocking.Arm.move_j"')[2].partition("<h3")[0]
        for argument in ("q", "velocity", "acceleration", "jerk", "duration"):
            assert f"<code>{argument}</code>" in of

    def test_no_page_is_a_source_file_or_too_long(self, site):
        pages = list((site / "html").rglob("*.html"))
        assert not [page for page in pages if re.search(r"\.(py|toml|json|yaml)\.html$|\._", page.name)]
        for page in (site / "html" / "api").glob("*.html"):
            assert len(re.sub(r"<[^>]*>", " ", page.read_text(encoding="utf-8")).split()) < 8000, page.name

    def test_each_command_has_a_page_with_example_and_options(self, site):
        for command, example in examples().items():
            page = Path(commands.page_of(command)).with_suffix(".html")
            text = re.sub(r"<[^>]*>", "", (site / "html" / page).read_text(encoding="utf-8"))
            assert example in text
            assert f"Usage: tvist {command}" in text
            assert command != "serve" or "--keep STR" in text
            assert page.name in (site / "html" / "cli" / "index.html").read_text("utf-8")

    def test_search_index_has_the_pages(self, site):
        text = (site / "html" / "search" / "search_index.js").read_text(encoding="utf-8")
        found = json.loads(text.removeprefix("var __index = "))
        assert {"docs/tutorials/first-motion.html", "api/tvist_shaping.html", "commands/move.html"} <= {
            entry["location"].partition("#")[0] for entry in found["docs"]
        }
