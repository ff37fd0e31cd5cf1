"""Reads `.msg`, `.srv` and `.action` definitions.

The rules are those of ROS 2's own `rosidl_adapter`, its treatment of comments, units and escape sequences included.
"""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    Action,
    ArrayType,
    BasicType,
    Constant,
    Field,
    FieldType,
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
from rosidl_adapter_proto.interfaces.problem import problem, wide_string_warning
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Family, Scalar

_PRIMITIVE_TYPES = {name: row for row in SCALARS.values() for name in row.msg}
"""The primitive types of `.msg` by their names there."""

_NAME_RULES = {
    "package": re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*"),
    "field": re.compile(r"(?!.*__)(?!.*_$)[a-z][a-z0-9_]*"),
    "message": re.compile(r"[A-Z][A-Za-z0-9]*"),
    "constant": re.compile(r"(?!.*__)(?!.*_$)[A-Z][A-Z0-9_]*"),
}
_NAME_ADVICE = {
    "package": "use lower case letters, digits and single underscores, beginning with a letter",
    "field": "use lower case letters, digits and single underscores, beginning with a letter",
    "message": "use letters and digits, beginning with an upper case letter",
    "constant": "use upper case letters, digits and single underscores, beginning with a letter",
}
_NAMES_ELSEWHERE = {
    "boolean": "bool",
    "double": "float64",
    "float": "float32 or float64",
    "int": "int32 or int64",
    "long": "int32 or int64",
    "octet": "byte",
    "short": "int16",
    "str": "string",
    "uint": "uint32 or uint64",
}
_LOOSE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_STRING_CONSTANT = re.compile(r"\s*string\s[^#=]*=")

_DERIVED_SUFFIXES = ("_Request", "_Response", "_Goal", "_Result", "_Feedback")

_TYPE = re.compile(r"(?P<element>[^\[\]]*)(\[(?P<upper_bound><=)?(?P<size>[^\[\]]*)\])?")
_UP_TO_BRACKET_OR_COMMA = re.compile(r"([^,\]]*)([,\]]?)")
# A string inside the quotes of an .idl file, and its escape sequences as `rosidl_parser` knows them (table 7-9).
_IDL_STRING = re.compile(r"""([^"\\\n\r]|\\[^\n\r])*""")
_IDL_ESCAPE = re.compile(r"""\\(?:([ntvbrfa\\'"])|([0-7]{1,3})|x([0-9a-fA-F]{1,2}))""")
_IDL_ESCAPED_AGAIN = re.compile(r'\\(["\\])')
SEPARATOR = "---"
"""The line between the parts of a service or an action."""
_LONGEST_QUOTATION = 60


@dataclass(frozen=True)
class Dialect:
    """The rules by which a `.msg`, `.srv` or `.action` text is read.

    Attributes:
        name: What it is called.
        is_loose: Whether names, indentation, comments and `package/msg/Name` are allowed that ROS 2 refuses.
        types: What names of types mean besides those of ROS 2, or instead of them.
        has_whole_line_strings: Whether a string constant goes up to the end of its line, quotes and `#` included.
    """

    name: str
    is_loose: bool = False
    types: Mapping[str, ValueType] = field(default_factory=dict, compare=False, repr=False)
    has_whole_line_strings: bool = False


HEADER = TypeName("std_msgs", "msg", "Header")
_TIMES: Mapping[str, ValueType] = {
    "time": TypeName("builtin_interfaces", "msg", "Time"),
    "duration": TypeName("builtin_interfaces", "msg", "Duration"),
}

ROS2 = Dialect("ros2")
"""What `rosidl_adapter` accepts."""

RECORDED = Dialect("recorded", is_loose=True, types=_TIMES)
"""What is in recordings: of ROS 2, but also by hand and by tools, which know ROS 1 as well."""

