"""The documentation as a site: every page is in its navigation, and it is built without a warning."""

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
"""What MkDocs gives a table that has only a head."""


@pytest.fixture(scope="module")
def collected():
    return tree.collect()


def listed(section):
    """Paths of the pages of a navigation."""
    for item in section:
        for value in item.values():
            yield from ([value] if isinstance(value, str) else listed(value))


def test_the_navigation_names_every_page_once(collected):
    pages, _ = collected
    nav = list(listed(navigation.navigation([], {})))
    assert len(nav) == len(set(nav))
    named = {path.relative_to(ROOT).as_posix() for path in pages}
    assert named - set(nav) <= {
        "tests/acceptance/README.md",
        "tests/journals/README.md",
    }  # reached from the page about tests


def test_the_navigation_has_a_section_for_each_reader():
    titles = [title for item in navigation.navigation([], {}) for title in item]
    readers = ["Try it", "Test programs", "Quiet a robot", "Study shapers", "Simulate arms", "Operate robots"]
    assert titles == ["Home", *readers, "Commands", "API", "Project"]


def test_every_package_that_is_imported_has_a_page():
    packages = {path.parent.name for path in ROOT.glob("*/tvist_*/__init__.py")}
    modules = reference.modules()
    assert {module.name.partition(".")[0] for module in modules} == packages - reference.PROGRAMS
    assert not [module.name for module in modules if not module.about]


@pytest.mark.parametrize(
    ("repository", "shown"),
    [("", "see ci, or x"), ("https://h/o/r", "see [ci](https://h/o/r/blob/main/.ci/run), or x")],
)
def test_a_link_to_a_source_file_leads_to_the_repository(repository, shown, monkeypatch):
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
def test_a_link_that_leads_nowhere_is_refused_by_name(target):
    with pytest.raises(tree.LinkError, match=f"docs/README.md links to {re.escape(target)}"):
        tree.linked(tree.INDEX, target)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site, built strictly: a warning of MkDocs is an error."""
    if not BUILDER.exists():
        pytest.skip("make docs installs what builds the site")
    folder = tmp_path_factory.mktemp("site")
    ended = subprocess.run(
        [BUILDER, "-m", "tools.site", "--folder", folder],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return folder


class TestBuilt:
    @pytest.mark.parametrize("page", ["tvist_client-arm", "tvist_client.blocking"])
    def test_the_reference_describes_methods_that_exist_only_at_run_time(self, site, page):
        html = (site / "html" / "api" / f"{page}.html").read_text(encoding="utf-8")
        assert "Largest jerk of any joint" in html

    def test_nothing_is_loaded_from_outside(self, site):
        for page in (site / "html").rglob("*.html"):
            for match in LOADED.finditer(page.read_text(encoding="utf-8")):
                assert not (match[1] or match[2]).startswith(("http:", "https:", "//")), page

    def test_pages_have_the_items_and_tables_that_a_forge_shows(self, site, collected):
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

    def test_what_a_package_exports_is_on_its_page(self, site):
        for part, name in {
            "robot": "Robot",
            "arm": "Arm",
            "motion": "Motion",
            "errors": "RefusedError",
        }.items():
            page = (site / "html" / "api" / f"tvist_client-{part}.html").read_text(encoding="utf-8")
            assert f'id="tvist_client.{name}"' in page

    def test_the_blocking_client_is_there_with_its_arguments(self, site):
        page = (site / "html" / "api" / "tvist_client.blocking.html").read_text(encoding="utf-8")
        of = page.partition('id="tvist_client.blocking.Arm.move_j"')[2].partition("<h3")[0]
        for argument in ("q", "velocity", "acceleration", "jerk", "duration"):
            assert f"<code>{argument}</code>" in of

    def test_no_page_is_a_source_file_or_a_wall(self, site):
        pages = list((site / "html").rglob("*.html"))
        assert not [page for page in pages if re.search(r"\.(py|toml|json|yaml)\.html$|\._", page.name)]
        for page in (site / "html" / "api").glob("*.html"):
            assert len(re.sub(r"<[^>]*>", " ", page.read_text(encoding="utf-8")).split()) < 8000, page.name

    def test_every_command_has_its_page_with_an_example_and_its_options(self, site):
        for command, example in examples().items():
            page = Path(commands.page_of(command)).with_suffix(".html")
            text = re.sub(r"<[^>]*>", "", (site / "html" / page).read_text(encoding="utf-8"))
            assert example in text
            assert f"Usage: tvist {command}" in text
            assert page.name in (site / "html" / "cli" / "index.html").read_text("utf-8")
        assert "--keep STR" in re.sub(
            r"<[^>]*>", "", (site / "html" / "commands" / "serve.html").read_text("utf-8")
        )

    def test_the_search_knows_the_pages(self, site):
        text = (site / "html" / "search" / "search_index.js").read_text(encoding="utf-8")
        found = json.loads(text.removeprefix("var __index = "))
        assert {"docs/tutorials/first-motion.html", "api/tvist_shaping.html", "commands/move.html"} <= {
            entry["location"].partition("#")[0] for entry in found["docs"]
        }


def test_the_folder_is_emptied_first(tmp_path):
    (tmp_path / "old").mkdir()
    assert json.loads(stage.stage(tmp_path).read_text(encoding="utf-8"))["nav"]
    assert not (tmp_path / "old").exists()
