"""The grammar of URScript, for lark. `lines.py` has made every line break that is left the end of a statement."""

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

assign: (GLOBAL | LOCAL)? postfix EQUAL expression

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
