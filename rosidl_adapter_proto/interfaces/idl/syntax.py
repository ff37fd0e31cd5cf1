"""From the text of a file to its syntax tree, and what is wrong with a text that has none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.idl.file import File, Node
from rosidl_adapter_proto.interfaces.idl.mistakes import listed, quoted
from rosidl_adapter_proto.interfaces.model import BasicType, Location
from rosidl_adapter_proto.interfaces.problem import problem
from rosidl_adapter_proto.interfaces.scalars import SCALARS

BASIC_TYPES = {
    spelling: BasicType(row.name)
    for row in SCALARS.values()
    if not row.is_string
    for spelling in (row.name, *row.idl)
}
"""The basic types in each of their spellings (rules 23 to 37 and 206 to 215)."""

_NOT_IN_ROS = {
    "fixed": "a fixed-point number",  # rules 42 and 43
    "union": "a union",  # rule 49
    "native": "a native type",  # rule 61
    "any": "the type any",  # rule 69
    "interface": "an interface",  # rule 73
    "exception": "an exception",  # rule 92
    "import": "an import",  # rule 95
    "valuetype": "a value type",  # rule 99
    "component": "a component",  # rule 133
    "map": "a map",  # rule 199
    "bitset": "a bitset",  # rule 200
    "bitmask": "a bitmask",  # rule 204
}

_SYNTAX_WORDS = {
    "module": "a definition",
    "boolean": "a type",
    "INTEGER": "a value",
    "IDENTIFIER": "a name",
    **{each: f"'{each}'" for each in "{}()[]<>;,="},
}
"""How an error names what the grammar would take; terminals that are not here go without saying."""

_IMPLIED_SYNTAX_WORDS = {
    "a type": ("a name",),
    "a value": ("a name", "'('"),
    "a name": ("','",),
    "';'": ("','", "'['", "'>'"),
    "')'": ("'>'",),
    "']'": ("'>'",),
}

_CHARACTER_HINTS = {
    "#": "of the preprocessor, only #include is supported: remove this directive",
    '"': "this string does not end on its line: add the closing '\"'",
    "'": "expected one character, or an escape sequence, between two '",
}


def syntax_tree(file: File) -> Node:
    """Return the syntax tree of a file.

    Raises:
        DefinitionError: Its text does not follow the grammar, or uses what ROS 2 does not have.
    """
    from lark import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

    try:
        return _parser().parse(file.text)
    except UnexpectedToken as error:
        unexpected: Any = error  # the stubs of lark-parser do not know its token
        raise _unexpected_token(file, unexpected.token, unexpected.state) from None
    except UnexpectedInput as error:
        assert isinstance(error, UnexpectedCharacters)
        character = file.text[error.pos_in_stream]
        message = _CHARACTER_HINTS.get(character, f"unexpected character {character!r}: remove it")
        raise problem(message, file.text, Location(file.label, error.line, error.column)) from None


@lru_cache(maxsize=1)
def _parser() -> Any:
    from lark import Lark

    spellings = (" ".join(f'"{word}"' for word in spelling.split()) for spelling in BASIC_TYPES)
    return Lark(
        Path(__file__).with_name("grammar.lark").read_text("utf-8")
        + f"\n!base_type_spec: {' | '.join(spellings)}\n",
        parser="lalr",
        lexer="contextual",
        start="specification",
        maybe_placeholders=False,
        lexer_callbacks={"UNSUPPORTED_TYPE": _refuse},
    )


def _refuse(token: Node) -> Node:
    """Stop at a type that ROS 2 does not have: the grammar does not know the syntax that follows."""
    from lark import UnexpectedToken

    raise UnexpectedToken(token, set())


def _unexpected_token(file: File, token: Node, parser_state: Any) -> DefinitionError:
    if token in _NOT_IN_ROS:
        return file.problem(f"{_NOT_IN_ROS[token]} is not supported by ROS 2", token)
    if "/*" in file.text[max(0, token.start_pos - 1) : token.start_pos + 2]:
        return file.problem("this comment does not end: add '*/'", token)
    message = f"expected {_syntax_words(_acceptable(parser_state))} before "
    if token.type == "$END":
        lines = file.text.rstrip().split("\n")
        end = Location(file.label, len(lines), len(lines[-1]) + 1)
        return problem(f"{message}the end of the file", file.text, end)
    return file.problem(f"{message}{quoted(token)}", token)


def _acceptable(parser_state: Any) -> Iterator[str]:
    """Yield the terminals that the parser could go on with.

    Those in lark's own exception include some that only fit elsewhere, since LALR states are merged, and
    `InteractiveParser.accepts` copies all that was parsed so far.
    """
    states = parser_state.parse_conf.states
    for terminal in filter(str.isupper, states[parser_state.state_stack[-1]]):
        stack = list(parser_state.state_stack)
        while terminal in states[stack[-1]]:
            action, target = states[stack[-1]][terminal]
            if str(action) == "Shift":
                yield terminal
                break
            del stack[len(stack) - len(target.expansion) :]
            stack.append(states[stack[-1]][target.origin.name][1])


def _syntax_words(terminals: Iterable[str]) -> str:
    """Return `a type, ';' or '}'` for the terminals that the grammar would take."""
    texts = {each.name: each.pattern.value for each in _parser().terminals if each.pattern.type == "str"}
    names = {texts.get(each, each) for each in terminals}
    words = {_SYNTAX_WORDS[each] for each in names if each in _SYNTAX_WORDS}
    for word in words & _IMPLIED_SYNTAX_WORDS.keys():
        words = words.difference(_IMPLIED_SYNTAX_WORDS[word])
    return listed(sorted(words or {f"'{each}'" for each in names if each in texts.values()}), "or")
