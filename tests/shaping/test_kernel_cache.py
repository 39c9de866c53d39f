"""Machine code on disk: it is used again where it is right, and only there."""

import os
import subprocess
import sys

import pytest

CALLEE = """
from tvist_shaping.compiling import compiled
from tvist_of_tests.constants import FACTOR

@compiled
def inner(x):
    return FACTOR * x
"""
CALLER = """
from tvist_shaping.compiling import compiled
from tvist_of_tests.callee import (
    inner,
)

@compiled
def outer(x):
    return inner(x) + 1.0
"""
CALL = """
import sys
import numba
from tvist_of_tests.caller import outer
from tvist_shaping.compiling import is_cached
from tvist_shaping.kernel_cache import unkept
said = [is_cached(outer), *map(outer, eval(sys.argv[1]))]
print(*said, sum(outer.stats.cache_misses.values()), int(bool(unkept)))
"""
"""Prints whether outer is on disk, its values, how often it was compiled, and whether some was not kept."""


@pytest.fixture
def package(tmp_path):
    """A package whose kernel `outer` calls one of another file, which uses a constant of a third."""
    folder = tmp_path / "tvist_of_tests"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "constants.py").write_text("FACTOR = 2.0\n")
    (folder / "callee.py").write_text(CALLEE)
    (folder / "caller.py").write_text(CALLER)
    return folder


def start(package, values="[1.0]", **environment):
    return subprocess.Popen(
        [sys.executable, "-c", CALL, values],
        env={
            **os.environ,
            "PYTHONPATH": str(package.parent),
            "XDG_CACHE_HOME": str(package.parent / "home"),
            "NUMBA_CACHE_DIR": "",
            **environment,
        },
        stdout=subprocess.PIPE,
        text=True,
    )


def call(package, values="[1.0]", **environment):
    said, _ = start(package, values, **environment).communicate()
    return said.split()


def test_a_second_process_compiles_nothing(package):
    assert call(package) == ["False", "3.0", "1", "0"]
    assert call(package) == ["True", "3.0", "0", "0"]
    for file in package.rglob("*.kernel"):
        file.write_bytes(file.read_bytes()[:-1] + b"?")
    assert call(package) == ["True", "3.0", "1", "0"]  # damaged code does not run


@pytest.mark.slow
@pytest.mark.parametrize("changed", ["callee", "constants"])
def test_a_change_of_what_a_kernel_calls_or_uses_in_another_file_compiles_it_again(package, changed):
    call(package)
    file = package / f"{changed}.py"
    stamp = file.stat().st_mtime_ns
    file.write_text(
        file.read_text().replace("FACTOR * x", "FACTOR * x * x * 2").replace("FACTOR = 2.0", "FACTOR = 4.0")
    )
    os.utime(file, ns=(stamp, stamp))  # contents count, times do not
    assert call(package) == ["False", "5.0", "1", "0"]
    assert len(list(package.rglob("*outer*.kernel"))) == 1  # what it was before is gone


@pytest.mark.slow
def test_machine_code_of_another_processor_is_not_loaded_and_stays(package):
    call(package)
    other = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert call(package, **other) == ["False", "3.0", "1", "0"]
    assert call(package, **other) == ["True", "3.0", "0", "0"]
    assert call(package) == ["True", "3.0", "0", "0"]


@pytest.mark.slow
def test_where_the_sources_cannot_be_written_the_users_cache_folder_is_and_else_it_is_noted(package):
    (package / "__pycache__").write_text("a file where the folder would be")  # root may write anywhere
    assert call(package, PYTHONDONTWRITEBYTECODE="1") == ["False", "3.0", "1", "0"]
    assert len(list((package.parent / "home").rglob("*outer*.kernel"))) == 1
    assert call(package, PYTHONDONTWRITEBYTECODE="1") == ["True", "3.0", "0", "0"]
    assert call(package, NUMBA_CACHE_DIR="/proc/none") == ["False", "3.0", "1", "1"]


@pytest.mark.slow
def test_processes_that_compile_at_once_keep_what_each_compiled(package):
    """numba's own cache may give one's machine code, for integers, the name of the other's, for floats."""
    at_once = [start(package, values) for values in ("[1.0, 2]", "[2, 1.0]")]
    for process in at_once:
        process.communicate()
    assert call(package, "[1.0, 2]") == ["True", "3.0", "5.0", "0", "0"]
    assert not list(package.rglob("*.draft"))
