"""Field numbers: from a hash of the name (default), or in sequence with a lock file.

Hash numbers need no state, survive reordering and inserting, and equal those of rosidl_typesupport_protobuf.
Sequential numbers make smaller messages; the lock file keeps each number for its field forever.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
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
            content = json.loads(text)
            if content["version"] != _LOCK_VERSION:
                raise SchemaError(
                    f"{file} has version {content['version']}, this program reads version {_LOCK_VERSION}; "
                    "use the version of rosidl-proto that wrote it, or a newer one"
                )
            messages = {
                name: LockedMessage(_read_fields(entry["fields"]), _read_fields(entry["removed"]))
                for name, entry in content["messages"].items()
            }
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise SchemaError(
                f"{file} is not a lock file of rosidl-proto ({error!r}); restore it from version control"
            ) from None
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


def _read_fields(content: Mapping[str, Any]) -> dict[str, LockedField]:
    fields = {}
    for name, text in content.items():
        number, type_text = text.split(" ", 1)
        fields[name] = LockedField(int(number), type_text)
    return fields


def _check_numbers(file: str, name: str, message: LockedMessage) -> None:
    used: dict[int, str] = {}
    for field_name, each in (*message.fields.items(), *message.removed.items()):
        if not _is_usable(each.number):
            raise SchemaError(
                f"{file}: {name}.{field_name} has number {each.number}, which protobuf does not allow"
            )
        if each.number in used:
            raise SchemaError(
                f"{file}: {name} has number {each.number} for both {used[each.number]!r} and {field_name!r}; "
                "restore the file from version control"
            )
        used[each.number] = field_name


def _is_usable(number: int) -> bool:
    return 1 <= number <= LARGEST_NUMBER and not FIRST_RESERVED <= number <= LAST_RESERVED


def _next_number(used: Iterable[int]) -> int:
    number = max(used, default=0) + 1
    return number if _is_usable(number) else LAST_RESERVED + 1


def _type_text(field_type: FieldType) -> str:
    """What the bytes of a field depend on; bounds and array lengths may change."""
    repeated = "repeated " if is_repeated(field_type) else ""
    return repeated + proto_type(field_type).lstrip(".")
