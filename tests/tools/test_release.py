"""Preparing a release: all versions and the changelog change together, or nothing does."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tools.release.changelog import notes
from tools.release.prepare import check, prepare
from tools.release.versions import ReleaseError, common_version, distributions

ROOT = Path(__file__).parents[2]
DATE = "2031-02-03"
FOUND = {**os.environ, "PYTHONPATH": str(ROOT)}
"""Environment in which Python finds the package `tools` from anywhere."""


def git(root, *words):
    subprocess.run(
        ["git", "-c", "user.name=a", "-c", "user.email=a@example.org", *words], cwd=root, check=True
    )


@pytest.fixture
def checkout(tmp_path):
    """A repository with this one's pyproject files, at 0.1.0, and a changelog."""
    for file in [ROOT / "pyproject.toml", *ROOT.glob("*/pyproject.toml")]:
        to = tmp_path / file.relative_to(ROOT)
        to.parent.mkdir(exist_ok=True)
        shutil.copy(file, to)
    (tmp_path / "CHANGELOG.md").write_text(
        "# Changelog\n\n## [Unreleased]\n\n### Added\n\n- Wings.\n", encoding="utf-8"
    )
    git(tmp_path, "init", "--quiet")
    git(tmp_path, "add", "--all")
    git(tmp_path, "commit", "--quiet", "--message", "all")
    return tmp_path


def status(root):
    words = ["git", "status", "--porcelain"]
    return subprocess.run(words, cwd=root, check=True, capture_output=True, text=True).stdout


def test_the_distributions_of_this_repository_agree():
    assert {each.name for each in distributions(ROOT)} >= {
        "tvist",
        "tvist-protocol",
        "tvist-shaping",
        "tvist-urscript",
    }
    assert check(ROOT) == distributions(ROOT)[0].version


def test_a_release_changes_all_versions_pins_and_the_changelog(checkout):
    prepare(checkout, "9.1.0", DATE)
    assert {each.version for each in distributions(checkout)} == {"9.1.0"}
    pins = [pin for each in distributions(checkout) for pin in each.pins]
    assert len(pins) >= 3
    assert {version for _, version in pins} == {"9.1.0"}
    assert check(checkout, "v9.1.0") == "9.1.0"
    assert notes(checkout, "9.1.0") == "### Added\n\n- Wings.\n"
    text = (checkout / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## [Unreleased]\n\n## [9.1.0] - {DATE}\n\n### Added" in text
    for each in distributions(checkout):
        before = (ROOT / each.file.relative_to(checkout)).read_text(encoding="utf-8")
        after = each.file.read_text(encoding="utf-8")
        assert after.replace("9.1.0", common_version(ROOT)) == before


def test_the_present_version_can_be_released_until_it_is_tagged(checkout):
    present = common_version(checkout)
    prepare(checkout, present, DATE)
    git(checkout, "commit", "--quiet", "--all", "--message", "release")
    git(checkout, "tag", f"v{present}")
    (checkout / "CHANGELOG.md").write_text("## [Unreleased]\n\n- More.\n", encoding="utf-8")
    git(checkout, "commit", "--quiet", "--all", "--message", "more")
    with pytest.raises(ReleaseError, match="not be tagged yet"):
        prepare(checkout, present, DATE)


@pytest.mark.parametrize(
    ("version", "why"),
    [
        ("0.0.9", "must be higher than"),
        ("1.0", "not of the form X.Y.Z"),
        ("v1.0.0", "not of the form X.Y.Z"),
        ("1.0.0rc1", "not of the form X.Y.Z"),
    ],
)
def test_a_version_that_is_no_higher_one_changes_nothing(checkout, version, why):
    with pytest.raises(ReleaseError, match=why):
        prepare(checkout, version, DATE)
    assert status(checkout) == ""


def test_a_tree_with_changes_is_refused_by_name(checkout):
    (checkout / "new.txt").touch()
    with pytest.raises(ReleaseError, match=r"new\.txt"):
        prepare(checkout, "9.1.0", DATE)
    assert status(checkout) == "?? new.txt\n"


def test_a_changelog_with_nothing_to_release_changes_nothing(checkout):
    (checkout / "CHANGELOG.md").write_text(
        "## [Unreleased]\n\n## [0.0.1] - 2030-01-01\n\n- Old.\n", encoding="utf-8"
    )
    git(checkout, "commit", "--quiet", "--all", "--message", "nothing new")
    with pytest.raises(ReleaseError, match="nothing is listed"):
        prepare(checkout, "9.1.0", DATE)
    assert status(checkout) == ""


def test_a_distribution_with_another_version_is_named(checkout):
    file = checkout / "shaping" / "pyproject.toml"
    file.write_text(
        file.read_text(encoding="utf-8").replace(common_version(ROOT), "7.7.7", 1), encoding="utf-8"
    )
    with pytest.raises(ReleaseError, match=r"shaping/pyproject.toml: version is 7\.7\.7"):
        check(checkout)


def test_a_distribution_that_needs_another_version_is_named(checkout):
    file = checkout / "pyproject.toml"
    file.write_text(
        file.read_text(encoding="utf-8").replace(
            f"tvist-urscript=={common_version(ROOT)}", "tvist-urscript==7.7.7"
        ),
        encoding="utf-8",
    )
    with pytest.raises(ReleaseError, match=r"needs tvist-urscript==7\.7\.7"):
        check(checkout)


@pytest.mark.parametrize(("tag", "why"), [("v8.0.0", "expected v"), (None, "no section")])
def test_a_tag_that_does_not_fit_is_refused(checkout, tag, why):
    with pytest.raises(ReleaseError, match=why):
        check(checkout, tag or f"v{common_version(checkout)}")


def test_the_command_says_what_to_do_next_and_fails_with_a_sentence(checkout):
    def run(*words):
        return subprocess.run(
            [sys.executable, "-m", "tools.release", "--root", checkout, *words],
            capture_output=True, text=True, check=False, env=FOUND,
        )  # fmt: skip

    done = run("prepare", "9.1.0")
    assert done.returncode == 0
    assert "git tag --annotate v9.1.0" in done.stdout
    again = run("prepare", "9.2.0")
    assert again.returncode == 1
    assert again.stderr.startswith("tools.release: the tree has changes")


def test_checksums_are_those_that_sha256sum_checks(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"a")
    subprocess.run([sys.executable, "-m", "tools.release", "checksums", tmp_path], check=True, env=FOUND)
    subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], check=True, cwd=tmp_path)
