"""Pages of the API reference from docstrings: one for each module that users import.

A module that exports names from many modules has a further page for each of them.
"""

import ast
from dataclasses import dataclass, field
from pathlib import Path

from tools.site.tree import ROOT

PROGRAMS = {"tvist_cli", "tvist_ros2", "tvist_server", "tvist_view"}
"""Packages that are run, not imported. Every other package has an API."""
FOLDER = "api"  # folder of these pages in the site
MANY = 15  # most exports of a module on a single page
SHOWN = "    options: { show_root_heading: true, show_root_toc_entry: true }\n"


@dataclass(frozen=True)
class Module:
    """A module with a page."""

    name: str  # dotted name
    source: Path  # folder that contains its package
    about: str  # first line of its docstring, without the full stop
    parts: dict[str, list[str]] = field(default_factory=dict)
    """Exported names by the module that defines them; empty if all are on one page."""

    @property
    def page(self) -> Path:
        """Path of its page in the site."""
        return Path(FOLDER, f"{self.name}.md")

    @property
    def pages(self) -> dict[Path, str]:
        """Text of each page of the module, in Markdown with placeholders that MkDocs fills."""
        if not self.parts:
            return {self.page: f"# `{self.name}`\n\n::: {self.name}\n"}
        rows, found = "", dict[Path, str]()
        for part, names in self.parts.items():
            path = Path(FOLDER, f"{self.name}-{part}.md")
            links = ", ".join(f"[`{name}`]({path.name}#{self.name}.{name})" for name in names)
            rows += f"| [{part}]({path.name}) | {links} |\n"
            filled = "\n".join(f"::: {self.name}.{name}\n{SHOWN}" for name in names)
            found[path] = f"# `{self.name}`: {part}\n\nImport these from `{self.name}`.\n\n{filled}"
        return {
            self.page: f"# `{self.name}`\n\n{self.about}.\n\n| part | exports |\n|---|---|\n{rows}"
        } | found


def modules() -> list[Module]:
    """Return the modules with a page, by name.

    These are the public modules with an `__all__`; in a package without any such module, all public ones.
    """
    found: list[Module] = []
    for package in sorted(ROOT.glob("*/tvist_*/__init__.py"), key=lambda path: path.parent.name):
        root = package.parent.parent
        if package.parent.name in PROGRAMS:
            continue
        texts = {
            path: path.read_text(encoding="utf-8")
            for path in package.parent.rglob("*.py")
            if path.stem == "__init__" or not path.stem.startswith("_")
        }
        for path in [path for path, text in texts.items() if "\n__all__ = " in text] or texts:
            parts = path.relative_to(root).with_suffix("").parts
            name = ".".join(part for part in parts if part != "__init__")
            tree = ast.parse(texts[path])
            about = (ast.get_docstring(tree) or "").partition("\n")[0].rstrip(".")
            exports = _exports(tree)
            split = _origins(tree, exports) if len(exports) > MANY else {}
            found.append(Module(name, root, about, split))
    return sorted(found, key=lambda module: module.name)


def _exports(tree: ast.Module) -> set[str]:
    for node in tree.body:
        if isinstance(node, ast.Assign) and any(
            isinstance(target, ast.Name) and target.id == "__all__" for target in node.targets
        ):
            return set(ast.literal_eval(node.value))
    return set()


def _origins(tree: ast.Module, exports: set[str]) -> dict[str, list[str]]:
    """Return the names of an `__all__` by the last part of the module from which they are imported."""
    found: dict[str, list[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [one.asname or one.name for one in node.names]
            found.setdefault(node.module.rpartition(".")[2], []).extend(sorted(exports.intersection(names)))
    return {part: names for part, names in sorted(found.items()) if names}


def overview(listed: list[Module]) -> str:
    """Return the page that lists the modules."""
    rows = "".join(f"| [`{module.name}`]({module.page.name}) | {module.about} |\n" for module in listed)
    return (
        "# API reference\n\n"
        "These pages are made from the docstrings. What they do not list may change without notice.\n\n"
        f"| module | holds |\n|---|---|\n{rows}"
    )
