"""Parse the text of a script to its tree."""

from functools import cache
from typing import Any, cast

from lark import Lark, Token, UnexpectedCharacters, UnexpectedInput, UnexpectedToken
from lark.exceptions import VisitError

from tvist_urscript import tree
from tvist_urscript.building import Builder
from tvist_urscript.errors import ScriptError, no_program, syntax_error
from tvist_urscript.lines import Lines

GRAMMAR = r"""
start: (statement _NEWLINE)*
block: (statement _NEWLINE)*

?statement: function | branches | loop | simple

function: (DEF | SEC | THREAD) NAME "(" (parameter ("," parameter)*)? ")" ":" block "end"
parameter: NAME ("=" expression)?

branches: IF expression ":" block ("elif" expression ":" block)* ("else" ":" block)? "end"
loop: WHILE expression ":" block "end"

?simple: assign
    | expression -> evaluate
    | RETURN expression? -> return_value
    | (KILL | JOIN) expression -> handle
    | (BREAK | CONTINUE | PASS) -> word
    | (HALT | ENTER_CRITICAL | EXIT_CRITICAL) ("(" ")")? -> word
    | LABEL -> label

assign: (GLOBAL | LOCAL)? postfix EQUAL assigned
?assigned: expression
    | postfix EQUAL assigned -> chained

?expression: either
?either: unequal ("or" unequal)*
?unequal: both ("xor" both)*
?both: denied ("and" denied)*
?denied: NOT denied -> unary
    | comparison
?comparison: sum
    | sum COMPARISON sum -> binary
?sum: term
    | sum (PLUS | MINUS) term -> binary
?term: signed
    | term (STAR | SLASH | PERCENT) signed -> binary
?signed: MINUS signed -> unary
    | PLUS signed -> plus
    | postfix
?postfix: atom
    | postfix LSQB expression ("," expression)* "]" -> index
    | postfix "." NAME -> member
    | postfix "." NAME "(" (argument ("," argument)*)? ")" -> method
?atom: NUMBER -> number
    | TEXT -> text
    | (TRUE | FALSE | NONE) -> constant
    | NAME -> name
    | call
    | RUN call -> run
    | LSQB (expression ("," expression)*)? "]" -> listing
    | LPAR expression ("," expression)* ")" -> parentheses

call: NAME "(" (argument ("," argument)*)? ")"
?argument: expression -> positional
    | NAME "=" expression -> named

NAME: /[A-Za-z_][A-Za-z_0-9]*/
NUMBER: /(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?/
TEXT: /"[^"\n]*"/
LABEL: /\$[^\n]*/
DEF: "def"
SEC: "sec"
THREAD: "thread"
IF: "if"
WHILE: "while"
RETURN: "return"
KILL: "kill"
JOIN: "join"
BREAK: "break"
CONTINUE: "continue"
PASS: "pass"
HALT: "halt"
ENTER_CRITICAL: "enter_critical"
EXIT_CRITICAL: "exit_critical"
GLOBAL: "global"
LOCAL: "local"
NOT: "not"
RUN: "run"
TRUE: "True"
FALSE: "False"
NONE: "None"
COMPARISON: "==" | "!=" | "<=" | ">=" | "<" | ">"
EQUAL: "="
PLUS: "+"
MINUS: "-"
STAR: "*"
SLASH: "/"
PERCENT: "%"
LPAR: "("
LSQB: "["
_NEWLINE: "\n"

%ignore /[ \t\r\f]+/
%ignore /#[^\n]*/
"""
"""Grammar for lark; `lines.py` has already replaced line breaks by ends of statements."""


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
    """Return the statements on a text's outermost level; if `several`, a line may have more than one."""
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
        return no_program(error, why)
    if isinstance(error, UnexpectedToken) and str(error.token):  # the end of the text is an empty token
        token: Token = error.token
        shown = token if len(token) <= 40 else f"{token[:40]}..."
        what = "end of the line" if str(token) == "\n" else f"'{shown}'"
        return no_program(token, f"unexpected {what}")
    lines = text.split("\n")
    line, column = len(lines), len(lines[-1]) + 1
    return ScriptError(line, column, syntax_error(line, "the text ends before the program does"))