RECORDED_WITH_HEADER = Dialect("recorded with Header", is_loose=True, types={**_TIMES, "Header": HEADER})
"""The same, where `Header` without a package can only be that of `std_msgs`."""

ROS1 = Dialect(
    "ros1",
    is_loose=True,
    types={**_TIMES, "Header": HEADER, "byte": BasicType("int8"), "char": BasicType("uint8")},
    has_whole_line_strings=True,
)
"""ROS 1 (https://wiki.ros.org/msg)."""


def parse_msg(text: str, name: TypeName, file: str, dialect: Dialect = ROS2) -> Message:
    """Read a `.msg` definition.

    Args:
        text: The definition.
        name: The type that it defines.
        file: Where it came from, for messages.
        dialect: The rules of the text.

    Raises:
        DefinitionError: ROS would not accept the definition; the message gives file, line and column.
    """
    return _MessageReader(text, name, file, dialect).read(0, len(text.splitlines()), text)


def parse_srv(text: str, name: TypeName, file: str, dialect: Dialect = ROS2) -> Service:
    """Read a `.srv` definition; arguments and errors are those of `parse_msg`."""
    request, response = _parse_sections(text, name, file, dialect, ("_Request", "_Response"))
    return Service(name, request, response, text, (*request.warnings, *response.warnings))


def parse_action(text: str, name: TypeName, file: str, dialect: Dialect = ROS2) -> Action:
    """Read an `.action` definition; arguments and errors are those of `parse_msg`."""
    goal, result, feedback = _parse_sections(text, name, file, dialect, ("_Goal", "_Result", "_Feedback"))
    warnings = (*goal.warnings, *result.warnings, *feedback.warnings)
    return Action(name, goal, result, feedback, text, warnings)


def _parse_sections(
    text: str, name: TypeName, file: str, dialect: Dialect, suffixes: tuple[str, ...]
) -> list[Message]:
    lines = text.splitlines()
    separators = [index for index, line in enumerate(lines) if line == SEPARATOR]
    expected = len(suffixes) - 1
    if len(separators) != expected:
        raise _separator_problem(lines, separators, file, [suffix[1:].lower() for suffix in suffixes])
    starts = [0, *(index + 1 for index in separators)]
    ends = [*separators, len(lines)]
    return [
        _MessageReader(text, name.sibling(suffix), file, dialect).read(start, end)
        for suffix, start, end in zip(suffixes, starts, ends, strict=True)
    ]


def _separator_problem(
    lines: list[str], separators: list[int], file: str, parts: list[str]
) -> DefinitionError:
    expected = len(parts) - 1
    like_separators = [index for index, line in enumerate(lines) if line.strip() == SEPARATOR != line]
    if len(separators) > expected:
        line = separators[expected]
    elif like_separators:
        line = like_separators[0]
    else:
        line = max(len(lines) - 1, 0)
    hint = "; such a line has nothing else on it, spaces included" if like_separators else ""
    message = (
        f"expected {expected} line{'s' * (expected > 1)} '{SEPARATOR}', between "
        f"{', '.join(parts[:-1])} and {parts[-1]}, found {len(separators)}{hint}"
    )
    return problem(message, "\n".join(lines), Location(file, line + 1))


class _CommentLine(NamedTuple):
    """The text of a comment behind its mark, and its line, counted from 1."""

    text: str
    line: int


