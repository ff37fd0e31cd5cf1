"""Field numbers: from a hash of the name (default), or in sequence with a lock file.

Hash numbers need no state, survive reordering and inserting, and equal those of rosidl_typesupport_protobuf.
Sequential numbers make smaller messages; the lock file keeps each number for its field forever.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Protocol

from rosidl_adapter_proto.errors import SchemaError
from rosidl_adapter_proto.interfaces.catalog import near_misses
from rosidl_adapter_proto.interfaces.model import FieldType, Message, Shape, TypeName, type_parts
from rosidl_adapter_proto.interfaces.scalars import SCALARS, Scalar
from rosidl_adapter_proto.schema.typemap import is_repeated, proto_type

# Protobuf language guide (proto3), "Assigning Field Numbers".
LARGEST_NUMBER = 2**29 - 1
FIRST_RESERVED, LAST_RESERVED = 19000, 19999
_RESERVED_COUNT = LAST_RESERVED - FIRST_RESERVED + 1

LOCK_FILE_NAME = "rosidl-proto.lock"
_LOCK_VERSION = 2
_READ_VERSIONS = (1, 2)
"""Lock files of version 1 have no ROS types."""


def compute_proto_field_number(variable_name: str) -> int:
    """Return the hash number of a field: CRC-32 of its name, brought into protobuf's range."""
    number = zlib.crc32(variable_name.encode()) % (LARGEST_NUMBER - _RESERVED_COUNT) + 1
    return number + _RESERVED_COUNT if number >= FIRST_RESERVED else number


@dataclass(frozen=True)
class Numbers:
    """The field numbers of one message, and those that may never be used again, with the names that had them."""

    fields: Mapping[str, int]
    reserved: Mapping[str, int] = field(default_factory=dict)


class Numbering(Protocol):
    """A way to number the fields of a message."""

    name: str

    def numbers(self, message: Message) -> Numbers:
        """Return the number of every field."""


class HashNumbering:
    """Numbers from a hash of the field name."""

    name = "hash"

    def numbers(self, message: Message) -> Numbers:
        """Return the number of every field; the later of two that collide is hashed with a counter appended."""
        numbers: dict[str, int] = {}
        used: set[int] = set()
        for each in message.fields:
            number = compute_proto_field_number(each.name)
            counter = 0
            while number in used:
                number = compute_proto_field_number(f"{each.name}{counter}")
                counter += 1
            numbers[each.name] = number
            used.add(number)
        return Numbers(numbers)


@dataclass
class LockedField:
    """What the lock file knows of a field.

    Attributes:
        number: Its number.
        type: Its type in protobuf.
        ros_type: Its type in ROS, without bounds and lengths, which may change; None if an old lock file had none.
    """

    number: int
    type: str
    ros_type: str | None = None


@dataclass
class LockedMessage:
    """The fields that a message has, and those it had."""

    fields: dict[str, LockedField] = field(default_factory=dict)
    removed: dict[str, LockedField] = field(default_factory=dict)


