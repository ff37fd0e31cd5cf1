"""Reads .idl files: OMG IDL 4.2 text to the model, as far as ROS 2 interfaces use it.

The grammar is in `idl.lark`. What ROS 2's own `rosidl_parser` accepts is accepted, with the same result.
"""

from __future__ import annotations

import ast
import dataclasses
import math
import operator
import re
import reprlib
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    NAMESPACES,
    Action,
    Annotation,
    ArrayType,
    BasicType,
    Constant,
    Field,
    FieldType,
    Interface,
    Location,
    Message,
    ScalarValue,
    SequenceType,
    Service,
    StringType,
    TypeName,
    Value,
    ValueType,
    value_type,
)
from rosidl_adapter_proto.interfaces.problem import problem
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Family, Scalar

MAX_CHARACTERS = 10_000_000
"""The longest file that is read."""

MAX_NESTING = 50
"""How deep modules, and parentheses in expressions, may be nested."""

_LONGEST_QUOTE = 40

# A tree or a token (which is a `str`) of lark; lark itself is imported when the first file is read.
_Node = Any
_Path = tuple[str, ...]

_BASIC_TYPES = {
    spelling: BasicType(row.name)
    for row in SCALARS.values()
    if not row.is_string
    for spelling in (row.name, *row.idl)
}
"""The basic types in each of their spellings (rules 23 to 37 and 206 to 215)."""

_PATH_LENGTH = len(dataclasses.fields(TypeName))

_ENUM_TYPE = BasicType("uint32")

_SERVICE_PARTS = ("_Request", "_Response")
_ACTION_PARTS = ("_Goal", "_Result", "_Feedback")

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


class _Mistake(Exception):
    """What is wrong with a value, where it is not known in which place of the file it stands."""


class _Type(NamedTuple):
    """A type, and the constants that an enum brings along with it."""

    type: FieldType
    enumerators: tuple[Constant, ...] = ()


class _Notes(NamedTuple):
    """What the annotations of a definition say; a default value comes with the place where it stands."""

    comment: tuple[str, ...] = ()
    unit: str | None = None
    default: tuple[ScalarValue, _Node] | None = None
    others: tuple[Annotation, ...] = ()


@dataclass(frozen=True)
class _File:
    """A file, and what has been read from it so far, by full name.

    Attributes:
        typedefs: Typedefs by their last name, since `rosidl_parser` finds them from every scope.
        messages: Where a name that was not defined before is taken for a message.
        values: The values of constants and enumerators.
    """

    text: str
    label: str
    structs: dict[_Path, _Node] = field(default_factory=dict)
    types: dict[_Path, _Type] = field(default_factory=dict)
    typedefs: dict[str, _Type] = field(default_factory=dict)
    messages: dict[_Path, _Node] = field(default_factory=dict)
    constants: dict[_Path, Constant] = field(default_factory=dict)
    values: dict[_Path, ScalarValue] = field(default_factory=dict)

    def location(self, node: _Node) -> Location:
        """Return where the first token of a tree stands."""
        while not isinstance(node, str):
            node = node.children[0]
        return Location(self.label, node.line, node.column)  # type: ignore[attr-defined]

    def problem(self, message: str, place: _Node | Location) -> DefinitionError:
        """Return the error for a mistake at a tree, a token or a location."""
        location = place if isinstance(place, Location) else self.location(place)
        return problem(message, self.text, location)


@contextmanager
def _placed(file: _File, node: _Node, prefix: str = "") -> Iterator[None]:
    """Give a mistake that is made meanwhile its place in the file."""
    try:
        yield
    except _Mistake as mistake:
        raise file.problem(f"{prefix}{mistake}", node) from None


def parse_idl(text: str, name: TypeName, file: str) -> Interface:
    """Read one .idl file: a message, a service or an action.

    Args:
        text: The content of the file.
        name: What the place of the file says that it defines: `package/namespace/Stem`.
        file: What errors call the file.

    Raises:
        DefinitionError: The text is not OMG IDL 4.2, not supported by ROS 2, or defines something else.
    """
    content = _File(text.removeprefix("\ufeff"), file)
    if len(text) > MAX_CHARACTERS:
        message = f"the file is longer than {MAX_CHARACTERS} characters"
        raise problem(message, content.text, Location(file, 1))
    _read_definitions(content, (), _syntax_tree(content).children)
    return _interface(content, name, text)


