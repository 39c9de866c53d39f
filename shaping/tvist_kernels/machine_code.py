"""Turn a compiled kernel into bytes and back, so that loading one does only what running it needs.

numba loads a kernel as if it were about to compile others: it imports all that it can compile, among it SciPy if that
is installed, and parses the intermediate code. Here both wait until something is really compiled.
"""

# The types of numba are not whole.
# mypy: disable-error-code="no-untyped-call,attr-defined"

import pickle
from functools import cache
from typing import Any

from llvmlite import binding
from numba.core.compiler import CompileResult
from numba.core.runtime import _nrt_python
from numba.core.serialize import dumps


def to_bytes(result: Any) -> bytes:
    """Return what `from_bytes` makes a kernel of."""
    (name, _, (code, intermediate)), descriptor, environment, signature, *rest = result._reduce()  # noqa: SLF001
    shared = result.library._get_module_for_linking()  # noqa: SLF001
    symbols = [*shared.functions, *shared.global_variables]
    defined = [symbol.name for symbol in symbols if not symbol.is_declaration]
    needed = [
        symbol.name for symbol in symbols if symbol.is_declaration and not symbol.name.startswith("llvm.")
    ]
    rest[2] = ""  # the source with its types, for people
    # What runs uses constants of its environment alone; an environment's module would be imported with it.
    rest[-1] = tuple(inner for inner in rest[-1] if inner.consts or not _of_numba(inner))
    content: bytes = dumps(
        (name, code, intermediate, defined, needed, (descriptor, environment, signature, *rest))
    )
    return content


def from_bytes(target: Any, content: bytes) -> Any:
    """Return a kernel, numba's `CompileResult`; the content has to be trusted, since it can run anything."""
    name, code, intermediate, defined, needed, rest = pickle.loads(content)  # noqa: S301  ours, or root's
    _offer_memory()
    if any(binding.address_of_symbol(symbol) is None for symbol in needed):
        target.refresh()  # imports what numba can compile, and has functions of its own in C
    target.codegen()._engine._defined_symbols.update(defined)  # noqa: SLF001
    result = CompileResult._rebuild(target, (name, "object", (code, _empty())), *rest)  # noqa: SLF001

    @cache
    def module() -> Any:
        return binding.parse_bitcode(intermediate)

    # Only a kernel that is compiled and calls this one asks for it.
    result.library._get_module_for_linking = module  # noqa: SLF001
    return result


@cache
def _offer_memory() -> None:
    """Let machine code find numba's functions for the memory of arrays, as numba does before it compiles its own."""
    for name, address in _nrt_python.c_helpers.items():
        binding.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def _of_numba(environment: Any) -> bool:
    return str(environment.globals["__name__"]).startswith("numba.")


@cache
def _empty() -> bytes:
    nothing: bytes = binding.parse_assembly("").as_bitcode()
    return nothing
