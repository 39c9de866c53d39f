"""Turn a compiled kernel into bytes and back, so that loading it prepares only what is needed to run it.

When numba loads a kernel, it prepares to compile others: it imports everything that it can compile, including SciPy if
that is installed, and parses the intermediate code. Here neither happens until another kernel is compiled.
"""

# numba's type information is incomplete.
# mypy: disable-error-code="no-untyped-call,attr-defined"

import pickle
from functools import cache
from typing import Any

from llvmlite import binding
from numba.core.compiler import CompileResult
from numba.core.runtime import _nrt_python
from numba.core.serialize import dumps


def to_bytes(result: Any) -> bytes:
    """Return the bytes from which `from_bytes` restores a kernel."""
    (name, _, (code, intermediate)), descriptor, environment, signature, *rest = result._reduce()  # noqa: SLF001
    shared = result.library._get_module_for_linking()  # noqa: SLF001
    symbols = [*shared.functions, *shared.global_variables]
    defined = [symbol.name for symbol in symbols if not symbol.is_declaration]
    needed = [
        symbol.name for symbol in symbols if symbol.is_declaration and not symbol.name.startswith("llvm.")
    ]
    rest[2] = ""  # the annotated source, which only people read
    # Machine code uses only the constants of an environment; keeping the others would import their modules.
    rest[-1] = tuple(
        inner for inner in rest[-1] if inner.consts or not inner.globals["__name__"].startswith("numba.")
    )
    return bytes(
        dumps((name, code, intermediate, defined, needed, (descriptor, environment, signature, *rest)))
    )


def from_bytes(target: Any, content: bytes) -> Any:
    """Restore a kernel, numba's `CompileResult`; the content must be trusted, since it can run any code."""
    name, code, intermediate, defined, needed, rest = pickle.loads(content)  # noqa: S301  written by this user or root
    _offer_memory()
    if any(binding.address_of_symbol(symbol) is None for symbol in needed):
        target.refresh()  # imports everything that numba can compile, including functions in C
    target.codegen()._engine._defined_symbols.update(defined)  # noqa: SLF001
    result = CompileResult._rebuild(target, (name, "object", (code, _empty())), *rest)  # noqa: SLF001

    @cache
    def module() -> Any:
        return binding.parse_bitcode(intermediate)

    # numba calls this only when it compiles another kernel that calls this one.
    result.library._get_module_for_linking = module  # noqa: SLF001
    return result


@cache
def _offer_memory() -> None:
    """Let machine code find numba's functions for the memory of arrays, as numba does before it compiles."""
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


@cache
def _empty() -> bytes:
    return bytes(binding.parse_assembly("").as_bitcode())
