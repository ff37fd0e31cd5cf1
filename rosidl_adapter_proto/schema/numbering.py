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
from rosidl_adapter_proto.interfaces.model import FieldType, Message
from rosidl_adapter_proto.schema.typemap import is_repeated, proto_type

# Protobuf language guide (proto3), "Assigning Field Numbers".
LARGEST_NUMBER = 2**29 - 1
FIRST_RESERVED, LAST_RESERVED = 19000, 19999
_RESERVED_COUNT = LAST_RESERVED - FIRST_RESERVED + 1

LOCK_FILE_NAME = "rosidl-proto.lock"
_LOCK_VERSION = 1


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
    """What the lock file knows of a field: its number, and the type its bytes have."""

    number: int
    type: str


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
    """

    name = "sequential"

    def __init__(self, file: str, messages: dict[str, LockedMessage]) -> None:
        self.file = file
        self.messages = messages

    @classmethod
    def from_lock(cls, file: str, text: str | None) -> SequentialNumbering:
        """Read a lock file; `text` is None where there is none yet.

        Raises:
            SchemaError: The file is damaged.
        """
        if text is None:
            return cls(file, {})
        try:
            content = json.loads(text, object_pairs_hook=_unique)
            if content["version"] != _LOCK_VERSION:
                raise SchemaError(
                    f"{file} has version {content['version']}, this program reads version {_LOCK_VERSION}; "
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
        return cls(file, messages)

    def numbers(self, message: Message) -> Numbers:
        """Return the number of every field; new fields take the next numbers that were never used.

        Raises:
            SchemaError: A field would reuse a number for values of another type.
        """
        locked = self.messages.setdefault(str(message.name), LockedMessage())
        present = {each.name: _type_text(each.type) for each in message.fields}
        for name in [name for name in locked.fields if name not in present]:
            locked.removed[name] = locked.fields.pop(name)
        for name, type_text in present.items():
            known = locked.fields.get(name) or locked.removed.get(name)
            if known is not None and known.type != type_text:
                raise SchemaError(
                    f"{message.name}.{name}: {self.file} has number {known.number} for it with type "
                    f"{known.type}, but its type is {type_text} now; a number cannot be used for another type: "
                    "give the field a new name"
                )
            if name in locked.removed:
                locked.fields[name] = locked.removed.pop(name)
        used = {each.number for each in (*locked.fields.values(), *locked.removed.values())}
        for name, type_text in present.items():
            if name not in locked.fields:
                locked.fields[name] = LockedField(_next_number(used), type_text)
                used.add(locked.fields[name].number)
        return Numbers(
            {name: locked.fields[name].number for name in present},
            {name: each.number for name, each in locked.removed.items()},
        )

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
    return {name: f"{each.number} {each.type}" for name, each in by_number}


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
        if match is None:
            raise ValueError(f"{name!r} has {text!r} instead of a number and a type")
        fields[name] = LockedField(int(match[1]), match[2])
    return fields


_LOCKED_FIELD = re.compile(r"([0-9]{1,10}) ((?:repeated )?[A-Za-z0-9_.]+)")


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


def _type_text(field_type: FieldType) -> str:
    """What the bytes of a field depend on; bounds and array lengths may change."""
    repeated = "repeated " if is_repeated(field_type) else ""
    return repeated + proto_type(field_type).lstrip(".")
