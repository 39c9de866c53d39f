"""Pages of the documentation about studies: their prose, beside this file, around tables of what was measured."""

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from tvist_lab.markdown_table import markdown_table
from tvist_lab.study.held_out import said
from tvist_lab.study.tables import in_markdown


def page(name: str, result: dict[str, Any], command: str, **more: object) -> str:
    """Return the page of a study.

    Args:
        name: Name of its template.
        result: What was measured, as `--json` prints it.
        command: The command that made the page, as it was typed.
        more: What else the template needs, such as the columns of its tables.
    """
    environment = Environment(  # noqa: S701  this is Markdown
        loader=PackageLoader("tvist_lab.studies", "pages"), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.globals |= {"g": "{:g}".format, "in_markdown": in_markdown, "markdown_table": markdown_table}
    held_out = said(result["seed"]) if "seed" in result else ""
    return environment.get_template(f"{name}.md.j2").render(
        {"held_out": held_out, **result, **more, "command": command}
    )
