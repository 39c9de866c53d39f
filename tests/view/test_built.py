"""The page in the repository is what its sources build."""

import gzip
import re
import shutil
import subprocess
from pathlib import Path

import pytest

VIEW = Path(__file__).parents[2] / "view"


def contents(file):
    """The bytes of a file; of a packed one, those that were packed, since machines pack in different ways."""
    return gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()


@pytest.mark.skipif(shutil.which("npm") is None, reason="there is no npm; only who changes the page needs it")
def test_built_pages_match_their_sources(tmp_path):
    shutil.copytree(VIEW / "page", tmp_path / "page", ignore=shutil.ignore_patterns("node_modules"))
    got = subprocess.run(
        ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"],
        check=False,
        cwd=tmp_path / "page",
        capture_output=True,
    )
    if got.returncode != 0:
        pytest.skip(f"no packages: {got.stderr.decode()[-200:]}")
    subprocess.run(["npx", "--no-install", "tsc", "-p", "try"], cwd=tmp_path / "page", check=True)
    subprocess.run(["node", "build.mjs", tmp_path], cwd=tmp_path / "page", check=True)
    for name in ("page.html.gz", "try.html", "page.licences.txt"):
        built, kept = (contents(folder / name) for folder in (tmp_path, VIEW / "tvist_view"))
        assert built == kept, f"{name} is not what view/page builds: run make page"


def test_pages_have_the_logo_of_the_documents():
    drawn = re.findall(r' d="([^"]+)"', (VIEW.parent / "docs" / "images" / "logo.svg").read_text())
    assert drawn
    for file in ("view/tvist_view/page.html.gz", "lab/tvist_lab/report/page.html.j2"):
        text = contents(VIEW.parent / file).decode()
        assert all(path in text for path in drawn), file