# Syntax


@lru_cache(maxsize=1)
def _parser() -> Any:
    from lark import Lark

    spellings = (" ".join(f'"{word}"' for word in spelling.split()) for spelling in _BASIC_TYPES)
    return Lark(
        Path(__file__).with_name("idl.lark").read_text("utf-8")
        + f"\n!base_type_spec: {' | '.join(spellings)}\n",
        parser="lalr",
        lexer="contextual",
        start="specification",
        maybe_placeholders=False,
        lexer_callbacks={"UNSUPPORTED_TYPE": _refuse},
    )


def _refuse(token: _Node) -> _Node:
    """Stop at a type that ROS 2 does not have: the grammar does not know the syntax that follows."""
    from lark import UnexpectedToken

    raise UnexpectedToken(token, set())


def _syntax_tree(file: _File) -> _Node:
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


def _unexpected_token(file: _File, token: _Node, parser_state: Any) -> DefinitionError:
    if token in _NOT_IN_ROS:
        return file.problem(f"{_NOT_IN_ROS[token]} is not supported by ROS 2", token)
    if "/*" in file.text[max(0, token.start_pos - 1) : token.start_pos + 2]:
        return file.problem("this comment does not end: add '*/'", token)
    message = f"expected {_syntax_words(_acceptable(parser_state))} before "
    if token.type == "$END":
        lines = file.text.rstrip().split("\n")
        end = Location(file.label, len(lines), len(lines[-1]) + 1)
        return problem(f"{message}the end of the file", file.text, end)
    return file.problem(f"{message}{_quoted(token)}", token)


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
    return _listed(sorted(words or {f"'{each}'" for each in names if each in texts.values()}), "or")


def _quoted(token: str) -> str:
    text = " ".join(token.split())
    return f"'{text}'" if len(text) <= _LONGEST_QUOTE else f"'{text[:_LONGEST_QUOTE]}...'"


def _listed(words: list[str], conjunction: str) -> str:
    return f" {conjunction} ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


# Names


def _name(identifier: str) -> str:
    """Return an identifier without the underscore that escapes a keyword (section 7.2.3.2)."""
    return str(identifier).removeprefix("_")


def _scoped_name(node: _Node) -> tuple[bool, _Path]:
    """Return whether a name (rule 4) begins with `::`, and its identifiers."""
    text = "".join(node.children)
    return text.startswith("::"), tuple(_name(each) for each in text.removeprefix("::").split("::"))


def _candidates(scope: _Path, node: _Node) -> Iterator[_Path]:
    """Yield the full names that a name can stand for, from the innermost scope outwards (section 7.5.2)."""
    absolute, path = _scoped_name(node)
    for depth in range(0 if absolute else len(scope), -1, -1):
        yield scope[:depth] + path


# Definitions


def _read_definitions(file: _File, scope: _Path, definitions: list[_Node]) -> None:
    for each in definitions:
        if not isinstance(each, str) and each.data in _DEFINITION_READERS:
            _DEFINITION_READERS[each.data](file, scope, each)


def _read_module(file: _File, scope: _Path, node: _Node) -> None:
    _, identifier, *definitions = node.children
    if len(scope) == MAX_NESTING:
        raise file.problem(f"modules are nested more than {MAX_NESTING} deep", identifier)
    _read_definitions(file, (*scope, _name(identifier)), definitions)


def _read_constant(file: _File, scope: _Path, node: _Node) -> None:
    annotations, type_node, identifier, expression = node.children
    type = _type(file, scope, type_node).type
    if not isinstance(type, (BasicType, StringType)):  # rule 6
        message = f"constant '{identifier}' must be a number, a boolean, a character or a string"
        raise file.problem(message, type_node)
    value = _evaluated(file, scope, expression, _complement_mask(type))
    with _placed(file, expression, f"constant '{identifier}': "):
        value = _fitted(value, type)
    path = (*scope, _name(identifier))
    _declare_value(file, path, value, identifier)
    notes = _notes(file, scope, annotations)
    file.constants[path] = Constant(
        path[-1], type, value, notes.comment, notes.unit, file.location(identifier)
    )


