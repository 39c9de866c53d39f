"""Errors of a script, with their positions."""

from typing import Any


class ScriptError(Exception):
    """A script cannot be compiled, or a program has failed.

    Attributes:
        line: Line of the script as it was given, from 1.
        column: Column of the first character of the token at fault, from 1; a tab counts as one.
        text: The error in the controller's words, such as `compile_error_name_not_found:x:`.
        internal: For a log, the exception of a built-in function if the script is not to blame; else None.
    """

    def __init__(self, line: int, column: int, text: str, internal: Exception | None = None) -> None:
        super().__init__(line, column, text)
        self.internal = internal
        self.line = line
        self.column = column
        self.text = text

    def __str__(self) -> str:
        return f"line {self.line}, column {self.column}: {self.text}"


class Fault(Exception):  # noqa: N818  it becomes a ScriptError where it is called
    """A function cannot do what a script requests.

    Built-in functions raise this error with a readable text; the machine adds the position of the call.
    """


def name_not_found(name: str) -> str:
    """Return the text by which clients recognize an unknown name."""
    return f"compile_error_name_not_found:{name}:"


def syntax_error(line: int, why: str) -> str:
    """Return the text by which clients recognize a syntax error."""
    return f"syntax_error_on_line:{line}:{why}:"


def no_program(at: Any, why: str) -> ScriptError:
    """Return a syntax error at a token or a node of the tree."""
    return ScriptError(at.line, at.column, syntax_error(at.line, why))
