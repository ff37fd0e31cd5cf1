"""Second, slow and simple writers of plain CDR (OMG CORBA 3.3 part 2, section 9.3) and of ROS 1, to compare with."""

from __future__ import annotations

import struct
from typing import Any

from ros_types import NUMBER_FORMATS, Types, Value, element_name, shape

FILLER = "structure_needs_at_least_one_member"


class CdrWriter:
    """Writes values; `padding` lists the offsets of bytes that mean nothing."""

    def __init__(self, types: Types, *, big_endian: bool = False, padding_byte: int = 0) -> None:
        self.types = types
        self.order = ">" if big_endian else "<"
        self.padding_byte = padding_byte
        self.header = bytes((0, 0 if big_endian else 1, 0, 0))
        self.body = bytearray()
        self.padding: list[int] = []

    def number(self, form: str, value: Any) -> None:
        while len(self.body) % struct.calcsize(form):
            self.padding.append(len(self.body) + 4)
            self.body.append(self.padding_byte)
        self.body += struct.pack(self.order + form, value)

    def message(self, name: str, value: Value) -> CdrWriter:
        for field in self.types[name]["fields"]:
            content, kind = value[field["name"]], shape(field)
            if kind == "single":
                self.element(field, content)
                continue
            if kind != "array":
                self.number("I", len(content))
            for each in content:
                self.element(field, each)
        return self

    def element(self, field: dict[str, Any], value: Any) -> None:
        name = element_name(field)
        if name == "nested":
            self.message(field["type"]["nested_type_name"], value)
        elif name == "string":
            encoded = value.encode() + b"\0"
            self.number("I", len(encoded))
            self.body += encoded
        elif name == "wstring":
            encoded = value.encode("utf-16-le", "surrogatepass")
            units = struct.unpack(f"<{len(encoded) // 2}H", encoded)
            self.number("I", len(units))
            for unit in units:
                self.number("I", unit)
        else:
            self.number(NUMBER_FORMATS[name], value)

    def bytes(self) -> bytes:
        return self.header + bytes(self.body)


class Ros1Writer(CdrWriter):
    """Writes values as ROS 1 does; wide strings, which it does not have, as in CDR."""

    def number(self, form: str, value: Any) -> None:
        self.body += struct.pack(f"<{form}", value)

    def element(self, field: dict[str, Any], value: Any) -> None:
        if element_name(field) == "string":
            self.number("I", len(value.encode()))
            self.body += value.encode()
        elif field["name"] != FILLER:
            super().element(field, value)


def write_ros1(types: Types, name: str, value: Value) -> bytes:
    """Serialize a value for ROS 1."""
    return bytes(Ros1Writer(types).message(name, value).body)


def write_cdr(types: Types, name: str, value: Value, **options: Any) -> bytes:
    """Serialize a value."""
    return CdrWriter(types, **options).message(name, value).bytes()