def _read_enum(file: _File, scope: _Path, node: _Node) -> None:
    """Read an enum as what it is in CDR: `uint32`, with its enumerators as constants."""
    _, identifier, *enumerators = node.children
    constants: list[Constant] = []
    for each in enumerators:
        annotations, enumerator = each.children
        notes = _notes(file, scope, annotations)
        following = int(constants[-1].value) + 1 if constants else 0
        values = (dict(note.parameters).get("value") for note in notes.others if note.name == "value")
        with _placed(file, enumerator, f"enumerator '{enumerator}': "):
            value = _fitted(next((v for v in values if v is not None), following), _ENUM_TYPE)
        path = (*scope, _name(enumerator))
        _declare_value(file, path, value, enumerator)
        constants.append(
            Constant(path[-1], _ENUM_TYPE, value, notes.comment, notes.unit, file.location(enumerator))
        )
    _declare_type(file, (*scope, _name(identifier)), _Type(_ENUM_TYPE, tuple(constants)), identifier)


def _read_typedef(file: _File, scope: _Path, node: _Node) -> None:
    _, type_node, *declarators = node.children
    base = _type(file, scope, type_node)
    for each in declarators:
        identifier = each.children[0]
        _declare_type(file, (*scope, _name(identifier)), _declared_type(file, scope, base, each), identifier)


def _read_struct(file: _File, scope: _Path, node: _Node) -> None:
    identifier = node.children[1]
    path = (*scope, _name(identifier))
    for each in node.find_data("base_struct"):
        message = "inheritance is not supported by ROS 2: repeat the members of the base struct"
        raise file.problem(message, each)
    if path in file.structs:
        raise file.problem(f"struct '{identifier}' is defined twice: remove one", identifier)
    file.structs[path] = node


_DEFINITION_READERS = {
    "module_dcl": _read_module,
    "const_dcl": _read_constant,
    "enum_dcl": _read_enum,
    "typedef_dcl": _read_typedef,
    "struct_def": _read_struct,
}


def _declare_value(file: _File, path: _Path, value: ScalarValue, identifier: _Node) -> None:
    if path in file.values:
        raise file.problem(f"constant '{identifier}' is defined twice: remove or rename one", identifier)
    file.values[path] = value


def _declare_type(file: _File, path: _Path, type: _Type, identifier: _Node) -> None:
    if path in file.messages:
        message = f"type '{identifier}' is used before it is defined: move its definition up"
        raise file.problem(message, file.messages[path])
    if file.types.setdefault(path, type) != type:
        message = f"type '{identifier}' is defined twice, not in the same way: remove or rename one"
        raise file.problem(message, identifier)
    file.typedefs.setdefault(path[-1], type)


# Types


def _type(file: _File, scope: _Path, node: _Node) -> _Type:
    return _TYPE_READERS[node.data](file, scope, node)


def _basic_type(file: _File, scope: _Path, node: _Node) -> _Type:
    return _Type(_BASIC_TYPES[" ".join(node.children)])


def _string_type(file: _File, scope: _Path, node: _Node) -> _Type:
    keyword, *bound = node.children
    return _Type(StringType(keyword == "wstring", _positive(file, scope, bound[1]) if bound else None))


def _sequence_type(file: _File, scope: _Path, node: _Node) -> _Type:
    _, _, element_node, *bound = node.children
    message = "a sequence of {} is not supported by ROS 2: put them in a message"
    if element_node.data == "sequence_type":
        raise file.problem(message.format("sequences"), node)
    element = _type(file, scope, element_node)
    if isinstance(element.type, (ArrayType, SequenceType)):
        raise file.problem(message.format(_plural(element.type)), node)
    size = _positive(file, scope, bound[1]) if len(bound) > 1 else None
    return element._replace(type=SequenceType(element.type, size))


