"""Preparing a release: all versions and the changelog change together, or nothing does."""

import contextlib
import hashlib
import shutil
import sys
import zipfile
from pathlib import Path

import pytest
from tools.release.attempt import attempt
from tools.release.changelog import notes
from tools.release.compiled import written
from tools.release.environments import FailedError, check_is_built, constraints, installed, run
from tools.release.first_commands import First, fences, first_command, first_commands
from tools.release.prepare import check, prepare
from tools.release.publication import publications
from tools.release.versions import ReleaseError, common_version, distributions

ROOT = Path(__file__).parents[2]
DATE = "2031-02-03"


def git(root, *words):
    run("git", "-c", "user.name=a", "-c", "user.email=a@example.org", *words, cwd=root)


def test_a_wheel_with_machine_code_says_what_it_holds_and_what_it_needs(tmp_path):
    wheel = written(tmp_path, {"a.b.c-d-e.kernel": b"code"}, "cp312", "1.2.3", "0.68.1", "0.50.0")
    assert wheel.name.startswith("tvist_compiled-1.2.3-cp312-cp312-manylinux")
    with zipfile.ZipFile(wheel) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    assert content["tvist_compiled/a.b.c-d-e.kernel"] == b"code"
    about = content["tvist_compiled-1.2.3.dist-info/METADATA"].decode()
    for demanded in ("tvist[server]==1.2.3", "numba==0.68.1", "llvmlite==0.50.0"):
        assert f"Requires-Dist: {demanded}\n" in about
    lines = content["tvist_compiled-1.2.3.dist-info/RECORD"].decode().splitlines()
    assert [line.split(",")[0] for line in lines] == list(content)
    assert all(str(len(content[name])) == size for name, _, size in (line.split(",") for line in lines[:-1]))


@pytest.fixture
def checkout(tmp_path):
    """A repository with this one's pyproject files, at 0.1.0, and a changelog."""
    for file in [ROOT / "CITATION.cff", ROOT / "pyproject.toml", *ROOT.glob("*/pyproject.toml")]:
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
    return run("git", "status", "--porcelain", cwd=root)


def test_the_distributions_of_this_repository_agree():
    names = {each.name for each in distributions(ROOT)}
    assert names >= {"tvist", "tvist-protocol", "tvist-shaping", "tvist-urscript"}
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
    cited = (checkout / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: 9.1.0\ndate-released: {DATE}\n" in cited
    (checkout / "CITATION.cff").write_text(cited.replace(DATE, "2031-02-04"), encoding="utf-8")
    with pytest.raises(ReleaseError, match="date-released is 2031-02-04"):
        check(checkout, "v9.1.0")
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
    ("file", "text", "version", "why"),
    [
        ("README.md", "", "0.0.9", "must be higher than"),
        ("README.md", "", "1.0", "not of the form X.Y.Z"),
        ("README.md", "", "v1.0.0", "not of the form X.Y.Z"),
        ("README.md", "", "1.0.0rc1", "not of the form X.Y.Z"),
        (
            "CHANGELOG.md",
            "## [Unreleased]\n\n## [0.0.1] - 2030-01-01\n\n- Old.\n",
            "9.1.0",
            "nothing is listed",
        ),
        ("CITATION.cff", "title: t\n", "9.1.0", "no line version"),
    ],
)
def test_what_cannot_be_released_changes_nothing(checkout, file, text, version, why):
    (checkout / file).write_text(text, encoding="utf-8")
    git(checkout, "add", "--all")
    git(checkout, "commit", "--quiet", "--message", "as it is")
    with pytest.raises(ReleaseError, match=why):
        prepare(checkout, version, DATE)
    assert status(checkout) == ""


def test_a_tree_with_changes_is_refused_by_name(checkout):
    (checkout / "new.txt").touch()
    with pytest.raises(ReleaseError, match=r"new\.txt"):
        prepare(checkout, "9.1.0", DATE)
    assert status(checkout) == "?? new.txt\n"


@pytest.mark.parametrize(
    ("file", "old", "new", "why"),
    [
        ("shaping/pyproject.toml", "{}", "7.7.7", r"shaping/pyproject.toml: version is 7\.7\.7"),
        ("pyproject.toml", "urscript=={}", "urscript==7.7.7", r"needs tvist-urscript==7\.7\.7"),
        ("CITATION.cff", "version: {}", "version: 7.7.7", r"CITATION.cff: version is 7\.7\.7"),
        ("CITATION.cff", "\nversion: {}", "", "CITATION.cff: version is None"),
    ],
)
def test_what_has_another_version_is_named(checkout, file, old, new, why):
    file = checkout / file
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace(old.format(common_version(ROOT)), new, 1), encoding="utf-8")
    with pytest.raises(ReleaseError, match=why):
        check(checkout)


@pytest.mark.parametrize(("tag", "why"), [("v8.0.0", "expected v"), (None, "no section")])
def test_a_tag_that_does_not_fit_is_refused(checkout, tag, why):
    with pytest.raises(ReleaseError, match=why):
        check(checkout, tag or f"v{common_version(checkout)}")


