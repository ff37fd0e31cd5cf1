"""The sections of a WebAssembly module (https://webassembly.github.io/spec/core/binary/modules.html)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

T = TypeVar("T")
I32, I64 = 0x7F, 0x7E
FUNCTION, MEMORY = 0, 2
Signature = tuple[bytes, bytes]


@dataclass
class Module:
    """What is asked of a plugin."""

    sections: list[int] = field(default_factory=list)
    types: list[Signature] = field(default_factory=list)
    imports: int = 0
    functions: list[int] = field(default_factory=list)
    memories: list[tuple[int, int | None]] = field(default_factory=list)  # pages: at first, and at most
    exports: dict[str, tuple[int, int]] = field(default_factory=dict)  # the kind and the index of each
    custom: list[tuple[str, bytes]] = field(default_factory=list)

    def signature(self, name: str) -> Signature:
        kind, index = self.exports[name]
        assert kind == FUNCTION
        return self.types[self.functions[index - self.imports]]


class _Reader:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.place = 0

    def byte(self) -> int:
        self.place += 1
        return self.data[self.place - 1]

    def unsigned(self) -> int:
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def take(self, size: int) -> bytes:
        taken = self.data[self.place : self.place + size]
        assert len(taken) == size
        self.place += size
        return taken

    def text(self) -> str:
        return self.take(self.unsigned()).decode()

    def vector(self, read: Callable[[], T]) -> list[T]:
        return [read() for _ in range(self.unsigned())]

    def signature(self) -> Signature:
        assert self.byte() == 0x60
        return self.take(self.unsigned()), self.take(self.unsigned())

    def limits(self) -> tuple[int, int | None]:
        has_maximum = {0: False, 1: True}[self.byte()]
        return self.unsigned(), self.unsigned() if has_maximum else None

    def export(self) -> tuple[str, tuple[int, int]]:
        return self.text(), (self.byte(), self.unsigned())


def read_module(data: bytes) -> Module:
    """Read a module, which must be well-formed as far as it is looked at."""
    assert data[:8] == b"\0asm\1\0\0\0"
    module, file = Module(), _Reader(data[8:])
    while file.place < len(file.data):
        kind = file.byte()
        section = _Reader(file.take(file.unsigned()))
        module.sections.append(kind)
        if kind == 0:
            name = section.text()
            module.custom.append((name, section.data[section.place :]))
        elif kind == 1:
            module.types = section.vector(section.signature)
        elif kind == 2:
            module.imports = section.unsigned()
        elif kind == 3:
            module.functions = section.vector(section.unsigned)
        elif kind == 5:
            module.memories = section.vector(section.limits)
        elif kind == 7:
            module.exports = dict(section.vector(section.export))
        if kind in (1, 3, 5, 7):
            assert section.place == len(section.data)
    return module
