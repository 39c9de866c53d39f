"""Generate a documentation page with measured tables."""

import json
import subprocess
import sys
from pathlib import Path

from cyclopts import run

from tools.tables.pages import PAGES, page_of

ROOT = Path(__file__).parents[2]


def main(name: str, result: Path | None = None) -> None:
    """Generate the page NAME.

    Args:
        name: A page with measured tables.
        result: Output of its command with --json; by default the command runs, perhaps for hours.
    """
    if name not in PAGES:
        sys.exit(f"name is {name}: must be one of {', '.join(PAGES)}")
    page = PAGES[name]
    if result is not None:
        text = result.read_text(encoding="utf-8")
    else:
        _, *words = f"{page.command} {page.files} --json".split()
        ran = [sys.executable, "-m", "tvist_cli", *words]
        text = subprocess.run(ran, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    if page.result and result is None:
        (ROOT / page.result).write_text(json.dumps(json.loads(text), indent=1, ensure_ascii=False) + "\n")
    (ROOT / page.path).write_text(page_of(name, json.loads(text)), encoding="utf-8")


if __name__ == "__main__":
    run(main)
