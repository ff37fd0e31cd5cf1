"""A plugin that runs, with the buffers in its memory and the loop that hands messages to it."""

from __future__ import annotations

import abc
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.dialects import Dialect
from rosidl_adapter_proto.plotjuggler.engine import Instance, Limits, Program, memory_view, write
from rosidl_adapter_proto.plotjuggler.loops import NEXT, TABLE_ROWS, Stop, loop
from rosidl_adapter_proto.plotjuggler.wasm_file import PAGE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosidl_adapter_proto.plotjuggler.values import ArrayPolicy

_BATCH_INPUT = 4 << 20
_NEXT = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class ParserRequest:
    """What a parser is made for.

    Attributes:
        topic: The topic.
        type_name: The type of its messages.
        schema: What the type is.
        array_policy: What becomes of long arrays; None for what the plugin does by itself.
    """

    topic: str
    type_name: str
    schema: bytes
    array_policy: ArrayPolicy | None


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages to parse.

    Attributes:
        data: What they are in.
        begins: Where each begins.
        sizes: How many bytes each has.
        times: When each was recorded, in nanoseconds; None if unknown.
    """

    data: memoryview
    begins: NDArray[numpy.int64]
    sizes: NDArray[numpy.int64]
    times: NDArray[numpy.int64] | None

    def __len__(self) -> int:
        return len(self.begins)

    def slices(self, first: int, last: int) -> Iterator[memoryview]:
        """Return the bytes of some of them."""
        for begin, size in zip(
            self.begins[first:last].tolist(), self.sizes[first:last].tolist(), strict=True
        ):
            yield self.data[begin : begin + size]


@dataclass(frozen=True, slots=True)
class Packed:
    """Messages in the form in which a plugin reads them.

    Attributes:
        data: The bytes.
        begins: Where each message begins in them.
        sizes: How many bytes it has there.
    """

    data: bytes | memoryview
    begins: NDArray[numpy.int64]
    sizes: NDArray[numpy.int64]


@dataclass(frozen=True, slots=True)
class Outputs:
    """What a plugin wrote for some messages that follow each other.

    Attributes:
        first: The index of the first of them.
        memory: What the outputs are in; valid until the plugin is called again.
        begins: Where the output of each is, at a multiple of 8.
        sizes: How many bytes each has; 0 or less where the plugin refused the message.
        refused: Why it refused messages, by their index.
    """

    first: int
    memory: memoryview
    begins: NDArray[numpy.uint32]
    sizes: NDArray[numpy.int32]
    refused: dict[int, str] = field(default_factory=dict)

    @property
    def end(self) -> int:
        """The index after that of the last of them."""
        return self.first + len(self.begins)

    def before(self, index: int) -> Outputs:
        """Return those of messages before one."""
        count = index - self.first
        refused = {each: reason for each, reason in self.refused.items() if each < index}
        return Outputs(self.first, self.memory, self.begins[:count], self.sizes[:count], refused)


class BrokenContract(Exception):
    """A plugin did what its dialect forbids.

    Attributes:
        index: The message at which it did so.
        reason: What it did.
    """

    def __init__(self, index: int, reason: str) -> None:
        super().__init__(index, reason)
        self.index = index
        self.reason = reason


class Session(abc.ABC):
    """An instance of a plugin, and what it needs to run batches.

    Attributes:
        dialect: What it is spoken to in.
        instance: The instance.
    """

    def __init__(self, program: Program, dialect: Dialect, limits: Limits) -> None:
        """Start a plugin.

        Raises:
            PluginError: It cannot be started, or has no memory for what goes in and out.
            Trap: It was stopped.
        """
        self.dialect = dialect
        self.instance = Instance(
            program, limits, dialect.allocator if dialect.allocator in program.functions else None
        )
        self._loop = self.instance.link(loop(dialect.name == "module"), dialect.parse)
        self._input = (0, 0)

    @abc.abstractmethod
    def create(self, request: ParserRequest) -> int:
        """Make a parser in the plugin, and return what stands for it.

        Raises:
            PluginError: The plugin does not make one.
            Trap: The plugin was stopped.
        """

    @abc.abstractmethod
    def destroy(self, handle: int) -> None:
        """Give back a parser.

        Raises:
            Trap: The plugin was stopped.
        """

    @abc.abstractmethod
    def run(self, handle: int, count: int) -> Stop:
        """Have the messages parsed that were loaded, until outputs have no more room.

        Raises:
            Trap: The plugin was stopped.
        """

    @abc.abstractmethod
    def outputs(self, first: int, begin: int, end: int) -> Outputs:
        """Return what came of messages `begin` to `end` of those that were loaded.

        Args:
            first: The index of the first of those that were loaded.
            begin: The first of them.
            end: The one after the last of them.
        """

    @abc.abstractmethod
    def offence(self, stop: Stop, row: int) -> str:
        """Return what the plugin did wrong with the message at which the loop has stopped."""

    @abc.abstractmethod
    def _pack(self, messages: Messages, first: int, last: int) -> Packed:
        """Return messages as the plugin reads them."""

    def load(self, messages: Messages, first: int) -> int:
        """Copy messages into the plugin, and return how many they are: as many as a batch has.

        Raises:
            PluginError: It has no memory for them.
            Trap: It was stopped.
        """
        sizes = messages.sizes[first : first + TABLE_ROWS]
        count = max(1, int(numpy.searchsorted(numpy.cumsum(sizes), _BATCH_INPUT, side="right")))
        packed = self._pack(messages, first, first + min(count, len(sizes)))
        address = self._input_room(len(packed.data))
        write(self.instance.view(), address, packed.data)
        table = numpy.zeros((len(packed.begins), 4), "<u4")
        table[:, 0] = packed.begins + address
        table[:, 1] = packed.sizes
        own = self._own()
        write(own, 0, table.data)
        _NEXT.pack_into(own, NEXT, 0)
        return len(table)

    def _input_room(self, size: int) -> int:
        address, room = self._input
        if size > room or not address:  # a message without bytes has an address, too
            if room:
                self._input = (0, 0)
                self.free(address, room)
            room = max(2 * room, size, PAGE)
            address = self.instance.allocate(room)
            if not address:
                room = size
                address = self.allocate(room, "messages")
            self._input = address, room
        return address

    @property
    def done(self) -> int:
        """How many of the messages that were loaded are done."""
        count: int
        (count,) = _NEXT.unpack_from(self._own(), NEXT)
        return count

    def _rows(self, begin: int, end: int) -> NDArray[numpy.uint32]:
        return numpy.frombuffer(self._own(), "<u4", 4 * end).reshape(-1, 4)[begin:].copy()

    def _own(self) -> memoryview:
        """The memory of the loop."""
        return memory_view(self.instance.store, self._loop["memory"])

    def allocate(self, size: int, what: str) -> int:
        """Return the address of memory in the plugin that is ours.

        Raises:
            PluginError: There is none.
            Trap: The plugin was stopped.
        """
        address = self.instance.allocate(size)
        if not address:
            raise PluginError(f"{self.instance.program.name}: it has no memory for {what} ({size} bytes)")
        return address

    @abc.abstractmethod
    def free(self, address: int, size: int) -> None:
        """Give memory back, if the plugin can take it."""
