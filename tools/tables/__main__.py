"""`python -m tools.tables PAGE [RESULT.json]`: generate a documentation page with measured tables.

Without a result, the output of the page's command with `--json`, it runs that command, which may take hours.
"""

import json
import subprocess
import sys
from pathlib import Path

from tools.tables.pages import PAGES, page_of

ROOT = Path(__file__).parents[2]


def main() -> None:
    """Generate the page given on the command line."""
    if len(sys.argv) not in (2, 3) or sys.argv[1] not in PAGES:
        sys.exit(f"usage: python -m tools.tables {'|'.join(PAGES)} [RESULT.json]")
    name = sys.argv[1]
    page = PAGES[name]
    if len(sys.argv) == 3:
        text = Path(sys.argv[2]).read_text(encoding="utf-8")
    else:
        _, *words = f"{page.command} {page.files} --json".split()
        ran = [sys.executable, "-m", "tvist_cli", *words]
        text = subprocess.run(ran, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    if page.result and len(sys.argv) == 2:
        (ROOT / page.result).write_text(json.dumps(json.loads(text), indent=1, ensure_ascii=False) + "\n")
    (ROOT / page.path).write_text(page_of(name, json.loads(text)), encoding="utf-8")


if __name__ == "__main__":
    main()
