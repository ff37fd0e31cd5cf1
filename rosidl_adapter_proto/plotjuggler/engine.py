"""WebAssembly of unknown origin, run within limits: what a plugin's file exports, and instances of it."""

from __future__ import annotations

import atexit
import ctypes
import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.wasm_file import (
    MAGIC,
    PAGE,
    Import,
    Signature,
    WasmFile,
    read_wasm_file,
)

if TYPE_CHECKING:
    import wasmtime
    from typing_extensions import Buffer

MAXIMUM_FILE_SIZE = 64 << 20
_NUMBERS = {"i32", "i64", "f32", "f64"}
_WASI = ("wasi_snapshot_preview1.", "wasi_unstable.")
_INITIALIZERS = ("_initialize", "__wasm_call_ctors")  # the first that there is is called, as PlotJuggler does


@dataclass(frozen=True, slots=True)
class Limits:
    """What a plugin may use.

    Attributes:
        memory: How many bytes of memory it may have.
        instructions: How many instructions a call may take; with these, an endless loop is stopped in about a second.
    """

    memory: int = 256 << 20
    instructions: int = 2_000_000_000


@dataclass(frozen=True)
class Program:
    """The file of a plugin, compiled.

    Attributes:
        name: What it is called, for people.
        data: Its bytes.
        module: What the engine made of it.
        file: What the file has.
    """

    name: str
    data: bytes
    module: wasmtime.Module
    file: WasmFile

    @property
    def functions(self) -> dict[str, Signature]:
        """The functions that it exports."""
        return self.file.functions


def read_program(plugin: str | Path | bytes) -> Program:
    """Read and compile a plugin.

    Args:
        plugin: Its file, or its bytes.

    Compiling has no limit of time but that of the size of the file; the largest ones may take a minute.

    Raises:
        PluginError: It cannot be read, is too large, or is no WebAssembly, or there is no engine to run it.
    """
    try:
        import wasmtime
    except ImportError as error:
        raise PluginError(
            f"{error}; pip install 'rosidl-adapter-proto[plotjuggler]' brings what runs plugins"
        ) from None
    name = "plugin" if isinstance(plugin, bytes) else Path(plugin).name
    data = plugin if isinstance(plugin, bytes) else _file_bytes(Path(plugin))
    if len(data) > MAXIMUM_FILE_SIZE:
        raise PluginError(f"{name}: more than {MAXIMUM_FILE_SIZE} bytes, which no plugin has")
    if not data.startswith(MAGIC):  # wasmtime would take a text for one
        raise PluginError(f"{name}: not a WebAssembly file")
    try:
        module = wasmtime.Module(engine(), data)
    except wasmtime.WasmtimeError as error:
        raise PluginError(f"{name}: not valid WebAssembly: {_one_line(str(error))}") from None
    return Program(name, data, module, read_wasm_file(data))


def is_wasi(needed: Import) -> bool:
    """Tell whether an import is a function of WASI: those are there, and do nothing."""
    if needed.signature is None or not needed.name.startswith(_WASI):
        return False
    return {*needed.signature.parameters, *needed.signature.results} <= _NUMBERS


def _file_bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAXIMUM_FILE_SIZE + 1)
    except OSError as error:
        raise PluginError(f"{path}: cannot be read: {error.strerror}") from None


@functools.lru_cache(maxsize=1)
def engine() -> wasmtime.Engine:
    """Return the engine of all plugins, which counts instructions."""
    import wasmtime

    configuration = wasmtime.Config()
    configuration.consume_fuel = True
    configuration.wasm_multi_memory = True  # the loops have a memory besides that of the plugin
    configuration.wasm_memory64 = False
    configuration.wasm_threads = False
    configuration.wasm_function_references = False
    configuration.wasm_gc = False
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

        unknown = [each.name for each in program.file.imports if not is_wasi(each)]
        if unknown:
            raise PluginError(
                f"{program.name}: imports {', '.join(unknown)}, which a plugin does not get; build it without imports"
            )
        if program.file.memories > 1:  # the limit holds for each of them
            raise PluginError(f"{program.name}: it has {program.file.memories} memories; a plugin has one")
        self.program = program
        self.store = wasmtime.Store(engine())
        self._limits = limits
        self._allocator = allocator
        self._arena = (0, 0)
        self._limit_memory(limits.memory)
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

    def _limit_memory(self, size: int) -> None:
        self.store.set_limits(memory_size=size, table_elements=100_000, instances=4, tables=10, memories=2)

    def grow(self, memory: wasmtime.Memory, size: int) -> None:
        """Make a memory of ours larger, for which the plugin's limit does not hold."""
        self._limit_memory(max(self._limits.memory, memory.data_len(self.store) + size))
        memory.grow(self.store, size // PAGE)
        self._limit_memory(self._limits.memory)

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
        if size > self._limits.memory:
            return 0
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

    reason = trap.message.rpartition("wasm trap: ")[2].partition("\n")[0] or "it says no reason"
    code = trap.trap_code
    if code is wasmtime.TrapCode.OUT_OF_FUEL:
        return Trap("it took too many instructions", out_of_instructions=True)
    return Trap(reason)
