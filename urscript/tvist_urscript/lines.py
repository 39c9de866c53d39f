"""Finds the ends of statements, since indentation and most line breaks have no meaning in URScript."""

from collections.abc import Iterator

from lark import Token, UnexpectedInput

from tvist_urscript.errors import no_program

LONGEST_NAME = 255  # longest name [characters]
MOST_BRACKETS = 100  # most nested brackets
END = "_NEWLINE"

_OPENS = frozenset(("LPAR", "LSQB"))
_CLOSES = frozenset(("RPAR", "RSQB"))
_GOES_ON = frozenset(
    ("PLUS", "MINUS", "STAR", "SLASH", "PERCENT", "COMPARISON", "EQUAL", "AND", "OR", "XOR", "NOT",
     "COMMA", "COLON", "RUN")
)  # fmt: skip
"""Tokens after which a line break does not end a statement, because the statement is incomplete."""
_BEGINS = frozenset(
    ("DEF", "SEC", "THREAD", "IF", "WHILE", "RETURN", "KILL", "JOIN", "BREAK", "CONTINUE", "PASS", "HALT",
     "ENTER_CRITICAL", "EXIT_CRITICAL", "GLOBAL", "LOCAL", "END", "ELIF", "ELSE")
)  # fmt: skip
"""Tokens before which a statement ends even without a line break: ur_rtde sends `0 global b = 1`."""
_COMPLETE = frozenset(
    ("NAME", "NUMBER", "TEXT", "TRUE", "FALSE", "NONE", "RPAR", "RSQB", "PASS", "BREAK", "CONTINUE", "HALT",
     "ENTER_CRITICAL", "EXIT_CRITICAL", "END")
)  # fmt: skip
"""Tokens after which, on the same line, a name or `run` can only be the start of the next statement."""
_AFTER_NAME = frozenset(("LPAR", "LSQB", "EQUAL", "DOT"))
"""Tokens that may follow the name with which a statement starts."""


class Lines:
    """Converts the tokens of a text to those of the grammar, in which one token ends each statement."""

    always_accept = (END,)

    def __init__(self, *, several: bool) -> None:
        self._several = several

    def process(self, tokens: Iterator[Token]) -> Iterator[Token]:  # noqa: C901  one pass, since texts can be long
        """Remove line breaks inside statements and add an end to statements that end without a line break."""
        brackets = 0
        last = END
        pending: Token | None = None
        named = _named(tokens)
        for token in _parted(named) if self._several else named:
            kind = token.type
            if kind == END:
                if brackets == 0 and last != END and last not in _GOES_ON and pending is None:
                    pending = token
                continue
            if pending is not None:
                if kind != "COLON":
                    yield pending
                    last = END
                pending = None
            if kind in _BEGINS and brackets == 0 and last not in (END, "COLON"):
                yield Token.new_borrow_pos(END, token, token)
            if kind in _OPENS:
                brackets += 1
                if brackets > MOST_BRACKETS:
                    raise no_program(token, f"more than {MOST_BRACKETS} levels are nested here")
            elif kind in _CLOSES and brackets > 0:
                brackets -= 1
            elif kind == "NAME" and len(token) > LONGEST_NAME:
                why = f"a name of {len(token)} characters is too long: the limit is {LONGEST_NAME}"
                raise no_program(token, why)
            yield token
            last = kind
            token_before = token
        if pending is not None:
            yield pending
        elif last != END:
            yield _after(token_before)


def _named(tokens: Iterator[Token]) -> Iterator[Token]:
    """Turn keywords after a point, and `sec` in brackets, into names: `time().sec`, `struct(sec=1)`."""
    last, brackets = END, 0
    for token in tokens:
        brackets += (token.type in _OPENS) - (token.type in _CLOSES)
        last, before = token.type, last
        is_name = token.isidentifier() if before == "DOT" else last == "SEC" and brackets > 0
        yield Token.new_borrow_pos("NAME", token, token) if is_name else token


def _parted(tokens: Iterator[Token]) -> Iterator[Token]:
    """Add an end between statements on one line, which UR's interpreter mode allows: `a = 1 textmsg(a)`."""
    last = END
    name: Token | None = None
    try:
        for token in tokens:
            if name is not None:
                if token.type in _AFTER_NAME:
                    yield Token.new_borrow_pos(END, name, name)
                yield name
                name = None
            if token.type == "NAME" and last in _COMPLETE:
                name = token
            else:
                if token.type == "RUN" and last in _COMPLETE:
                    yield Token.new_borrow_pos(END, token, token)
                yield token
            last = token.type
    except UnexpectedInput:
        if name is not None:  # the first error
            yield name
        raise
    if name is not None:
        yield name


def _after(token: Token) -> Token:
    """Return a token without text that ends a statement, placed after `token`, the last one of the text."""
    line, column = token.end_line, token.end_column
    return Token(END, "", token.end_pos, line, column, line, column)
