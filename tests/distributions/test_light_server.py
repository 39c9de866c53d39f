"""A served robot needs no scipy, which numba's linear algebra would need."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
SERVED = [
    path
    for folder in ("sim_plant", "shaping", "controller", "tvist_server", "urscript")
    for path in sorted((ROOT / folder).glob("tvist_*/**/*.py"))
]


def kernels(path):
    """Yield the functions that numba compiles."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and any(
            "compiled" in ast.unparse(by) for by in node.decorator_list
        ):
            yield node


def test_no_kernel_calls_linear_algebra():
    found = [kernel for path in SERVED for kernel in kernels(path)]
    assert len(found) > 50
    for kernel in found:
        for node in ast.walk(kernel):
            matrices = isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult)
            asked = isinstance(node, ast.Attribute) and node.attr in {"linalg", "dot", "vdot"}
            wrong = matrices or asked
            assert not wrong, f"{kernel.name}: {ast.unparse(node)}"