def _named_type(file: _File, scope: _Path, node: _Node) -> _Type:
    """Return what a typedef or an enum stands for; any other name is that of a message."""
    for candidate in _candidates(scope, node):
        if candidate in file.types:
            return file.types[candidate]
    absolute, path = _scoped_name(node)
    *modules, name = path
    if not modules and name in file.typedefs:
        return file.typedefs[name]
    relative = not absolute and (not modules or (len(modules) == 1 and modules[0] in NAMESPACES))
    full_path = (*scope[: _PATH_LENGTH - len(path)], *path) if relative else path
    if len(full_path) != _PATH_LENGTH:
        message = f"unknown type '{'::'.join(path)}': define it above, or write package::msg::Name"
        raise file.problem(message, node)
    file.messages.setdefault(full_path, node)
    return _Type(TypeName(*full_path))


def _nested_type(file: _File, scope: _Path, node: _Node) -> _Type:
    message = (
        f"a type defined inside another is not supported by ROS 2: give the {node.children[0]} its own place"
    )
    raise file.problem(message, node)


_TYPE_READERS: dict[str, Callable[[_File, _Path, _Node], _Type]] = {
    "base_type_spec": _basic_type,
    "string_type": _string_type,
    "wide_string_type": _string_type,
    "sequence_type": _sequence_type,
    "scoped_name": _named_type,
    "nested_dcl": _nested_type,
}


def _declared_type(file: _File, scope: _Path, base: _Type, declarator: _Node) -> _Type:
    """Return the type that a declarator makes of the type before it: `long a[3]` is an array of `long`."""
    identifier, *sizes = declarator.children
    if not sizes:
        return base
    if len(sizes) > 1 or isinstance(base.type, ArrayType):
        message = f"'{identifier}': an array of more than one dimension is not supported by ROS 2"
        raise file.problem(message, identifier)
    if isinstance(base.type, SequenceType):
        message = f"'{identifier}': an array of sequences is not supported by ROS 2: put them in a message"
        raise file.problem(message, identifier)
    return base._replace(type=ArrayType(base.type, _positive(file, scope, sizes[0].children[0])))


def _plural(type: ArrayType | SequenceType) -> str:
    return "arrays" if isinstance(type, ArrayType) else "sequences"


# Expressions


def _evaluated(
    file: _File, scope: _Path, expression: _Node, mask: int | None = None, depth: int = 0
) -> ScalarValue:
    """Return the value of a constant expression (rules 7 to 19).

    Args:
        mask: All bits of the unsigned type that the value is for, which `~` flips; None for other types.
        depth: How many parentheses there are around the expression.
    """
    if depth > MAX_NESTING:
        raise file.problem(f"parentheses are nested more than {MAX_NESTING} deep", expression)
    items = list(expression.children)
    items[::2] = [_operand(file, scope, each, mask, depth) for each in items[::2]]
    for functions in _BINARY_OPERATORS if len(items) > 1 else ():
        folded = items[:1]
        for operator_node, right in zip(items[1::2], items[2::2], strict=True):
            symbol = "".join(operator_node.children)
            if symbol in functions:
                with _placed(file, operator_node):
                    folded[-1] = _combined(symbol, functions[symbol], folded[-1], right)
            else:
                folded += (operator_node, right)
        items = folded
    return items[0]  # type: ignore[no-any-return]


def _combined(
    symbol: str, function: Callable[[Any, Any], Any], left: ScalarValue, right: ScalarValue
) -> ScalarValue:
    whole = symbol not in ("*", "/", "+", "-")
    for each in (left, right):
        _require_number(symbol, each, whole)
    if symbol in ("<<", ">>") and int(right) not in range(_INTEGER_BITS):
        raise _Mistake(f"a shift must be by 0 to 63, not by {right}")
    if symbol in ("/", "%") and not right:
        raise _Mistake("a division by zero")
    result: ScalarValue = function(left, right)
    if isinstance(result, int) and not _SMALLEST_INTEGER <= result <= _LARGEST_INTEGER:
        raise _Mistake(f"the result of '{symbol}' needs more than 64 bits")
    return result


