"""Derive the navigation from the documentation's index: its headings are sections, its links are pages."""

import re
from pathlib import Path
from typing import Any

from tools.site.commands import OVERVIEW, page_of
from tools.site.reference import FOLDER, Module
from tools.site.tree import HOME, INDEX, ROOT, linked

HEADING = re.compile(r"^(?:(?P<level>##+) |.*<summary>)(?P<title>.+?)(?:</summary>)?$")
ENTRY = re.compile(r"^(?:- |\d+\. )\[(?P<title>[^\]]+)\]\((?P<target>[^)#\s]+\.md)\)")

Section = list[dict[str, Any]]


def navigation(modules: list[Module], commands: dict[str, list[str]]) -> Section:
    """Return MkDocs' `nav`: the front page, the index with its sections, the commands and the API.

    Folded lists of the index are groups of their section. A page that the index names twice is in the first
    section.
    """
    sections: Section = []
    placed = {OVERVIEW}
    stack: list[tuple[int, Section]] = [(1, sections)]
    for line in INDEX.read_text(encoding="utf-8").splitlines():
        if heading := HEADING.match(line):
            level, inside = len(heading["level"] or "###"), Section()
            while stack[-1][0] >= level:
                stack.pop()
            stack[-1][1].append({heading["title"]: inside})
            stack.append((level, inside))
        elif entry := ENTRY.match(line):
            path = linked(INDEX, entry["target"]).relative_to(ROOT).as_posix()
            if path not in placed:
                placed.add(path)
                stack[-1][1].append({entry["title"].replace("`", ""): path})
    told: Section = [{"Overview": OVERVIEW}]
    told += [{group: [{n: page_of(n)} for n in names]} for group, names in commands.items()]
    api: Section = [{"Overview": f"{FOLDER}/README.md"}]
    for module in modules:
        first, *more = module.pages
        parts = [{path.stem.partition("-")[2]: path.as_posix()} for path in more]
        api.append({module.name: [{"Overview": first.as_posix()}, *parts] if parts else first.as_posix()})
    home = [{"Start": HOME.name}, {"Contents": str(Path(INDEX).relative_to(ROOT))}]
    shown = [section for section in sections if all(section.values())]
    return [{"Home": home}, *shown[:-1], {"Commands": told}, {"API": api}, *shown[-1:]]