class _MessageReader:
    """Reads one message out of some lines of a definition."""

    def __init__(self, text: str, name: TypeName, file: str, dialect: Dialect) -> None:
        self.text = text
        self.name = name
        self.file = file
        self.lines = text.splitlines()
        self.dialect = dialect
        self.warnings: list[str] = []

    def read(self, start: int, end: int, text: str = "") -> Message:
        """Read the lines from `start` up to `end`, counted from 0."""
        for kind, part in (("package", self.name.package), ("message", _without_suffix(self.name.name))):
            if not self._name_rule(kind).fullmatch(part):
                raise DefinitionError(
                    f"{self.file}: {part!r} is not a valid {kind} name; {_NAME_ADVICE[kind]}"
                )
        message_comment: list[_CommentLine] = []
        while start < end and self.lines[start].startswith("#"):
            start += 1
            message_comment.append(_CommentLine(self.lines[start - 1].lstrip("#"), start))
        self._check_comment(message_comment)  # what else comes to it below is lost on the way to .idl

        pending: list[_CommentLine] = []  # comment lines that wait for the element they stand above
        comments: list[list[_CommentLine]] = []  # of each element, in order of appearance
        elements: list[Field | Constant] = []
        for number, line in enumerate(self.lines[start:end], start + 1):
            code, mark, comment = self._without_comment(line)
            if mark and code and not code.strip():
                # An indented comment goes on with that of the element above; before the first, the message has it.
                indented = _CommentLine(comment.lstrip("#"), number)
                (comments[-1] if comments else message_comment).append(indented)
                continue
            if mark:
                pending.append(_CommentLine(comment.lstrip("#"), number))
            if not code.strip():
                continue
            elements.append(self._element(code, number))
            comments.append(pending)
            pending = []

        documented = list(map(self._documented, elements, comments))
        fields = [element for element in documented if isinstance(element, Field)]
        constants = [element for element in documented if isinstance(element, Constant)]
        self._refuse_duplicates(fields)
        self._refuse_duplicates(constants)
        if pending:
            message_comment += [_CommentLine("", pending[0].line), *pending]
        if not fields:
            fields.append(Field(EMPTY_STRUCT_FIELD, BasicType("uint8")))
        return Message(
            self.name,
            tuple(fields),
            tuple(constants),
            _tidy([each.text for each in message_comment]),
            (),
            text,
            tuple(self.warnings),
        )

    def _without_comment(self, line: str) -> tuple[str, str, str]:
        """Return what stands before a comment, its mark, and what stands behind it."""
        if self.dialect.has_whole_line_strings and _STRING_CONSTANT.match(line):
            name, mark, value = line.partition("=")
            return name.replace("\t", " ") + mark + value.rstrip(), "", ""
        return line.replace("\t", " ").rstrip().partition("#")

    def _documented(self, element: Field | Constant, lines: list[_CommentLine]) -> Field | Constant:
        """Return a field or constant with its comment and unit."""
        texts, unit = _without_unit(lines)
        self._check_comment(lines)
        if unit is not None and isinstance(element, Field):  # the .idl does not have the units of constants
            marked = next((each.line for each in lines if "\\" in each.text), lines[0].line)
            self._check_escapes(unit, marked)
        return replace(element, comment=_tidy(texts), unit=unit)

    def _check_comment(self, lines: list[_CommentLine]) -> None:
        """Refuse a comment that ROS 2 cannot read."""
        texts, _ = _without_unit(lines)
        for text, each in zip(texts, lines, strict=True):
            self._check_escapes(text, each.line)

    def _check_escapes(self, text: str, line: int) -> None:
        """Refuse a line of a comment, or a unit, that is broken on the way to .idl, where it is a string."""
        if self.dialect.is_loose:
            return
        try:
            _through_idl(text)
        except ValueError:
            column = self.lines[line - 1].find("\\") + 1 or 1
            raise self._problem(
                "ROS 2 takes a backslash in a comment for an escape sequence, and cannot read this one; "
                r"write \\\\ for a backslash",
                Location(self.file, line, column),
            ) from None

    def _element(self, code: str, number: int) -> Field | Constant:
        """Read a field or constant from a line without its comment."""
        type_column = len(code) - len(code.lstrip()) + 1
        if type_column > 1 and not self.dialect.is_loose:
            raise self._problem(
                "ROS 2 does not accept an indented field or constant; begin it in the first column",
                Location(self.file, number, type_column),
            )
        type_text, _, rest = code.strip().partition(" ")
        rest = rest.lstrip()
        type_location = Location(self.file, number, type_column)
        if not rest:
            raise self._problem(f"expected a type and a name, found only {type_text!r}", type_location)
        name_location = Location(self.file, number, code.index(rest, type_column - 1 + len(type_text)) + 1)
        if "=" in rest:
            return self._constant(type_text, rest, type_location, name_location)
        name, _, default_text = rest.partition(" ")
        if not self._name_rule("field").fullmatch(name):
            raise self._bad_name("field", name, name_location)
        field_type = self._type(type_text, type_location)
        default_text = default_text.strip()
        default = None
        if default_text:
            column = name_location.column + len(rest) - len(rest[len(name) :].lstrip())
            default = self._default(field_type, default_text, Location(self.file, number, column))
        return Field(name, field_type, default, location=name_location)

    def _constant(self, type_text: str, rest: str, type_location: Location, location: Location) -> Constant:
        name, _, value_text = rest.partition("=")
        name = name.rstrip()
        if not name:
            raise self._problem("expected the name of a constant before '='", location)
        if " " in name:
            raise self._problem(
                "a line with '=' defines a constant, and its name has no spaces; "
                "the default value of a field is written without '=' and cannot contain one",
                location,
            )
        if not self._name_rule("constant").fullmatch(name):
            raise self._bad_name("constant", name, location)
        constant_type = self._type(type_text, type_location)
        if not isinstance(constant_type, (BasicType, StringType)) or "<=" in type_text:
            raise self._problem(
                f"a constant cannot be of type {type_text!r}; use a number, bool, string or wstring",
                type_location,
            )
        value_text = value_text.strip()
        if self.dialect.has_whole_line_strings and isinstance(constant_type, StringType):
            return Constant(name, constant_type, value_text, location=location)
        column = location.column + len(rest) - len(rest.partition("=")[2].lstrip())
        value = self._scalar(constant_type, value_text, Location(self.file, location.line, column))
        return Constant(name, constant_type, value, location=location)

    def _type(self, text: str, location: Location) -> FieldType:
        match = _TYPE.fullmatch(text)
        if match is None:
            raise self._problem(f"{text!r} is not a type; arrays have one pair of brackets", location)
        element = self._value_type(match["element"], location)
        size_text = match["size"]
        if size_text is None:
            return element
        if not size_text and not match["upper_bound"]:
            return SequenceType(element, self._bound_as_in_ros(element, location))
        size = self._positive(size_text, f"the size of array type {text!r}", location)
        return SequenceType(element, size) if match["upper_bound"] else ArrayType(element, size)

    def _bound_as_in_ros(self, element: ValueType, location: Location) -> int | None:
        """Return the bound of a sequence without one: `rosidl_parser` gives it that of its wide strings, by mistake.

        It is what is installed and hashed.
        """
        if not isinstance(element, StringType) or not element.wide or element.bound is None:
            return None
        self.warnings.append(f"{location}: {wide_string_warning(element.bound)}")
        return element.bound

    def _value_type(self, text: str, location: Location) -> ValueType:
        if text in self.dialect.types:
            return self.dialect.types[text]
        base, is_bounded, bound_text = text.partition("<=")
        if base in _PRIMITIVE_TYPES:
            primitive = _PRIMITIVE_TYPES[base]
            if primitive.is_string:
                bound = self._positive(bound_text, f"the bound of {text!r}", location) if is_bounded else None
                return StringType(primitive.family is Family.WSTRING, bound)
            if not is_bounded:
                return BasicType(primitive.name)
        if text in ("time", "duration"):
            raise self._problem(f"{text!r} is a ROS 1 type; use builtin_interfaces/{text.title()}", location)
        if text in _NAMES_ELSEWHERE:
            raise self._problem(f"{text!r} is not a type in .msg; use {_NAMES_ELSEWHERE[text]}", location)
        package, slash, message = text.rpartition("/")
        if package.endswith("/msg") and self.dialect.is_loose:
            package = package.removesuffix("/msg")
        if package.endswith("/msg"):
            short = f"{package.removesuffix('/msg')}/{message}"
            raise self._problem(f"{text!r} is not written with '/msg/' in .msg; use {short}", location)
        package = package if slash else self.name.package
        if not self._name_rule("package").fullmatch(package):
            raise self._problem(
                f"{text!r} is not a type: {package!r} is not a valid package name; {_NAME_ADVICE['package']}",
                location,
            )
        if not self._name_rule("message").fullmatch(_without_suffix(message)):
            raise self._problem(
                f"{text!r} is neither a primitive type nor the name of a message; "
                f"{_NAME_ADVICE['message']}",
                location,
            )
        return TypeName(package, "msg", message)

    def _positive(self, text: str, what: str, location: Location) -> int:
        try:
            value = int(text)
        except ValueError:
            value = 0
        if value <= 0:
            raise self._problem(f"{what} must be a whole number above 0, not {text!r}", location)
        return value

    def _default(self, field_type: FieldType, text: str, location: Location) -> Value:
        element = value_type(field_type)
        if isinstance(element, TypeName):
            raise self._problem("a field that is a message cannot have a default value", location)
        if not isinstance(field_type, (ArrayType, SequenceType)):
            return self._scalar(element, text, location)
        if not (text.startswith("[") and text.endswith("]") and len(text) > 1):
            raise self._problem(
                f"the default of an array must stand in brackets, not {_quoted(text)}", location
            )
        inner = text[1:-1]
        if isinstance(element, StringType):
            try:
                parts = _split_strings(inner)
            except ValueError as error:
                raise self._problem(str(error), location) from None
        else:
            parts = [part.strip() for part in inner.split(",")] if inner else []
        if isinstance(field_type, ArrayType) and len(parts) != field_type.size:
            raise self._problem(
                f"the default of an array of {field_type.size} must have {field_type.size} elements, "
                f"not {len(parts)}",
                location,
            )
        if isinstance(field_type, SequenceType) and field_type.bound and len(parts) > field_type.bound:
            raise self._problem(
                f"the default of a sequence of at most {field_type.bound} cannot have {len(parts)} elements",
                location,
            )
        try:
            return _array_through_idl(tuple(_value(element, part) for part in parts))
        except ValueError as error:
            raise self._problem(str(error), location) from None

    def _scalar(self, scalar: BasicType | StringType, text: str, location: Location) -> ScalarValue:
        try:
            value = _value(scalar, text)
            return _through_idl(value) if isinstance(value, str) else value
        except ValueError as error:
            raise self._problem(str(error), location) from None

    def _refuse_duplicates(self, elements: Sequence[Field | Constant]) -> None:
        seen: dict[str, Location | None] = {}
        for element in elements:
            if element.name in seen:
                first = seen[element.name]
                assert first is not None and element.location is not None
                raise self._problem(
                    f"{element.name!r} is defined twice, first in line {first.line}", element.location
                )
            seen[element.name] = element.location

    def _name_rule(self, kind: str) -> re.Pattern[str]:
        return _LOOSE_NAME if self.dialect.is_loose else _NAME_RULES[kind]

    def _bad_name(self, kind: str, name: str, location: Location) -> DefinitionError:
        return self._problem(f"{_quoted(name)} is not a valid {kind} name; {_NAME_ADVICE[kind]}", location)

    def _problem(self, message: str, location: Location) -> DefinitionError:
        return problem(message, "\n".join(self.lines), location)


