"""An emulation of PlotJuggler 3.13 to 3.17: what its loader calls, in its order, and how it reads the answers.

Facts from `wasm_runtime.cpp` and `wasm_parser.cpp` of that program. Whatever throws there, or traps, raises here.
"""

from __future__ import annotations

import struct
from functools import cache
from pathlib import Path

import wasmtime

INPUT_SIZE = 128 * 1024
OUTPUT_SIZE = 1024 * 1024
Value = tuple[
    str, str, float | str
]  # the key; `number` or `string`; the value, of which numbers become doubles

_NUMBERS = {
    **{0: "B", 1: "H", 2: "I", 3: "Q", 8: "b", 9: "h", 10: "i", 11: "q"},
    **{16: "f", 17: "d", 20: "?"},
}
_STRING, _BLOB = 18, 19


@cache
def _compiled(plugin: Path) -> tuple[wasmtime.Engine, wasmtime.Module]:
    engine = wasmtime.Engine()
    return engine, wasmtime.Module.from_file(engine, plugin)


class ReleasedHost:
    """One plugin, with one instance for all topics."""

    def __init__(self, plugin: Path, memory_limit: int | None = None) -> None:
        engine, module = _compiled(plugin)
        self.store = wasmtime.Store(engine)
        if memory_limit is not None:
            self.store.set_limits(memory_size=memory_limit)
        instance = wasmtime.Instance(self.store, module, [])  # no imports
        self.exports = instance.exports(self.store)
        memory = self.exports["memory"]
        assert isinstance(memory, wasmtime.Memory)
        self.memory = memory
        self.call("_initialize")
        self.manifest = self.released_manifest(self.text(self.call("pj_plugin_manifest")))

    def call(self, name: str, *arguments: int) -> int:
        function = self.exports[name]
        assert isinstance(function, wasmtime.Func)
        result = function(self.store, *arguments)
        return 0 if result is None else int(result)

    def text(self, address: int) -> str:
        assert 0 < address < self.memory.data_len(self.store)
        data = self.memory.read(self.store, address)
        return bytes(data[: data.index(0)]).decode()

    @staticmethod
    def released_manifest(text: str) -> dict[str, str]:
        """Split at newlines and colons; a line with any other number of colons than one is not seen."""
        parts = [line.split(":") for line in text.split("\n")]
        return {part[0].strip(): part[1].strip() for part in parts if len(part) == 2}

    def allocate(self, size: int, content: bytes = b"") -> int:
        address = self.call("malloc", size)
        if address == 0:
            raise MemoryError("WASM malloc returned null")
        assert address + size <= self.memory.data_len(self.store)
        self.memory.write(self.store, content, address)
        return address


class ReleasedParser:
    """The messages of one topic."""

    def __init__(self, host: ReleasedHost, type_name: bytes, schema: bytes) -> None:
        self.host = host
        # The topic is left empty on purpose: it is put before the keys.
        self.texts = [host.allocate(len(text) + 1, text + b"\0") for text in (b"", type_name, schema)]
        self.instance = host.call("pj_parser_create", *self.texts)  # 0 is not noticed
        self.input_size = INPUT_SIZE
        self.input = host.allocate(INPUT_SIZE)
        self.output = host.allocate(OUTPUT_SIZE)

    def set_array_policy(self, clamp: bool, maximum: int) -> None:
        self.host.call("pj_parser_set_array_policy", self.instance, clamp, maximum)

    def decode(self, message: bytes, function: str = "pj_parser_decode") -> bytes | None:
        """Return the output; None for a message that is dropped. The document has another function for it."""
        host = self.host
        if self.input_size < len(message):
            host.call("free", self.input)
            self.input_size = max(2 * self.input_size, len(message))
            self.input = host.allocate(self.input_size)
        pages = host.memory.size(host.store)
        host.memory.write(host.store, message, self.input)
        size = host.call(function, self.instance, self.input, len(message), self.output)
        # The pointer to the output was taken before the call.
        assert host.memory.size(host.store) == pages
        if size <= 0:
            return None
        assert size <= OUTPUT_SIZE
        return bytes(host.memory.read(host.store, self.output, self.output + size))

    def parse(self, message: bytes) -> list[Value] | None:
        output = self.decode(message)
        return None if output is None else read_pairs(output)

    def destroy(self) -> None:
        self.host.call("pj_parser_destroy", self.instance)
        for address in (self.input, self.output, *self.texts):
            self.host.call("free", address)


def read_pairs(output: bytes) -> list[Value]:
    """Read an output as that program does; it must be used up."""
    (count,) = struct.unpack_from("<I", output)
    place = 4

    def text() -> str:
        nonlocal place
        (size,) = struct.unpack_from("<I", output, place)
        place += 4 + size
        assert place <= len(output)
        return output[place - size : place].decode()

    pairs: list[Value] = []
    for _ in range(count):
        key, kind = text(), output[place]
        place += 1
        if kind == _BLOB:
            place += 8
        elif kind == _STRING:
            pairs.append((key, "string", text()))
        else:
            layout = struct.Struct(f"<{_NUMBERS[kind]}")
            pairs.append((key, "number", float(layout.unpack_from(output, place)[0])))
            place += layout.size
    assert place == len(output)
    return pairs
