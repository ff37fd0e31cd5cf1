"""Reads the definitions that recordings have of their types: texts of many definitions, one after the other.

Where each begins is said by a line of 80 `=` and one such as `MSG: std_msgs/Header`. MCAP names these encodings
(https://mcap.dev/spec/registry#well-known-schema-encodings); what rosbag2 writes is in its
docs/message_definition_encoding.md and LocalMessageDefinitionSource: one text may have sections of several kinds, the
same section more than once, and one that is empty before another of the same type.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.catalog import interface_base
from rosidl_adapter_proto.interfaces.description import (
    FieldDescription,
    IndividualTypeDescription,
    TypeDescription,
    described_type,
)
from rosidl_adapter_proto.interfaces.find import Definition, Package, Source
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, NAMESPACES, Shape, TypeName
from rosidl_adapter_proto.interfaces.msg import RECORDED, RECORDED_WITH_HEADER, ROS1, SEPARATOR, Dialect

ROS2MSG = "ros2msg"
ROS2IDL = "ros2idl"
ROS1MSG = "ros1msg"
ENCODINGS = (ROS2MSG, ROS2IDL, ROS1MSG)
"""The encodings that are read."""

MAXIMUM_SIZE = 4 * 2**20
"""The longest text that is read, in bytes."""

MAXIMUM_DEFINITIONS = 10_000
"""The most definitions that one text may have."""

ORIGIN = "the recording"
"""What errors call the source of such definitions."""

_SUFFIXES = {"MSG": ".msg", "SRV": ".srv", "ACTION": ".action", "IDL": ".idl"}
_KINDS = {suffix: kind for kind, suffix in _SUFFIXES.items()}
_DELIMITER = re.compile(r"^={80}[ \t]*\n(MSG|SRV|ACTION|IDL):[ \t]*(\S+)[ \t]*$\n?", re.MULTILINE)


class _Section(NamedTuple):
    """One definition in a text."""

    name: TypeName
    suffix: str
    text: str


def recorded_definitions(data: bytes, encoding: str, type_name: str, where: str) -> Package:
    """Return the definitions that a recording has for one type, the type itself first.

    They are split, but not parsed yet. Characters that are not UTF-8, as comments of ROS 1 may have, are replaced.

    Args:
        data: The text.
        encoding: One of `ENCODINGS`.
        type_name: The type that it is recorded for: `pkg/msg/Type`, `pkg/Type`, or a part of a service or an action.
        where: Where it is, for errors.

    Raises:
        DefinitionError: The text is no such text, or defines a type twice.
    """
    if encoding not in ENCODINGS:
        raise DefinitionError(
            f"{where}: definitions with the encoding {encoding!r} are not known, only {', '.join(ENCODINGS)}"
        )
    if len(data) > MAXIMUM_SIZE:
        raise DefinitionError(f"{where}: the definition has more than {MAXIMUM_SIZE} bytes")
    text = data.decode(errors="replace").removeprefix("\ufeff").replace("\r\n", "\n")
    found: dict[TypeName, _Section] = {}
    for section in _sections(text, encoding, type_name, where):
        other = found.get(section.name)
        if (
            other is None or section.text
        ):  # rosbag2 has an empty section where it found no .msg, beside that of the .idl
            if other and other.text and section.text.split() != other.text.split():
                raise DefinitionError(f"{where}: {section.name} is defined twice, not in the same way")
            found[section.name] = (
                section  # compared with the next one, so that a long one is looked at only twice
            )
        if len(found) > MAXIMUM_DEFINITIONS:
            raise DefinitionError(f"{where}: the definition has more than {MAXIMUM_DEFINITIONS} types")
    return {
        name: Definition(
            name,
            each.suffix,
            f"{where}: {_KINDS[each.suffix]} {name}",
            ORIGIN,
            each.text,
            _dialect(encoding, name, found),
        )
        for name, each in found.items()
    }


def recorded_source(definitions: Mapping[TypeName, Definition]) -> Source:
    """Return the source of recorded definitions: what their packages have besides comes from elsewhere."""
    packages: dict[str, dict[TypeName, Definition]] = {}
    for name, definition in definitions.items():
        packages.setdefault(name.package, {})[name] = definition
    return Source(ORIGIN, packages, is_partial=True)


def recorded_type_name(text: str, namespace: str = "msg") -> TypeName:
    """Return the type that a recording means: `pkg/Type` is `pkg/msg/Type`.

    Args:
        text: What the recording has.
        namespace: What to put between the two parts.

    Raises:
        DefinitionError: It is no name of a type.
    """
    parts = text.split("/")
    if len(parts) == 2:
        parts.insert(1, namespace)
    if len(parts) != 3 or parts[1] not in NAMESPACES or not all(map(_NAME.fullmatch, parts)):
        raise DefinitionError(f"{text!r} is not the name of a ROS type, such as 'sensor_msgs/msg/Imu'")
    return TypeName(*parts)


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def recorded_text(definitions: Mapping[TypeName, Definition]) -> tuple[str, bytes]:
    """Return definitions as a recording has them, with their encoding; the type that they are for comes first.

    The text is that of rosbag2: without a delimiter before the first, unless there are `.idl` files among them.
    """
    encoding = ROS2IDL if any(each.format == ".idl" for each in definitions.values()) else ROS2MSG
    if any(each.dialect is ROS1 for each in definitions.values()):
        encoding = ROS1MSG
    texts: list[str] = []
    for name, each in definitions.items():
        if texts or encoding == ROS2IDL:
            texts.append(f"{'=' * 80}\n{_KINDS[each.format]}: {_written(name, encoding)}\n")
        texts.append(_tidy(each.text.replace("\r\n", "\n")))
    return encoding, "".join(texts).encode()


def described_text(description: TypeDescription) -> bytes:
    """Return the text that `ros2msg` recordings have of a type, whatever it was defined in: fields, and nothing else.

    The `char` and `wchar` of IDL, which `.msg` does not have, are the numbers that they are in CDR, and parts of
    services and actions in other messages are messages of the same names.

    Args:
        description: The type and all that it refers to.

    Raises:
        DefinitionError: It has a `long double`, which no `.msg` can say.
    """
    top = description["type_description"]
    name = top["type_name"]
    texts = [_described_fields(top)]
    if (
        not texts[0] and TypeName.parse(name).namespace != "msg"
    ):  # else nothing would be taken for no definition
        texts.insert(0, f"{'=' * 80}\nMSG: {name}\n")
    for each in description["referenced_type_descriptions"]:
        texts.append(f"{'=' * 80}\nMSG: {_described_name(each['type_name'])}\n{_described_fields(each)}")
    return "".join(texts).encode()


def _described_name(name: str) -> str:
    package, _, last = name.split("/")
    return f"{package}/{last}"


_NUMBERS_OF_CHARACTERS = {"char": "uint8", "wchar": "uint16"}


def _described_fields(description: IndividualTypeDescription) -> str:
    name = description["type_name"]
    fields = (each for each in description["fields"] if each["name"] != EMPTY_STRUCT_FIELD)
    return "".join(f"{_described_field_type(name, each)} {each['name']}\n" for each in fields)


def _described_field_type(type_name: str, field: FieldDescription) -> str:
    shape, element, capacity, string_bound = described_type(field["type"])
    if isinstance(element, TypeName):
        text = _described_name(str(element))
    elif element.msg:
        text = element.msg[0]
    elif element.name in _NUMBERS_OF_CHARACTERS:
        text = _NUMBERS_OF_CHARACTERS[element.name]
    else:
        raise DefinitionError(f"{type_name}.{field['name']}: no .msg definition can have a {element.name}")
    bound = "" if string_bound is None else f"<={string_bound}"
    brackets = {
        Shape.SINGLE: "",
        Shape.ARRAY: f"[{capacity}]",
        Shape.SEQUENCE: "[]" if capacity is None else f"[<={capacity}]",
    }
    return text + bound + brackets[shape]


def _written(name: TypeName, encoding: str) -> str:
    return f"{name.package}/{name.name}" if encoding != ROS2IDL and name.namespace == "msg" else str(name)


def _sections(text: str, encoding: str, type_name: str, where: str) -> Iterator[_Section]:
    """Yield the definitions in a text, in their order."""
    try:
        top = recorded_type_name(type_name)
        delimiters = list(_DELIMITER.finditer(text))
        named = [_named(each[2], each[1], top.package) for each in delimiters]
    except DefinitionError as error:
        raise DefinitionError(f"{where}: {error}") from None
    starts = [each.end() for each in delimiters]
    ends = [*(each.start() for each in delimiters), len(text)]
    first = _tidy(text[: ends[0]])
    own = interface_base(top)
    # A text that begins with a delimiter has its own type behind one; a message without fields has no text.
    if first or (own not in named and encoding != ROS2IDL):
        yield _top_section(top, encoding, first)
    for name, delimiter, start, end in zip(named, delimiters, starts, ends[1:], strict=True):
        yield _Section(name, _SUFFIXES[delimiter[1]], _tidy(text[start:end]))


def _top_section(top: TypeName, encoding: str, text: str) -> _Section:
    """Return the definition that stands first: a part of a service or an action has that of the whole."""
    if encoding == ROS2IDL:
        return _Section(interface_base(top), ".idl", text)
    if top.namespace == "msg" or SEPARATOR not in text.split("\n"):
        return _Section(top, ".msg", text)
    return _Section(interface_base(top), f".{top.namespace}", text)


def _named(text: str, kind: str, package: str) -> TypeName:
    """Return the type that a delimiter names; without a package, it is one of that of the whole text."""
    namespace = "msg" if kind in ("MSG", "IDL") else kind.lower()
    name = recorded_type_name(text if "/" in text else f"{package}/{text}", namespace)
    return interface_base(name) if kind in ("SRV", "ACTION") else name


def _tidy(text: str) -> str:
    """Return a text that ends with one line break, however many its place in a recording gave it."""
    text = text.rstrip("\n")
    return f"{text}\n" if text.strip() else ""


def _dialect(encoding: str, name: TypeName, known: Mapping[TypeName, _Section]) -> Dialect:
    if encoding == ROS1MSG:
        return ROS1
    return RECORDED if TypeName(name.package, "msg", "Header") in known else RECORDED_WITH_HEADER
