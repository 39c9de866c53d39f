"""Pages of the API reference, one for each module that other people import, filled from its docstrings."""

import ast
from dataclasses import dataclass
from pathlib import Path

from tools.site.tree import ROOT

PROGRAMS = {"tvist_cli", "tvist_server", "tvist_view"}
"""Packages that are run and not imported. Every other package has an API."""
FOLDER = "api"
"""Folder of these pages in the site."""


@dataclass(frozen=True)
class Module:
    """A module with a page."""

    name: str
    """Dotted name."""
    source: Path
    """Folder that contains its package."""
    about: str
    """First line of its docstring, without the full stop."""

    @property
    def page(self) -> Path:
        """Path of its page in the site."""
        return Path(FOLDER, f"{self.name}.md")


def modules() -> list[Module]:
    """Return the modules with a page, by name.

    These are the modules that say in `__all__` what they export. A package without any such module has a page for each
    module that is not private.
    """
    found: list[Module] = []
    for package in sorted(ROOT.glob("*/tvist_*/__init__.py"), key=lambda path: path.parent.name):
        root = package.parent.parent
        if package.parent.name in PROGRAMS:
            continue
        parsed = {path: ast.parse(path.read_text(encoding="utf-8")) for path in package.parent.rglob("*.py")}
        exporting = {path: tree for path, tree in parsed.items() if _exports(tree)}
        shown = exporting or {path: tree for path, tree in parsed.items() if not path.stem.startswith("_")}
        for path, tree in shown.items():
            parts = path.relative_to(root).with_suffix("").parts
            name = ".".join(part for part in parts if part != "__init__")
            about = (ast.get_docstring(tree) or "").partition("\n")[0].rstrip(".")
            found.append(Module(name, root, about))
    return sorted(found, key=lambda module: module.name)


def _exports(tree: ast.Module) -> bool:
    targets = [target for node in tree.body if isinstance(node, ast.Assign) for target in node.targets]
    return any(isinstance(target, ast.Name) and target.id == "__all__" for target in targets)


def page(module: Module) -> str:
    """Return a module's page, in Markdown, with the place that MkDocs fills."""
    return f"# `{module.name}`\n\n::: {module.name}\n"


def overview(listed: list[Module]) -> str:
    """Return the page that lists the modules."""
    rows = "".join(f"| [`{module.name}`]({module.page.name}) | {module.about} |\n" for module in listed)
    return (
        "# API reference\n\n"
        "These pages are made from the docstrings. What they do not list may change without notice.\n\n"
        f"| module | holds |\n|---|---|\n{rows}"
    )