def _require_number(symbol: str, value: ScalarValue, whole: bool) -> None:
    if isinstance(value, (bool, str)) or (whole and isinstance(value, float)):
        kind = "whole numbers" if whole else "numbers"
        raise _Mistake(f"'{symbol}' works on {kind}, not on {_shown(value)}")


def _quotient(left: float, right: float) -> float:
    """Divide as C does: integers towards zero."""
    if isinstance(left, float) or isinstance(right, float):
        return left / right
    quotient = abs(left) // abs(right)
    return quotient if (left < 0) == (right < 0) else -quotient


def _remainder(left: int, right: int) -> int:
    """Return the remainder that goes with `_quotient`: it has the sign of `left`."""
    return abs(left) % abs(right) * (-1 if left < 0 else 1)


_BINARY_OPERATORS: tuple[dict[str, Callable[[Any, Any], Any]], ...] = (
    {"*": operator.mul, "/": _quotient, "%": _remainder},  # rule 13
    {"+": operator.add, "-": operator.sub},  # rule 12
    {"<<": operator.lshift, ">>": operator.rshift},  # rule 11
    {"&": operator.and_},  # rule 10
    {"^": operator.xor},  # rule 9
    {"|": operator.or_},  # rule 8
)
"""The binary operators, those that bind strongest first."""

_INTEGER_BITS = 64
_SMALLEST_INTEGER, _LARGEST_INTEGER = -(1 << 63), (1 << 64) - 1
_LONGEST_INTEGER = 100


def _operand(file: _File, scope: _Path, node: _Node, mask: int | None, depth: int) -> ScalarValue:
    if isinstance(node, str):
        with _placed(file, node, f"{_quoted(node)}: "):
            return _LITERALS[node.type](node)  # type: ignore[attr-defined]
    if node.data == "string_literals":
        with _placed(file, node):
            return _joined_surrogates("".join(_string(each) for each in node.children))
    if node.data == "scoped_name":
        value = _named_value(file, scope, node)
        if value is None:
            raise file.problem(f"unknown constant '{''.join(node.children)}'{_suggestion(file, node)}", node)
        return value
    if node.data == "unary_expr":
        return _unary(file, scope, node, mask, depth)
    return _evaluated(file, scope, node, mask, depth + 1)


def _unary(file: _File, scope: _Path, node: _Node, mask: int | None, depth: int) -> ScalarValue:
    symbol, operand_node = node.children
    value: Any = _operand(file, scope, operand_node, mask, depth)
    with _placed(file, symbol):
        _require_number(symbol, value, whole=symbol == "~")
    if symbol == "~":
        return ~value if mask is None else mask ^ value  # type: ignore[no-any-return]
    return -value if symbol == "-" else value  # type: ignore[no-any-return]


def _named_value(file: _File, scope: _Path, node: _Node) -> ScalarValue | None:
    for candidate in _candidates(scope, node):
        if candidate in file.values:
            return file.values[candidate]
    # As `rosidl_adapter` writes the values of .msg files that are no numbers in IDL.
    return {"inf": math.inf, "nan": math.nan}.get("".join(node.children))


def _suggestion(file: _File, node: _Node) -> str:
    _, path = _scoped_name(node)
    names = ("::".join(each) for each in file.values if each[-1] == path[-1])
    return next((f": write {each}" for each in names), ": define it above")


def _positive(file: _File, scope: _Path, expression: _Node) -> int:
    """Return the value of an array size or a bound (rule 19)."""
    value = _evaluated(file, scope, expression)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise file.problem(f"expected a whole number above 0, not {_shown(value)}", expression)
    return value


def _complement_mask(type: ValueType) -> int | None:
    """Return all bits of an unsigned type, and None for any other (section 7.4.1.4.3.4)."""
    if isinstance(type, TypeName) or type.scalar.family not in (Family.INTEGER, Family.OCTET):
        return None
    return None if type.scalar.signed else type.scalar.range[1]


# Literals


