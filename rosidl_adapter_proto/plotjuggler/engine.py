"""WebAssembly of unknown origin, run within limits: what a plugin's file exports, and instances of it."""

from __future__ import annotations

import atexit
import ctypes
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.errors import PluginError

if TYPE_CHECKING:
    import wasmtime
    from typing_extensions import Buffer

MAXIMUM_FILE_SIZE = 64 << 20
PAGE = 1 << 16
_MAGIC = b"\0asm"
_WASI = ("wasi_snapshot_preview1.", "wasi_unstable.")
_INITIALIZERS = ("_initialize", "__wasm_call_ctors")  # the first that there is is called, as PlotJuggler does


@dataclass(frozen=True, slots=True)
class Limits:
    """What a plugin may use.

    Attributes:
        memory: How many bytes of memory it may have.
        instructions: How many instructions a call may take; about as many as a second has nanoseconds.
    """

    memory: int = 256 << 20
    instructions: int = 2_000_000_000


@dataclass(frozen=True, slots=True)
class Signature:
    """The types of a function, such as `i32`."""

    parameters: tuple[str, ...]
    results: tuple[str, ...]

    def __str__(self) -> str:
        return f"({', '.join(self.parameters)}) -> {', '.join(self.results) or 'nothing'}"


@dataclass(frozen=True)
class Program:
    """The file of a plugin, compiled.

    Attributes:
        name: What it is called, for people.
        data: Its bytes.
        module: What the engine made of it.
        functions: The functions that it exports.
        other_exports: The names of its other exports; `memory` among them if it is one.
        imports: What it imports, as `module.name`.
        memory_maximum: How many bytes its memory may have, by what it says itself; None for no maximum.
    """

    name: str
    data: bytes
    module: wasmtime.Module
    functions: dict[str, Signature]
    other_exports: tuple[str, ...]
    imports: tuple[str, ...]
    memory_maximum: int | None


def read_program(plugin: str | Path | bytes) -> Program:
    """Read and compile a plugin.

    Args:
        plugin: Its file, or its bytes.

    Raises:
        PluginError: It cannot be read, is too large, or is no WebAssembly.
    """
    import wasmtime

    name = "plugin" if isinstance(plugin, bytes) else Path(plugin).name
    data = plugin if isinstance(plugin, bytes) else _file_bytes(Path(plugin))
    if len(data) > MAXIMUM_FILE_SIZE:
        raise PluginError(f"{name}: more than {MAXIMUM_FILE_SIZE} bytes, which no plugin has")
    if not data.startswith(_MAGIC):  # wasmtime would take a text for one
        raise PluginError(f"{name}: not a WebAssembly file")
    try:
        module = wasmtime.Module(engine(), data)
    except wasmtime.WasmtimeError as error:
        raise PluginError(f"{name}: not valid WebAssembly: {_one_line(str(error))}") from None
    functions = {}
    others = []
    maximum = None
    for each in module.exports:
        kind = each.type
        if isinstance(kind, wasmtime.FuncType):
            functions[each.name] = _signature(kind)
        elif isinstance(kind, wasmtime.MemoryType) or each.name != "memory":
            others.append(each.name)
        if isinstance(kind, wasmtime.MemoryType) and each.name == "memory" and kind.limits.max is not None:
            maximum = kind.limits.max * PAGE
    imports = tuple(f"{each.module}.{each.name}" for each in module.imports)
    return Program(name, data, module, functions, tuple(others), imports, maximum)


def is_wasi(name: str) -> bool:
    """Tell whether an import, as `module.name`, is of WASI: such functions are there, and do nothing."""
    return name.startswith(_WASI)


def _file_bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAXIMUM_FILE_SIZE + 1)
    except OSError as error:
        raise PluginError(f"{path}: cannot be read: {error.strerror}") from None


def _signature(kind: wasmtime.FuncType) -> Signature:
    return Signature(tuple(map(str, kind.params)), tuple(map(str, kind.results)))


@functools.lru_cache(maxsize=1)
def engine() -> wasmtime.Engine:
    """Return the engine of all plugins, which counts instructions."""
    import wasmtime

    configuration = wasmtime.Config()
    configuration.consume_fuel = True
    configuration.wasm_multi_memory = True  # the loops have a memory besides that of the plugin
    configuration.wasm_memory64 = False
    configuration.wasm_threads = False
    atexit.register(engine.cache_clear)  # wasmtime frees what it has while its functions are still there
    return wasmtime.Engine(configuration)


def _one_line(text: str) -> str:
    return " ".join(text.split())


class Trap(Exception):
    """A plugin was stopped.

    Attributes:
        reason: Why, for people.
        out_of_instructions: Whether it took too many instructions.
    """

    def __init__(self, reason: str, out_of_instructions: bool = False) -> None:
        super().__init__(reason)
        self.reason = reason
        self.out_of_instructions = out_of_instructions


