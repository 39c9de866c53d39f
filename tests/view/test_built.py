"""The page in the repository is what its sources build."""

import gzip
import re
import shutil
import subprocess
from pathlib import Path

import pytest

VIEW = Path(__file__).parents[2] / "view"


def contents(file):
    """Return a file's bytes, unpacked if it is packed, since machines compress differently."""
    return gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()


@pytest.fixture
def install(tmp_path):
    """Copy the sources and install their packages; only who changes the page needs npm."""

    def installed(*options):
        if shutil.which("npm") is None:
            pytest.skip("there is no npm")
        folder = tmp_path / "page"
        shutil.copytree(VIEW / "page", folder, ignore=shutil.ignore_patterns("node_modules"))
        command = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline", *options]
        got = subprocess.run(command, check=False, cwd=folder, capture_output=True)
        if got.returncode != 0:
            pytest.skip(f"no packages: {got.stderr.decode()[-200:]}")
        return folder

    return installed


def test_built_pages_match_their_sources(install, tmp_path):
    subprocess.run(["node", "build.mjs", tmp_path], cwd=install("--omit=dev"), check=True)
    for name in ("page.html.gz", "try.html", "page.licences.txt"):
        built, kept = (contents(folder / name) for folder in (tmp_path, VIEW / "tvist_view"))
        assert built == kept, f"{name} is not what view/page builds: run make page"


@pytest.mark.nightly
def test_types_of_the_sources_fit(install):
    subprocess.run(["node", "node_modules/typescript/bin/tsc", "-p", "try"], cwd=install(), check=True)


def test_pages_have_the_logo_of_the_documents():
    drawn = re.findall(r' d="([^"]+)"', (VIEW.parent / "docs" / "images" / "logo.svg").read_text())
    assert drawn
    for file in ("view/tvist_view/page.html.gz", "lab/tvist_lab/report/page.html.j2"):
        text = contents(VIEW.parent / file).decode()
        assert all(path in text for path in drawn), file