def _integer(literal: str) -> int:
    base = 16 if literal[:2] in ("0x", "0X") else 8 if literal[0] == "0" else 10
    try:
        value = int(literal[:_LONGEST_INTEGER], base)
    except ValueError:
        raise _Mistake("a whole number that begins with 0 is octal: remove the 0") from None
    if len(literal) > _LONGEST_INTEGER or value > _LARGEST_INTEGER:
        raise _Mistake("a whole number must fit into 64 bits")
    return value


def _character(literal: str) -> str:
    text = _unescaped(literal[literal.index("'") + 1 : -1], wide=literal[0] == "L")
    if len(text) != 1:
        raise _Mistake("expected one character between two '")
    return text


_LITERALS: dict[str, Callable[[str], ScalarValue]] = {
    "INTEGER": _integer,
    "FLOAT": float,
    "FIXED": lambda literal: float(literal[:-1]),
    "BOOLEAN": lambda literal: literal == "TRUE",
    "CHARACTER": _character,
}


def _string(literal: str) -> str:
    wide = literal[0] == "L"
    text = _unescaped(literal[2 if wide else 1 : -1], wide)
    # `rosidl_parser` looks for escaped quotes and backslashes a second time, in what it has decoded.
    return _TWICE_ESCAPED.sub(r"\1", text) if "\\" in text else text


_TWICE_ESCAPED = re.compile(r'\\(["\\])')

# Table 7-9. As in `rosidl_parser`, `\?` is left as it is, and `\u` in a string that is not wide.
_ESCAPE = re.compile(r"""\\(?:([ntvbrfa\\'"])|([0-7]{1,3})|x([0-9A-Fa-f]{1,2})|u([0-9A-Fa-f]{1,4}))""")
_ESCAPED_CHARACTERS = dict(zip("ntvbrfa", "\n\t\v\b\r\f\a", strict=True))


def _unescaped(text: str, wide: bool) -> str:
    def character(match: re.Match[str]) -> str:
        simple, octal, hexadecimal, unicode = match.groups()
        if simple:
            return _ESCAPED_CHARACTERS.get(simple, simple)
        if unicode and not wide:
            return match[0]
        return chr(int(octal, 8) if octal else int(hexadecimal or unicode, 16))

    return _ESCAPE.sub(character, text) if "\\" in text else text


def _joined_surrogates(text: str) -> str:
    """Return a text where two `\\u` escapes that make one character (a surrogate pair) are that character."""
    if text.isascii():
        return text
    try:
        return text.encode("utf-16-le", "surrogatepass").decode("utf-16-le")
    except UnicodeDecodeError:
        raise _Mistake("half of a surrogate pair is not a character: write both halves") from None


# Values


def _shown(value: object) -> str:
    try:
        return reprlib.repr(value)
    except ValueError:  # Python refuses to print whole numbers of thousands of digits
        return "a number of thousands of digits"


def _fitted(value: object, type: ValueType) -> ScalarValue:
    """Return a value in the form that the model has it in for a type.

    Raises:
        _Mistake: The type cannot hold the value.
    """
    if isinstance(type, TypeName):
        raise _Mistake(f"the message {type} cannot have a default value")
    bound = type.bound if isinstance(type, StringType) else None
    return _FITTERS[type.scalar.family](value, type.scalar, bound)


def _fitted_boolean(value: object, scalar: Scalar, bound: int | None) -> bool:
    if not isinstance(value, int) or value not in (0, 1):
        raise _Mistake(f"{_shown(value)} is not TRUE or FALSE")
    return bool(value)


def _fitted_integer(value: object, scalar: Scalar, bound: int | None) -> int:
    value, (low, high) = _number(value), scalar.range
    if not isinstance(value, int) or not low <= value <= high:
        raise _Mistake(f"{_shown(value)} does not fit {scalar.name}: use a whole number from {low} to {high}")
    return value


def _fitted_character(value: object, scalar: Scalar, bound: int | None) -> int:
    is_character = isinstance(value, str) and len(value) == 1
    return _fitted_integer(ord(str(value)) if is_character else value, scalar, bound)