class Instance:
    """A plugin that runs. After a `Trap` it is in no known state, and has to be thrown away.

    Attributes:
        program: What runs.
        store: What the engine needs to run it.
        memory: Its memory.
    """

    def __init__(self, program: Program, limits: Limits, allocator: str | None) -> None:
        """Make one.

        Args:
            program: What shall run.
            limits: What it may use.
            allocator: The export that gives memory; without one, memory is taken from behind that of the plugin.

        Raises:
            PluginError: It needs what there is not.
            Trap: It was stopped while it began.
        """
        import wasmtime

        unknown = [name for name in program.imports if not is_wasi(name)]
        if unknown:
            raise PluginError(
                f"{program.name}: imports {', '.join(unknown)}, which a plugin does not get; build it without imports"
            )
        self.program = program
        self.store = wasmtime.Store(engine())
        self._limits = limits
        self._allocator = allocator
        self._arena = (0, 0)
        self.store.set_limits(
            memory_size=limits.memory, table_elements=100_000, instances=4, tables=10, memories=10
        )
        self.store.set_fuel(limits.instructions)
        linker = wasmtime.Linker(engine())
        try:
            linker.define_unknown_imports_as_default_values(self.store, program.module)
            exports = linker.instantiate(self.store, program.module).exports(self.store)
        except wasmtime.WasmtimeError as error:
            raise PluginError(f"{program.name}: cannot be started: {_one_line(str(error))}") from None
        except wasmtime.Trap as trap:
            raise _trap(trap) from None
        self.memory: wasmtime.Memory = exports["memory"]  # type: ignore[assignment]
        self._functions: dict[str, Any] = {name: exports[name] for name in program.functions}
        for name in _INITIALIZERS:
            if program.functions.get(name) == Signature((), ()):
                self.call(name)
                break

    def call(self, name: str, *arguments: int) -> Any:
        """Call a function that is exported, and return what it does.

        Raises:
            Trap: It was stopped.
        """
        return self.call_function(self._functions[name], *arguments)

    def call_function(self, function: wasmtime.Func, *arguments: int) -> Any:
        """Call any function in this store, and return what it does.

        Raises:
            Trap: It was stopped.
        """
        import wasmtime

        self.store.set_fuel(self._limits.instructions)
        try:
            return function(self.store, *arguments)
        except wasmtime.Trap as trap:
            raise _trap(trap) from None
        except wasmtime.WasmtimeError as error:
            raise Trap(_one_line(str(error))) from None

    def link(self, module: wasmtime.Module, function: str) -> dict[str, Any]:
        """Return the exports of a module of ours that imports the memory and a function of the plugin."""
        import wasmtime

        names = self._functions | {"memory": self.memory, "function": self._functions[function]}
        instance = wasmtime.Instance(self.store, module, [names[each.name or ""] for each in module.imports])
        exports = instance.exports(self.store)
        return {name: exports[name] for name in exports}

    def allocate(self, size: int) -> int:
        """Return the address of memory that is ours to write to, or 0 if there is none.

        Raises:
            Trap: The plugin was stopped.
        """
        if self._allocator is not None:
            address: int = self.call(self._allocator, size) & 0xFFFF_FFFF
            return address if address + size <= self.memory.data_len(self.store) else 0
        return self._grow(size)

    def _grow(self, size: int) -> int:
        import wasmtime

        size = (size + 15) // 16 * 16
        begin, end = self._arena
        if size > end - begin:
            pages = -(-size // PAGE)
            try:
                begin = self.memory.grow(self.store, pages) * PAGE
            except wasmtime.WasmtimeError:
                return 0
            end = begin + pages * PAGE
        self._arena = begin + size, end
        return begin

    def view(self) -> memoryview:
        """Return the memory, to read and to write; calls make it invalid, since memory may move."""
        return memory_view(self.store, self.memory)

    def text(self, address: int, maximum: int) -> bytes:
        """Return the bytes before the next NUL byte.

        Raises:
            PluginError: There is none within `maximum` bytes and the memory.
        """
        view = self.view()
        data = bytes(view[address : address + maximum])
        if address == 0 or b"\0" not in data:
            raise PluginError(f"no text of at most {maximum} bytes and a NUL byte at address {address}")
        return data[: data.index(b"\0")]


def memory_view(store: wasmtime.Store, memory: wasmtime.Memory) -> memoryview:
    """Return what is in a memory now, to read and to write."""
    size = memory.data_len(store)
    array = (
        (ctypes.c_ubyte * size).from_address(ctypes.addressof(memory.data_ptr(store).contents))
        if size
        else b""
    )
    return memoryview(array).cast("B")


def write(view: memoryview, address: int, data: Buffer) -> None:
    """Copy bytes into a memory, at an address that has room for them."""
    source = memoryview(data).cast("B")
    view[address : address + len(source)] = source


def _trap(trap: wasmtime.Trap) -> Trap:
    import wasmtime

    reason = trap.message.rpartition("wasm trap: ")[2].splitlines()[0]
    code = trap.trap_code
    if code is wasmtime.TrapCode.OUT_OF_FUEL:
        return Trap("it took too many instructions", out_of_instructions=True)
    return Trap(reason)
