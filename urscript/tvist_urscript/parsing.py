"""From the text of a script to its tree."""

from functools import cache
from typing import Any, cast

from lark import Lark, Token, UnexpectedCharacters, UnexpectedInput, UnexpectedToken
from lark.exceptions import VisitError

from tvist_urscript import tree
from tvist_urscript.building import Builder
from tvist_urscript.errors import ScriptError, syntax_error
from tvist_urscript.grammar import GRAMMAR
from tvist_urscript.lines import Lines


@cache
def _parser(*, several: bool) -> Lark:
    return Lark(
        GRAMMAR,
        parser="lalr",
        lexer="basic",
        postlex=cast("Any", Lines(several=several)),
        transformer=Builder(),
        maybe_placeholders=False,
    )


def parse(text: str, *, several: bool = False) -> list[tree.Statement]:
    """Return the statements of a text on its outermost level.

    Args:
        text: The text.
        several: Whether several statements may follow each other on a line, as in UR's interpreter mode.

    Raises:
        ScriptError: The text is no script; the position is that of the first token that does not fit.
    """
    try:
        return cast("list[tree.Statement]", _parser(several=several).parse(text))
    except VisitError as error:
        if isinstance(error.orig_exc, ScriptError):
            raise error.orig_exc from None
        raise
    except UnexpectedInput as error:
        raise _unfit(text, error) from None


def _unfit(text: str, error: UnexpectedInput) -> ScriptError:
    if isinstance(error, UnexpectedCharacters):
        character = text[error.pos_in_stream or 0]
        why = 'a text has no closing "' if character == '"' else f"unexpected character {character!r}"
        return ScriptError(error.line, error.column, syntax_error(error.line, why))
    if isinstance(error, UnexpectedToken) and str(error.token):  # the end of the text is a token without any
        token: Token = error.token
        what = "end of the line" if str(token) == "\n" else f"'{_shortened(token)}'"
        assert token.line is not None
        assert token.column is not None
        return ScriptError(token.line, token.column, syntax_error(token.line, f"unexpected {what}"))
    lines = text.split("\n")
    line, column = len(lines), len(lines[-1]) + 1
    return ScriptError(line, column, syntax_error(line, "the text ends before the program does"))


def _shortened(token: str) -> str:
    return token if len(token) <= 40 else f"{token[:40]}..."