def _fitted_float(value: object, scalar: Scalar, bound: int | None) -> float:
    try:
        return float(_number(value))
    except OverflowError:
        raise _Mistake(f"{_shown(value)} is too large") from None


def _fitted_string(value: object, scalar: Scalar, bound: int | None) -> str:
    if not isinstance(value, str):
        raise _Mistake(f"{_shown(value)} is not a string: put it in quotes")
    if bound is not None and len(value) > bound:
        raise _Mistake(f"{_shown(value)} is longer than {bound} characters")
    return value


_FITTERS: Mapping[Family, Callable[[object, Scalar, int | None], ScalarValue]] = {
    Family.BOOLEAN: _fitted_boolean,
    Family.INTEGER: _fitted_integer,
    Family.FLOATING_POINT: _fitted_float,
    Family.OCTET: _fitted_integer,
    Family.CHARACTER: _fitted_character,
    Family.STRING: _fitted_string,
    Family.WSTRING: _fitted_string,
}


def _number(value: object) -> int | float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _Mistake(f"{_shown(value)} is not a number")
    return value


def _default(value: ScalarValue, type: FieldType) -> Value:
    """Return the default value that an annotation gives to a field.

    Raises:
        _Mistake: The type cannot hold the value.
    """
    if not isinstance(type, (ArrayType, SequenceType)):
        return _fitted(value, type)
    values = _tuple(value)
    if isinstance(type, ArrayType) and len(values) != type.size:
        raise _Mistake(f"{len(values)} values for an array of {type.size}")
    if isinstance(type, SequenceType) and type.bound is not None and len(values) > type.bound:
        raise _Mistake(f"{len(values)} values for a sequence of at most {type.bound}")
    return tuple(_fitted(each, type.value_type) for each in values)