def test_the_command_says_what_to_do_next_and_fails_with_a_sentence(checkout):
    words = (sys.executable, "-m", "tools.release", "--root", checkout, "prepare")
    assert "git tag --annotate v9.1.0" in run(*words, "9.1.0", cwd=ROOT)
    with pytest.raises(FailedError, match=r"^exit code 1: tools\.release: the tree has changes"):
        run(*words, "9.2.0", cwd=ROOT)


def test_checksums_are_those_that_sha256sum_checks(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"a")
    run(sys.executable, "-m", "tools.release", "checksums", tmp_path, cwd=ROOT)
    run("sha256sum", "--check", "--strict", "SHA256SUMS", cwd=tmp_path)


def test_each_page_with_a_command_can_be_tried_or_says_why_not():
    found, silent = first_commands(ROOT)
    known = installed((ROOT / "docs" / "how-to" / "install.md").read_text(encoding="utf-8"))
    assert len(found) > 40
    assert {"tvist", "tvist[testing]", "tvist-protocol"} <= {first.install for first in found} <= set(known)
    assert not {first.page for first in found} & set(silent)
    for first in found:
        kinds = [kind for kind, _ in fences((ROOT / first.page).read_text(encoding="utf-8"))]
        assert first.skip or first.command.split()[0] in {"tvist", "python"}
        assert "[" not in first.command
        assert all(source in kinds or (ROOT / source).is_file() for source in first.files.values())


@pytest.mark.parametrize(
    ("text", "command", "skip"),
    [
        (
            "sh\nmake all\n\n. activate\n.venv/bin/tvist check --far  # well?\ntvist serve\n",
            "tvist check",
            "",
        ),
        ("sh\nmake all  # all\n", "make all", "shows commands of make alone"),
        ("python\ntvist = 1\n", None, None),
    ],
)
def test_the_first_command_is_ours_from_a_fence_as_the_table_changes_it(text, command, skip):
    table = {"commands": {"check": {"instead": {" --far": ""}, "robot": []}}, "pages": {}}
    first = first_command(
        "page.md", fences(f"`tvist paper`\n\n- it:\n\n  ```{text}  ```\n".replace("\n", "\n  ")), table
    )
    assert first == (
        command and First("page.md", command, skip=skip, **table["commands"].get(command[6:], {}))
    )


def test_constraints_are_the_versions_of_a_lock_without_its_hashes():
    lock = "a-b==1.2 \\\n  --hash=sha256:00 \\\n  --hash=sha256:01\nc==3 ; python_version < '3.12' \\\n  --hash=x:02\n"
    assert constraints(lock) == "a-b==1.2\nc==3 ; python_version < '3.12'\n"


@pytest.mark.parametrize(("digest", "same"), [("x", True), ("y", False)])
def test_a_distribution_from_elsewhere_is_no_built_one(tmp_path, digest, same):
    record = "tvist-9.dist-info/RECORD"
    with zipfile.ZipFile(tmp_path / "tvist-9-py3.whl", "w") as wheel:
        wheel.writestr(record, f"tvist.py,sha256=x,1\n{record},,\n")
    there = tmp_path / "lib" / "python3" / "site-packages" / record
    there.parent.mkdir(parents=True)
    there.write_text(
        f"../../bin/tvist,sha256=z,1\ntvist.py,sha256={digest},1\n{record},,\n", encoding="utf-8"
    )
    with contextlib.nullcontext() if same else pytest.raises(FailedError, match="is not the one of tvist-9"):
        check_is_built(tmp_path / "tvist-9-py3.whl", tmp_path)


SERVER = """#!{python}
import signal, sys
signal.signal(signal.SIGTERM, lambda *_: sys.exit({code}))
print("it {says} here", file=sys.stderr, flush=True)
{wait}
"""


@pytest.mark.parametrize(
    ("says", "code", "wait", "why"),
    [
        ("listens on", 0, "signal.pause()", None),
        ("listens on", 3, "signal.pause()", "exit code 3 after SIGTERM"),
        ("is", 0, "sys.exit(4)", "exit code 4 before it listened: it is here"),
    ],
)
def test_a_command_that_listens_is_ended_with_exit_code_0(tmp_path, says, code, wait, why):
    program = tmp_path / "tvist"
    program.write_text(
        SERVER.format(python=sys.executable, says=says, code=code, wait=wait), encoding="utf-8"
    )
    program.chmod(0o755)
    first = First("page.md", "tvist serve", listens=True)
    with pytest.raises(FailedError, match=why) if why else contextlib.nullcontext():
        attempt(first, ROOT, tmp_path, lambda _: tmp_path, {})


def test_what_would_be_published_has_its_checksum_and_its_place(tmp_path):
    (tmp_path / "tvist-9.whl").write_bytes(b"a")
    found = {each.what: each for each in publications(ROOT, "9", tmp_path, tmp_path, "tvist:9")}
    assert found["tvist-9.whl"].sha256 == hashlib.sha256(b"a").hexdigest()
    assert "no workflow pushes it" in found["image tvist:9"].where
    assert "release.yml" in found["tag v9"].where