class SequentialNumbering:
    """Numbers in order of declaration, kept by a lock file.

    Attributes:
        file: The path of the lock file, for messages.
        messages: Its content, by type name; `numbers` brings it up to date.
        given: The numbers of each message that was asked for, those of removed fields included.
        is_complete: Whether the lock file has every field, so that none gets a new number.
    """

    name = "sequential"

    def __init__(self, file: str, messages: dict[str, LockedMessage], *, is_complete: bool = False) -> None:
        self.file = file
        self.messages = messages
        self.given: dict[str, dict[str, int]] = {}
        self.is_complete = is_complete

    @classmethod
    def from_lock(cls, file: str, text: str | None, *, is_complete: bool = False) -> SequentialNumbering:
        """Read a lock file; `text` is None where there is none yet, and `is_complete` as for a numbering.

        Raises:
            SchemaError: The file is damaged.
        """
        if text is None:
            return cls(file, {})
        try:
            content = json.loads(text, object_pairs_hook=_unique)
            if content["version"] not in _READ_VERSIONS:
                known = " and ".join(map(str, _READ_VERSIONS))
                raise SchemaError(
                    f"{file} has version {content['version']}, this program reads {known}; "
                    "use the version of rosidl-proto that wrote it, or a newer one"
                )
            messages = {
                name: LockedMessage(_read_fields(entry["fields"]), _read_fields(entry["removed"]))
                for name, entry in content["messages"].items()
            }
        except KeyError as error:
            raise _damaged(file, f"{error} is missing") from None
        except (TypeError, AttributeError, RecursionError):
            raise _damaged(file, "it is not a lock file of rosidl-proto") from None
        except ValueError as error:
            raise _damaged(file, str(error)) from None
        for name, message in messages.items():
            _check_numbers(file, name, message)
        return cls(file, messages, is_complete=is_complete)

    def numbers(self, message: Message) -> Numbers:
        """Return the number of every field; new fields take the next numbers that were never used.

        Raises:
            SchemaError: A field would reuse a number for values of another type, or needs a new one where the lock
                file is complete.
        """
        locked = self.messages.setdefault(str(message.name), LockedMessage())
        present = {
            each.name: (_proto_type_text(each.type), _ros_type_text(each.type)) for each in message.fields
        }
        for name in [name for name in locked.fields if name not in present]:
            locked.removed[name] = locked.fields.pop(name)
        for name, types in present.items():
            known = locked.fields.get(name) or locked.removed.get(name)
            if known is not None and not _reads_alike(known, *types):
                raise self._wrong_type(f"{message.name}.{name}", known, types[1])
            if name in locked.removed:
                locked.fields[name] = locked.removed.pop(name)
        used = {each.number for each in (*locked.fields.values(), *locked.removed.values())}
        new = [name for name in present if name not in locked.fields]
        if new and self.is_complete:
            raise SchemaError(
                f"{message.name}.{new[0]}: {self.file} has no number for it; generate code of {message.name} with "
                "this lock file first"
            )
        for name, types in present.items():
            number = locked.fields[name].number if name in locked.fields else _next_number(used)
            locked.fields[name] = LockedField(number, *types)
            used.add(number)
        numbers = Numbers(
            {name: locked.fields[name].number for name in present},
            {name: each.number for name, each in locked.removed.items()},
        )
        self.given[str(message.name)] = {**numbers.fields, **numbers.reserved}
        return numbers

    def _wrong_type(self, name: str, known: LockedField, ros_type: str) -> SchemaError:
        known_type = known.ros_type or f"{known.type} in protobuf"
        return SchemaError(
            f"{name}: {self.file} has number {known.number} for it with type {known_type}, but its type is "
            f"{ros_type} now; a number cannot be used for another type: give the field a new name, or, if it was "
            f"never released, run: rosidl-proto lock drop {name} --lock-file {self.file}"
        )

    def drop(self, name: str) -> dict[str, int]:
        """Forget a field, as `std_msgs/msg/String.data`, or a whole message, and return the numbers that are free now.

        Raises:
            SchemaError: The lock file has none of that name.
        """
        message_name, dot, field_name = name.partition(".")
        message = self.messages.get(message_name)
        if message is None:
            raise SchemaError(
                f"{self.file} has no message {message_name!r}{near_misses(message_name, self.messages)}"
            )
        known = {**message.fields, **message.removed}
        if not dot:
            del self.messages[message_name]
            return {each: locked.number for each, locked in known.items()}
        if field_name not in known:
            raise SchemaError(
                f"{self.file} has no field {field_name!r} of {message_name}; it has {', '.join(known) or 'none'}"
            )
        message.fields.pop(field_name, None)
        message.removed.pop(field_name, None)
        return {field_name: known[field_name].number}

    def lock_text(self) -> str:
        """Return the content of the lock file: one field to a line, so that a review shows what changed."""
        content = {
            "version": _LOCK_VERSION,
            "messages": {
                name: {"fields": _field_dict(entry.fields), "removed": _field_dict(entry.removed)}
                for name, entry in sorted(self.messages.items())
            },
        }
        return json.dumps(content, indent=2) + "\n"


def _field_dict(fields: Mapping[str, LockedField]) -> dict[str, str]:
    by_number = sorted(fields.items(), key=lambda item: item[1].number)
    return {name: _field_text(each) for name, each in by_number}


