"""A served robot needs no scipy: numba's linear algebra would, where a kernel calls it."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SERVED = [
    path
    for folder in ("sim_plant", "shaping", "controller", "tvist_server", "urscript")
    for path in sorted((ROOT / folder).glob("tvist_*/**/*.py"))
]


def kernels(path):
    """The functions that numba compiles."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and any(
            "compiled" in ast.unparse(by) for by in node.decorator_list
        ):
            yield node


@pytest.mark.parametrize("path", [path for path in SERVED if any(kernels(path))], ids=lambda path: path.stem)
def test_no_kernel_calls_linear_algebra(path):
    for kernel in kernels(path):
        for node in ast.walk(kernel):
            matrices = isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)
            asked = isinstance(node, ast.Attribute) and node.attr in {"linalg", "dot", "vdot"}
            assert not matrices, f"{kernel.name}: {ast.unparse(node)}"
            assert not asked, f"{kernel.name}: {ast.unparse(node)}"