def _without_suffix(name: str) -> str:
    """Strip what ROS itself puts around the names of messages."""
    name = name.removeprefix("Sample_")
    for suffix in _DERIVED_SUFFIXES:
        name = name.removesuffix(suffix)
    return name


def _quoted(text: str) -> str:
    return repr(text) if len(text) <= _LONGEST_QUOTATION else f"{text[:_LONGEST_QUOTATION]!r}..."


def _boolean_value(text: str, scalar: Scalar, bound: int | None) -> bool:
    values = {"true": True, "1": True, "false": False, "0": False}
    if text.lower() not in values:
        raise ValueError(f"a bool must be true, false, 1 or 0, not {_quoted(text)}")
    return values[text.lower()]


def _float_value(text: str, scalar: Scalar, bound: int | None) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"expected a number with '.' as its decimal point, not {_quoted(text)}") from None


def _integer_value(text: str, scalar: Scalar, bound: int | None) -> int:
    lowest, highest = scalar.range
    try:
        value = int(text)
    except ValueError:
        try:
            value = int(text, 0)
        except ValueError:
            raise ValueError(
                f"expected a whole number from {lowest} to {highest}, not {_quoted(text)}"
            ) from None
    if not lowest <= value <= highest:
        raise ValueError(
            f"{_quoted(text)} does not fit {scalar.msg[0]}, which goes from {lowest} to {highest}"
        )
    return value


