"""Releases: where the version stands, and what is made of the built packages."""

import contextlib
import re
import tomllib
import zipfile
from pathlib import Path

import pytest
from tools.release.compiled import written
from tools.release.environments import FailedError, check_is_built, constraints

ROOT = Path(__file__).parents[2]
BUMP = tomllib.loads((ROOT / ".bumpversion.toml").read_text(encoding="utf-8"))["tool"]["bumpversion"]


def test_release_changes_every_place_of_the_version():
    present = BUMP["current_version"]
    for place in BUMP["files"]:
        files = list(ROOT.glob(place.get("glob") or place["filename"]))
        assert files
        search = place["search"]
        if not place.get("regex"):
            search = re.escape(search.format(current_version=present))
        for file in files:
            assert re.search(search, file.read_text(encoding="utf-8")), file
    for file in [ROOT / "pyproject.toml", *ROOT.glob("*/pyproject.toml")]:
        text = file.read_text(encoding="utf-8")
        own = re.findall(r'^version = "(.+)"|"tvist[\w-]*(?:\[[\w,-]+\])?==([^"; ]+)', text, re.MULTILINE)
        assert {first or second for first, second in own} == {present}


def test_wheel_with_machine_code_has_valid_metadata(tmp_path):
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


def test_constraints_are_the_versions_of_a_lock_without_hashes():
    lock = "a-b==1.2 \\\n  --hash=sha256:00 \\\n  --hash=sha256:01\nc==3 ; python_version < '3.12' \\\n  --hash=x:02\n"
    assert constraints(lock) == "a-b==1.2\nc==3 ; python_version < '3.12'\n"


@pytest.mark.parametrize(("digest", "same"), [("x", True), ("y", False)])
def test_installed_distribution_must_be_the_built_one(tmp_path, digest, same):
    record = "tvist-9.dist-info/RECORD"
    with zipfile.ZipFile(tmp_path / "tvist-9-py3.whl", "w") as wheel:
        wheel.writestr(record, f"tvist.py,sha256=x,1\n{record},,\n")
    there = tmp_path / "lib" / "python3" / "site-packages" / record
    there.parent.mkdir(parents=True)
    there.write_text(f"../../bin/tvist,sha256=z,1\ntvist.py,sha256={digest},1\n{record},,\n")
    with contextlib.nullcontext() if same else pytest.raises(FailedError, match="is not the one of tvist-9"):
        check_is_built(tmp_path / "tvist-9-py3.whl", tmp_path)
