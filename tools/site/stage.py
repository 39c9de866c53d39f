"""Writes the site's sources: every page at its path in the repository, its links leading to what the site shows."""

import json
import shutil
from pathlib import Path

from tools.site import reference, sources
from tools.site.navigation import navigation
from tools.site.tree import ROOT, collect, linked, links

ASSETS = Path(__file__).parent / "assets"


def stage(folder: Path) -> Path:
    """Write the sources of the site and MkDocs' configuration into an empty folder.

    Args:
        folder: Folder to write; what is in it is deleted.

    Returns:
        The configuration, a file in that folder.

    Raises:
        LinkError: A page links to something that is not in the repository.
    """
    shutil.rmtree(folder, ignore_errors=True)
    pages, others = collect()
    to = folder / "pages"
    for page in pages:
        _write(to / page.relative_to(ROOT), _with_links_of_the_site(page))
    for path in others:
        if path.suffix in sources.SHOWN_AS_IS:
            _place(to / sources.page_of(path)).write_bytes(path.read_bytes())
        else:
            _write(to / sources.page_of(path), sources.shown(path))
    modules = reference.modules()
    for module in modules:
        _write(to / module.page, reference.page(module))
    _write(to / reference.FOLDER / "README.md", reference.overview(modules))
    shutil.copytree(ASSETS, to / "assets")
    configuration = {
        "INHERIT": str(Path(__file__).with_name("mkdocs.yml")),
        "docs_dir": str(to),
        "site_dir": str(folder / "html"),
        "nav": navigation(modules),
        "plugins": {
            "mkdocstrings": {
                "handlers": {
                    "python": {
                        "paths": sorted({str(module.source) for module in modules}),
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
        if path.suffix == ".md":
            shown = path.relative_to(ROOT)
        else:
            shown, mark, anchor = sources.page_of(path), "", ""
        if target:
            way = sources.way(page.relative_to(ROOT), shown)
            text = text[: match.start()] + way + mark + anchor + text[match.end() :]
    return text


def _place(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _write(path: Path, text: str) -> None:
    _place(path).write_text(text, encoding="utf-8")
