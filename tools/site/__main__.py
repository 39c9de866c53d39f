"""`python -m tools.site`: build the documentation site, or serve it while you edit it."""

import argparse
import subprocess
import sys
from pathlib import Path

from tools.site.stage import stage
from tools.site.tree import ROOT, LinkError


def main() -> int:
    """Build the site with warnings as errors; return MkDocs' exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.site", description=__doc__)
    parser.add_argument(
        "--folder",
        type=Path,
        default=ROOT / "build" / "site",
        help="Write to this folder; its html/ is the site.",
    )
    parser.add_argument(
        "--serve", action="store_true", help="Serve the site on http://127.0.0.1:8000 instead."
    )
    given = parser.parse_args()
    folder = given.folder.resolve()
    try:
        configuration = stage(folder)
    except LinkError as error:
        print(f"tools.site: {error}", file=sys.stderr)
        return 1
    what = ["serve"] if given.serve else ["build", "--strict", "--quiet"]
    ended = subprocess.run(
        [sys.executable, "-m", "mkdocs", *what, "--config-file", configuration], check=False, cwd=ROOT
    )
    if ended.returncode == 0 and not given.serve:
        print(f"the site is in {folder / 'html'}: open {folder / 'html' / 'index.html'}")
    return ended.returncode


if __name__ == "__main__":
    sys.exit(main())