def _string_value(text: str, scalar: Scalar, bound: int | None) -> str:
    for quote in "\"'":
        if text.startswith(quote) and text.endswith(quote):
            text = text[1:-1]
            if re.search(rf"(?<!\\){quote}", text):
                raise ValueError(f"a quote inside a string must be written \\{quote}")
            text = text.replace(f"\\{quote}", quote)
            break
    if bound is not None and len(text) > bound:
        raise ValueError(f"the string has {len(text)} characters, more than its bound of {bound}")
    return text


_VALUE_READERS: Mapping[Family, Callable[[str, Scalar, int | None], ScalarValue]] = {
    Family.BOOLEAN: _boolean_value,
    Family.INTEGER: _integer_value,
    Family.FLOATING_POINT: _float_value,
    Family.OCTET: _integer_value,
    Family.CHARACTER: _integer_value,
    Family.STRING: _string_value,
    Family.WSTRING: _string_value,
}


def _value(element: BasicType | StringType, text: str) -> ScalarValue:
    """Return the value that `text` stands for, strings with their escape sequences as they are."""
    bound = element.bound if isinstance(element, StringType) else None
    return _VALUE_READERS[element.scalar.family](text, element.scalar, bound)


def _split_strings(text: str) -> list[str]:
    """Split the elements of an array of strings: at commas, and behind closing quotes, which are taken off.

    `rosidl_adapter` takes quotes off once more from each element, and does not miss a comma between quoted ones.
    """
    parts: list[str] = []
    while text:
        text = text.lstrip(" ")
        if not text or text[0] == ",":
            raise ValueError("expected a string before ',' or ']'")
        is_quoted = False
        for quote in "\"'":
            if text.startswith(quote):
                is_quoted = True
                end = _closing_quote(text, quote)
                parts.append(text[1:end].replace(f"\\{quote}", quote))
                text = text[end + 1 :]
        if not is_quoted:
            end = text.find(",") if "," in text else len(text)
            parts.append(text[:end])
            text = text[end:]
        text = text.lstrip(" ").removeprefix(",")
    return [part.strip() for part in parts]