def _tuple(value: ScalarValue) -> tuple[object, ...]:
    """Return the values of an array or sequence: `rosidl_adapter` writes them as a Python tuple."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values = ast.literal_eval(value) if isinstance(value, str) else None
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError):
        values = None
    if not isinstance(values, (tuple, list)):
        raise _Mistake(f'{_shown(value)} is not of the form "(1, 2, 3)"')
    return tuple(values)


# Annotations


def _notes(file: _File, scope: _Path, node: _Node, mask: int | None = None) -> _Notes:
    comment: list[str] = []
    unit: str | None = None
    default: tuple[ScalarValue, _Node] | None = None
    others: list[Annotation] = []
    for each in node.children:
        annotation = _annotation(file, scope, each, mask)
        parameters = dict(annotation.parameters)
        if annotation.name == "verbatim" and parameters.get("language") == "comment" and "text" in parameters:
            comment += str(parameters["text"]).splitlines()
        elif annotation.name == "unit" and "value" in parameters:
            unit = str(parameters["value"])
        elif annotation.name == "default":
            if "value" not in parameters or default:
                raise file.problem("expected one default value: write @default(value=...) once", each)
            default = parameters["value"], each.children[-1]
        else:
            others.append(annotation)
    return _Notes(tuple(comment), unit, default, tuple(others))


def _annotation(file: _File, scope: _Path, node: _Node, mask: int | None) -> Annotation:
    name, *parameters = node.children
    return Annotation(
        "".join(name.children), tuple(_parameter(file, scope, each, mask) for each in parameters)
    )


def _parameter(file: _File, scope: _Path, node: _Node, mask: int | None) -> tuple[str, ScalarValue]:
    """Return the name and value of a parameter; a name that is no constant, as `FINAL` may be, is text."""
    name, expression = ("value", node) if node.data == "const_expr" else node.children
    single = expression.children[0] if len(expression.children) == 1 else None
    if not isinstance(single, str) and single is not None and single.data == "scoped_name":
        value = _named_value(file, scope, single)
        return _name(name), "".join(single.children) if value is None else value
    return _name(name), _evaluated(file, scope, expression, mask)


# Interfaces


def _interface(file: _File, name: TypeName, text: str) -> Interface:
    if file.structs.keys() == {_path(name)}:
        return _message(file, name, text)
    if service := _messages(file, name, _SERVICE_PARTS):
        request, response = service
        return Service(name, request, response, text)
    if action := _messages(file, name, _ACTION_PARTS):
        goal, result, feedback = action
        return Action(name, goal, result, feedback, text)
    raise _misplaced(file, name)


def _messages(file: _File, name: TypeName, suffixes: tuple[str, ...]) -> list[Message]:
    """Return the messages of a service or an action, or none if these are not the structs of the file."""
    names = [name.sibling(suffix) for suffix in suffixes]
    complete = file.structs.keys() == {_path(each) for each in names}
    return [_message(file, each) for each in names] if complete else []


def _misplaced(file: _File, name: TypeName) -> DefinitionError:
    """Return the error for a file that does not define what its place says."""
    choices = {"a message": ("",), "a service": _SERVICE_PARTS, "an action": _ACTION_PARTS}
    wanted = ", or ".join(
        f"{_listed([name.name + suffix for suffix in suffixes], 'and')} ({kind})"
        for kind, suffixes in choices.items()
    )
    message = f"this file must define {wanted}, in module {name.package}::{name.namespace}; it defines"
    if not file.structs:
        return file.problem(f"{message} no struct", Location(file.label, 1))
    found = _listed(["::".join(each) for each in [*file.structs][:4]], "and")
    allowed = {_path(name.sibling(suffix)) for suffixes in choices.values() for suffix in suffixes}
    culprit = next((each for each in file.structs if each not in allowed), next(iter(file.structs)))
    return file.problem(f"{message} {found}", file.structs[culprit].children[1])


def _path(name: TypeName) -> _Path:
    return name.package, name.namespace, name.name


def _message(file: _File, name: TypeName, text: str = "") -> Message:
    path = _path(name)
    annotations, identifier, *members = file.structs[path].children
    if not members:
        hint = f"add 'uint8 {EMPTY_STRUCT_FIELD};'"
        raise file.problem(f"struct '{identifier}' is empty, which IDL does not allow: {hint}", identifier)
    fields: dict[str, Field] = {}
    enums: dict[int, tuple[Constant, ...]] = {}
    for member in members:
        base = _type(file, path[:-1], member.children[1])
        enums[id(base.enumerators)] = base.enumerators
        for each in _fields(file, path[:-1], member, base):
            if fields.setdefault(each.name, each) is not each:
                raise file.problem(f"member '{each.name}' is defined twice: rename one", each.location)
    constants = _constants(file, name, enums.values())
    notes = _notes(file, path[:-1], annotations)
    return Message(name, tuple(fields.values()), constants, notes.comment, notes.others, text)


def _fields(file: _File, scope: _Path, member: _Node, base: _Type) -> Iterator[Field]:
    """Yield the fields that a member declares: more than one for `long a, b[3];`."""
    annotations, _, *declarators = member.children
    notes = _notes(file, scope, annotations, _complement_mask(value_type(base.type)))
    defaults: dict[FieldType, Value] = {}
    for declarator in declarators:
        identifier = declarator.children[0]
        type = _declared_type(file, scope, base, declarator).type
        if notes.default and type not in defaults:
            with _placed(file, notes.default[1], f"default of '{identifier}': "):
                defaults[type] = _default(notes.default[0], type)
        location = file.location(identifier)
        default = defaults.get(type)
        yield Field(_name(identifier), type, default, notes.comment, notes.unit, notes.others, location)


def _constants(file: _File, name: TypeName, enums: Iterable[tuple[Constant, ...]]) -> tuple[Constant, ...]:
    """Return the constants of a message: those of the module named after it, and of its enums."""
    module = (f"{name.name}_Constants",)
    declared = (constant for path, constant in file.constants.items() if path[-2:-1] == module)
    constants: dict[str, Constant] = {}
    for each in chain(declared, chain.from_iterable(enums)):
        if constants.setdefault(each.name, each) != each:
            message = f"{name.name} has two constants '{each.name}': rename one"
            raise file.problem(message, each.location)
    return tuple(constants.values())
