"""Write the site's sources: every page at its path in the repository, with links adapted to the site."""

import json
import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

from tools.site import commands, reference
from tools.site.navigation import navigation
from tools.site.tree import HOME, ROOT, collect, linked, links

ASSETS = Path(__file__).parent / "assets"
LOGO = Path("docs/images/logo.svg")
FIRST = "---\nhide: [navigation, toc]\n---\n\n"  # header of the front page, which uses the whole width
TRY = ROOT / "view" / "tvist_view" / "try.html"
FRAME = '<iframe class="try" src="try.html" title="Try shaping"></iframe>\n\n'
"""The interactive shaping page, which the site's front page shows above its picture."""
PICTURE = "<picture>"
PICTURES = {".png", ".gif", ".svg", ".webp"}  # suffixes of files that a browser shows
REPOSITORY = os.environ.get("TVIST_REPOSITORY", "")
"""Address of the repository for links to its files; without it they become plain text."""


def stage(folder: Path) -> Path:
    """Write the sources of the site and MkDocs' configuration into an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    pages, others = collect()
    to = folder / "pages"
    for page in pages:
        text = _with_links_of_the_site(page)
        if page == HOME:
            assert PICTURE in text
            text = FIRST + text.replace(PICTURE, FRAME + PICTURE, 1)
        _write(to / page.relative_to(ROOT), text)
    for path in (path for path in others if path.suffix in PICTURES):
        _place(to / path.relative_to(ROOT)).write_bytes(path.read_bytes())
    modules = reference.modules()
    for module in modules:
        for path, text in module.pages.items():
            _write(to / path, text)
    _write(to / reference.FOLDER / "README.md", reference.overview(modules))
    _place(to / LOGO).write_bytes((ROOT / LOGO).read_bytes())
    _place(to / TRY.name).write_bytes(TRY.read_bytes())
    shutil.copytree(ASSETS, to / "assets")
    # Some methods of the client exist only at run time; this copy of it contains them as source text.
    described = folder / "described"
    python = str(ROOT / ".venv" / "bin" / "python")
    subprocess.run([python, "-m", "tools.stubs", str(described)], cwd=ROOT, check=True)
    sources_of = {described if module.source == ROOT / "clients" else module.source for module in modules}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    configuration = {
        "copyright": f"tvist {project['version']}, {project['license']}",
        **({"repo_url": REPOSITORY} if REPOSITORY else {}),
        "INHERIT": str(Path(__file__).with_name("mkdocs.yml")),
        "docs_dir": str(to),
        "site_dir": str(folder / "html"),
        "nav": navigation(modules, commands.written(to)),
        "theme": {"logo": str(LOGO), "favicon": str(LOGO)},
        "plugins": {
            "mkdocstrings": {
                "handlers": {
                    "python": {
                        "paths": sorted(map(str, sources_of)),
                        # A package may export what another one defines.
                        "options": {"preload_modules": sorted({m.name.partition(".")[0] for m in modules})},
                    }
                }
            }
        },
    }
    path = folder / "mkdocs.yml"
    _write(path, json.dumps(configuration, indent=2))  # JSON is YAML
    return path


def _with_links_of_the_site(page: Path) -> str:
    text = page.read_text(encoding="utf-8")
    for match in reversed(links(text)):
        target, mark, anchor = match["target"].partition("#")
        path = linked(page, target)
        if path != TRY and path.suffix != ".md" and path.suffix not in PICTURES:
            text = to_repository(text, match.start(), match.end(), path)
        elif target:  # the anchor of the page for trying selects the scene
            to = Path(TRY.name) if path == TRY else path.relative_to(ROOT)
            way = Path(os.path.relpath(to, page.relative_to(ROOT).parent)).as_posix()
            text = text[: match.start()] + way + mark + anchor + text[match.end() :]
    return text


def to_repository(text: str, start: int, end: int, path: Path) -> str:
    """Return a page's text with a link to a file or folder redirected to the repository."""
    if REPOSITORY:
        kind = "tree" if path.is_dir() else "blob"
        address = f"{REPOSITORY}/{kind}/main/{path.relative_to(ROOT).as_posix()}"
        return text[:start] + address + text[end:]
    opens = re.compile(r"\[[^\[\]]*\]\($").search(text[:start])
    assert opens is not None, text[:end][-80:]
    return text[: opens.start()] + opens[0][1:-2] + text[end + 1 :]


def _place(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _write(path: Path, text: str) -> None:
    _place(path).write_text(text, encoding="utf-8")