def _closing_quote(text: str, quote: str) -> int:
    """Return where the string that `text` begins with ends.

    Behind two escaped quotes `rosidl_adapter` loses count and ends the string too early. The default value that the
    ROS classes have then is the one to find here.
    """
    offset = 0
    while True:
        end = text.find(quote, 1)
        if end == -1:
            raise ValueError(f"a string has no closing {quote}")
        if text[end - 1] != "\\":
            return offset + end
        text, offset = text[end + 1 :], end + 1


def _through_idl(text: str) -> str:
    """Return what ROS 2 makes of a string on its way: `rosidl_adapter` writes it to .idl, `rosidl_parser` reads that.

    Both replace escape sequences, so that most backslashes must be doubled.
    """
    if "\\" not in text:
        return _read_from_idl(text.replace('"', r"\""))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", DeprecationWarning
            )  # for unknown sequences, which stay as they are
            decoded = text.encode().decode("unicode_escape")
        # rosidl_adapter decodes bytes of UTF-8 as characters, and writes characters as bytes.
        decoded = decoded.encode("latin-1").decode()
    except UnicodeError:
        raise ValueError(
            "ROS 2 cannot read the escape sequences of this string; write characters as they are, in UTF-8, "
            r"and a backslash as \\\\"
        ) from None
    return _read_from_idl(decoded.replace('"', r"\""))


