"""What a WebAssembly file has, read from its sections (https://webassembly.github.io/spec/core/binary/modules.html).

wasmtime's own functions for this end the process at types that they do not know, such as vectors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.values import shown

PAGE = 1 << 16
MAGIC = b"\0asm"
_HEADER_SIZE = 8
_CUSTOM, _TYPES, _IMPORTS, _FUNCTIONS, _MEMORIES, _EXPORTS, _START = 0, 1, 2, 3, 5, 7, 8
_FUNCTION, _TABLE, _MEMORY, _GLOBAL, _TAG = range(5)
_FUNCTION_TYPE = 0x60
_T = TypeVar("_T")
_VALUE_TYPES = {
    0x7F: "i32",
    0x7E: "i64",
    0x7D: "f32",
    0x7C: "f64",
    0x7B: "v128",
    0x70: "funcref",
    0x6F: "externref",
}


@dataclass(frozen=True, slots=True)
class Signature:
    """The types of a function, such as `i32`."""

    parameters: tuple[str, ...]
    results: tuple[str, ...]

    def __str__(self) -> str:
        return f"({', '.join(self.parameters)}) -> {', '.join(self.results) or 'nothing'}"


@dataclass(frozen=True, slots=True)
class Import:
    """Something that a file needs.

    Attributes:
        name: What it is called, with what it is from before a dot.
        signature: The types of a function; None for anything else.
    """

    name: str
    signature: Signature | None


@dataclass(frozen=True, slots=True)
class WasmFile:
    """What a file has.

    Attributes:
        functions: The functions that it exports.
        other_exports: The names of its other exports, without its memory.
        imports: What it imports.
        has_memory: Whether it exports its memory as `memory`.
        memories: How many memories it has, with those that it imports.
        memory_maximum: How many bytes that may have, by what the file says itself; None for no maximum.
        has_start: Whether it runs something by itself once it is loaded.
    """

    functions: dict[str, Signature]
    other_exports: tuple[str, ...]
    imports: tuple[Import, ...]
    has_memory: bool
    memories: int
    memory_maximum: int | None
    has_start: bool


def read_wasm_file(data: bytes) -> WasmFile:
    """Read what a file has, which is valid.

    Raises:
        PluginError: It is not valid.
    """
    found = {number: _Reader(data, begin, end) for number, begin, end in sections(data) if number != _CUSTOM}
    types = list(_types(found[_TYPES])) if _TYPES in found else []
    imports: list[Import] = []
    functions: list[Signature] = []
    memories: list[int | None] = []
    if _IMPORTS in found:
        for name, kind, value in _imports(found[_IMPORTS]):
            if kind == _FUNCTION and value is not None:
                functions.append(_at(types, value))
            elif kind == _MEMORY:
                memories.append(value)
            imports.append(Import(name, functions[-1] if kind == _FUNCTION else None))
    if (reader := found.get(_FUNCTIONS)) is not None:
        functions += [_at(types, reader.number()) for _ in range(reader.number())]
    if (reader := found.get(_MEMORIES)) is not None:
        memories += [reader.limits() for _ in range(reader.number())]
    exports: dict[str, Signature] = {}
    others = []
    memory = None
    if (reader := found.get(_EXPORTS)) is not None:
        for _ in range(reader.number()):
            name, kind, index = reader.name(), reader.byte(), reader.number()
            if kind == _FUNCTION:
                exports[name] = _at(functions, index)
            elif kind == _MEMORY and name == "memory":
                memory = index
            else:
                others.append(name)
    maximum = None if memory is None else _at(memories, memory)
    return WasmFile(
        exports, tuple(others), tuple(imports), memory is not None, len(memories), maximum, _START in found
    )


def custom_sections(data: bytes, name: str) -> list[bytes]:
    """Return the content of the custom sections of a file that have a name.

    Raises:
        PluginError: A section ends behind the file.
    """
    found = []
    for number, begin, end in sections(data):
        if number == _CUSTOM:
            reader = _Reader(data, begin, end)
            if reader.bytes(reader.number()) == name.encode():
                found.append(data[reader.at : end])
    return found


def sections(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Return the number of each section of a file, and where its content begins and ends.

    Raises:
        PluginError: A section ends behind the file.
    """
    reader = _Reader(data, _HEADER_SIZE, len(data))
    while reader.at < len(data):
        number = reader.byte()
        size = reader.number()
        begin = reader.at
        reader.bytes(size)
        yield number, begin, begin + size


def _types(reader: _Reader) -> Iterator[Signature]:
    for _ in range(reader.number()):
        if reader.byte() != _FUNCTION_TYPE:
            raise PluginError(f"byte {reader.at - 1}: a type that is none of functions")
        parameters, results = (tuple(reader.value_type() for _ in range(reader.number())) for _ in range(2))
        yield Signature(parameters, results)


def _imports(reader: _Reader) -> Iterator[tuple[str, int, int | None]]:
    """Return the name of each import, its kind, and the type of a function or the maximum of a memory."""
    for _ in range(reader.number()):
        name = shown(f"{reader.name()}.{reader.name()}")
        kind = reader.byte()
        value: int | None = None
        if kind == _FUNCTION:
            value = reader.number()
        elif kind == _TABLE:
            reader.byte()
            reader.limits()
        elif kind == _MEMORY:
            value = reader.limits()
        elif kind in (_GLOBAL, _TAG):
            reader.byte()
            reader.number()
        else:
            raise PluginError(f"byte {reader.at - 1}: an import of the kind {kind}, which there is not")
        yield name, kind, value


def _at(items: list[_T], index: int) -> _T:
    if index >= len(items):
        raise PluginError(f"there is no type, function or memory {index}")
    return items[index]


class _Reader:
    """Takes one thing after the other of a part of a file, none past its end.

    Attributes:
        at: Where the next thing begins.
    """

    def __init__(self, data: bytes, begin: int, end: int) -> None:
        self._data = data
        self._end = end
        self.at = begin

    def bytes(self, size: int) -> bytes:
        if size > self._end - self.at:
            raise PluginError(
                f"byte {self.at}: {size} bytes do not fit into the {self._end - self.at} that are left"
            )
        self.at += size
        return self._data[self.at - size : self.at]

    def byte(self) -> int:
        return self.bytes(1)[0]

    def number(self) -> int:
        """Take a number of 32 bits, in 7 bits a byte."""
        value = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise PluginError(f"byte {self.at - 5}: a number does not end")

    def name(self) -> str:
        return self.bytes(self.number()).decode(errors="replace")

    def value_type(self) -> str:
        number = self.byte()
        return _VALUE_TYPES.get(number, f"type {number:#x}")

    def limits(self) -> int | None:
        """Take the minimum and the maximum of a table or a memory; return the maximum, as bytes of a memory."""
        has_maximum = self.byte() & 1
        self.number()
        return self.number() * PAGE if has_maximum else None