def _field_text(field: LockedField) -> str:
    ros_type = f" ({field.ros_type})" if field.ros_type else ""
    return f"{field.number} {field.type}{ros_type}"


def _damaged(file: str, reason: str) -> SchemaError:
    return SchemaError(f"{file} is damaged: {reason}; restore it from version control")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a JSON object, and refuse a name that stands in it twice, as after a merge that went wrong."""
    content = dict(pairs)
    if len(content) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"{next(each for each in names if names.count(each) > 1)!r} stands in it twice")
    return content


def _read_fields(content: Mapping[str, Any]) -> dict[str, LockedField]:
    fields = {}
    for name, text in content.items():
        match = _LOCKED_FIELD.fullmatch(text)
        if match is None or not _fits(match[2], match[3]):
            raise ValueError(f"{name!r} has {text!r} instead of a number and a type")
        fields[name] = LockedField(int(match[1]), match[2], match[3])
    return fields


_LOCKED_FIELD = re.compile(r"([0-9]{1,10}) ((?:repeated )?[A-Za-z0-9_.]+)(?: \(([A-Za-z0-9_/ \[\]]+)\))?")


def _fits(proto_type: str, ros_type: str | None) -> bool:
    """Tell whether both can be types of one field: both of a message, or both of scalars."""
    if ros_type is None:
        return True
    element = ros_type.removesuffix("[]")
    return element.count("/") == 2 if "." in proto_type else element in _SCALARS


def _check_numbers(file: str, name: str, message: LockedMessage) -> None:
    for field_name in message.fields.keys() & message.removed.keys():
        raise _damaged(file, f"{name} has {field_name!r} both as a field and as a removed one")
    used: dict[int, str] = {}
    for field_name, each in (*message.fields.items(), *message.removed.items()):
        if not _is_usable(each.number):
            raise _damaged(
                file, f"{name}.{field_name} has number {each.number}, which protobuf does not allow"
            )
        if each.number in used:
            raise _damaged(
                file, f"{name} has number {each.number} for both {used[each.number]!r} and {field_name!r}"
            )
        used[each.number] = field_name


def _is_usable(number: int) -> bool:
    return 1 <= number <= LARGEST_NUMBER and not FIRST_RESERVED <= number <= LAST_RESERVED


def _next_number(used: set[int]) -> int:
    """Return a number that was never used: behind the last one, or in a gap if that was the last of all."""
    number = max(used, default=0) + 1
    if FIRST_RESERVED <= number <= LAST_RESERVED:
        return LAST_RESERVED + 1
    return (
        number if number <= LARGEST_NUMBER else next(n for n in count(1) if n not in used and _is_usable(n))
    )


def _proto_type_text(field_type: FieldType) -> str:
    """What the bytes of a field depend on; bounds and array lengths may change."""
    repeated = "repeated " if is_repeated(field_type) else ""
    return repeated + proto_type(field_type).lstrip(".")


def _ros_type_text(field_type: FieldType) -> str:
    """What a type is called in `.msg`, or else in `.idl`, without bounds and array lengths."""
    shape, element, _, _ = type_parts(field_type)
    name = str(element) if isinstance(element, TypeName) else _scalar_name(element)
    return name if shape is Shape.SINGLE else f"{name}[]"


def _scalar_name(scalar: Scalar) -> str:
    return scalar.msg[0] if scalar.msg else scalar.name


_SCALARS = {_scalar_name(row): row for row in SCALARS.values()}


def _reads_alike(known: LockedField, proto_type: str, ros_type: str) -> bool:
    """Tell whether bytes of the type that a field had are values of the one that it has now."""
    if known.type != proto_type:
        return False
    # protobuf's `bytes` are numbers with or without a sign, or wide characters.
    return (
        known.ros_type is None
        or proto_type.removeprefix("repeated ") != "bytes"
        or _meaning_of_bytes(known.ros_type) == _meaning_of_bytes(ros_type)
    )


def _meaning_of_bytes(ros_type: str) -> tuple[bool, bool]:
    scalar = _SCALARS[ros_type.removesuffix("[]")]
    return scalar.is_string, scalar.signed