def _array_through_idl(values: tuple[ScalarValue, ...]) -> tuple[ScalarValue, ...]:
    """Return what ROS 2 makes of an array: in .idl, it is the text of a Python tuple."""
    try:
        escaped = repr(values).replace("\\", r"\\").replace('"', r"\"").encode("latin-1").decode()
    except UnicodeError:
        raise ValueError("ROS 2 only reads ASCII characters in the default of an array of strings") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read = ast.literal_eval(_read_from_idl(escaped))
    except (ValueError, SyntaxError):
        read = None
    if not isinstance(read, tuple) or [type(each) for each in read] != [type(each) for each in values]:
        raise ValueError(
            "ROS 2 cannot read this default of an array; it takes finite numbers, and strings without "
            "quotes and backslashes"
        )
    return read


def _read_from_idl(escaped: str) -> str:
    """Read what stands between the quotes of a string in .idl, as `rosidl_parser` does."""
    if not _IDL_STRING.fullmatch(escaped):
        raise ValueError(
            "ROS 2 replaces escape sequences twice, and the string is broken after the first time; "
            r"double each backslash: \\n is a line break, \\\\ a backslash"
        )
    if "\\" not in escaped:
        return escaped

    def character(match: re.Match[str]) -> str:
        simple, octal, hexadecimal = match.groups()
        if simple:
            return _ESCAPED_CHARACTERS.get(simple, simple)
        if hexadecimal and len(hexadecimal) == 1:
            raise ValueError(f"an escape sequence '\\x' has two digits, not only {hexadecimal!r}")
        return chr(int(octal, 8) if octal else int(hexadecimal, 16))

    # It looks for escaped quotes and backslashes once more, in what it has decoded.
    return _IDL_ESCAPED_AGAIN.sub(r"\1", _IDL_ESCAPE.sub(character, escaped))


_ESCAPED_CHARACTERS = dict(zip("ntvbrfa", "\n\t\v\b\r\f\a", strict=True))


def _without_unit(lines: list[_CommentLine]) -> tuple[list[str], str | None]:
    """Return the lines of a comment without the unit, and the unit, if there is exactly one."""
    texts = [each.text for each in lines]
    units = list(_units("\n".join(texts)))
    if len(units) != 1:
        return texts, None
    marked, unit = units[0]
    return [text.replace(marked, "") for text in texts], unit


def _units(comment: str) -> Iterator[tuple[str, str]]:
    """Yield what stands in brackets, with them and the space before, and alone; but not `[0, 1]`, which is a range."""
    for part, end in _UP_TO_BRACKET_OR_COMMA.findall(comment):
        before, _, unit = part.partition("[")
        if unit and end == "]":
            yield f"{before[len(before.rstrip()):]}[{unit}]", unit


def _tidy(lines: list[str]) -> tuple[str, ...]:
    """Drop outer empty lines, fold inner ones, and take away common indentation."""
    kept: list[str] = []
    for line in textwrap.dedent("\n".join(lines)).strip("\n").split("\n"):
        if line or (kept and kept[-1]):
            kept.append(line.rstrip())
    while kept and not kept[-1]:
        kept.pop()
    return tuple(kept)
