"""Message types as JSON Schema, with the docstring of each field as its description."""

import ast
import inspect
import sys
from functools import cache
from typing import Any

import msgspec

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(message: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the self-contained JSON Schema of one message, for a recording or a client in another language."""
    (root,), parts = components((message,), "#/$defs/{name}")
    name = root["$ref"].removeprefix("#/$defs/")
    schema: dict[str, Any] = {"$schema": DIALECT} | parts.pop(name)
    return schema | {"$defs": parts} if parts else schema


def components(
    messages: tuple[type[msgspec.Struct], ...], reference: str
) -> tuple[tuple[dict[str, Any], ...], dict[str, Any]]:
    """Return references to messages (`reference` has `{name}` in it), and the JSON Schemas of all structs by name."""
    roots, parts = msgspec.json.schema_components(messages, ref_template=reference)
    structs = _structs()
    for name, schema in parts.items():
        for field, text in field_docs(structs[name]).items():
            schema["properties"][field]["description"] = text
    return roots, dict(sorted(parts.items()))


@cache
def field_docs(described: type) -> dict[str, str]:
    """Return the docstrings of a struct's fields, starting with its base's, or of an enumeration's members."""
    base = described.__base__
    docs = {} if base is None or not base.__module__.startswith("tvist_") else dict(field_docs(base))
    body = _classes(described.__module__)[described.__name__]
    for field, below in zip(body.body, body.body[1:], strict=False):
        match field, below:
            case (
                ast.AnnAssign(target=ast.Name(id=name)) | ast.Assign(targets=[ast.Name(id=name)]),
                ast.Expr(value=ast.Constant(value=str(text))),
            ):
                docs[name] = " ".join(inspect.cleandoc(text).split())
    return docs


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """Return a module's classes, parsed once, since `inspect.getsource` would parse it for each class."""
    tree = ast.parse(inspect.getsource(sys.modules[module]))
    return {part.name: part for part in ast.walk(tree) if isinstance(part, ast.ClassDef)}


def _structs(base: type[msgspec.Struct] = msgspec.Struct) -> dict[str, type[msgspec.Struct]]:
    """Return the protocol's structs by their names, which are unique."""
    found: dict[str, type[msgspec.Struct]] = {}
    for kind in base.__subclasses__():
        found |= {kind.__name__: kind} if kind.__module__.startswith("tvist_protocol.") else {}
        found |= _structs(kind)
    return found
