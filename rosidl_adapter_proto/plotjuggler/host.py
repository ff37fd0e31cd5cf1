"""Parser plugins of PlotJuggler, run from Python.

```python
plugin = open_plugin("ros2msg.wasm")
with plugin.parser("/imu", "sensor_msgs/msg/Imu", schema) as parser:
    for pair in parser.parse(message).pairs:
        print(pair.key, pair.value)
```
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, TypeVar

import numpy

from rosidl_adapter_proto.errors import PluginError, RequestError
from rosidl_adapter_proto.plotjuggler.columns import Batch, BatchError, Collector, Templates
from rosidl_adapter_proto.plotjuggler.dialects import DIALECTS, Dialect, served_dialects
from rosidl_adapter_proto.plotjuggler.engine import Instance, Limits, Program, Trap, read_program
from rosidl_adapter_proto.plotjuggler.functions import FunctionsSession
from rosidl_adapter_proto.plotjuggler.loops import Stop
from rosidl_adapter_proto.plotjuggler.manifest import (
    MAXIMUM_SIZE,
    Manifest,
    read_manifest,
    read_released_manifest,
)
from rosidl_adapter_proto.plotjuggler.module_manifest import ModuleManifest, read_module_manifest
from rosidl_adapter_proto.plotjuggler.modules import ModuleSession
from rosidl_adapter_proto.plotjuggler.output import ReadLayout, field_value, message_time
from rosidl_adapter_proto.plotjuggler.session import BrokenContract, Messages, Outputs, ParserRequest, Session
from rosidl_adapter_proto.plotjuggler.values import ArrayPolicy, Blob, BuiltinType, Pair

if TYPE_CHECKING:
    from typing_extensions import Buffer

__all__ = [
    "ArrayPolicy",
    "BatchError",
    "Blob",
    "BuiltinType",
    "Limits",
    "Pair",
    "Parsed",
    "Parser",
    "Plugin",
    "open_plugin",
]


MAXIMUM_STRIKES = 3
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Parsed:
    """What a plugin made of a message.

    Attributes:
        pairs: Keys and values, in the order in which the plugin wrote them.
        time: The time of the message in nanoseconds: the one that the plugin found in it, where that was asked for,
            else the one that was given.
        refused: Why the plugin did not take the message; None if it did.
    """

    pairs: tuple[Pair, ...]
    time: int | None
    refused: str | None = None


def open_plugin(
    plugin: str | Path | bytes, *, dialect: str | None = None, limits: Limits | None = None
) -> Plugin:
    """Open a plugin.

    Args:
        plugin: Its file, or its bytes.
        dialect: What to speak to it in: `released`, `page` or `module`; by default the first of these that it serves.
        limits: What it may use; by default 256 MiB and 2,000,000,000 instructions a call.

    Raises:
        PluginError: It cannot be read, is no plugin, or cannot be started.
        RequestError: There is no such dialect.
    """
    if dialect is not None and dialect not in DIALECTS:
        raise RequestError(f"there is no dialect {dialect}; there are {', '.join(DIALECTS)}")
    program = read_program(plugin)
    served = served_dialects(program)
    if dialect is not None and dialect not in served:
        raise PluginError(f"{program.name}: does not serve the dialect {dialect}, but {', '.join(served)}")
    return Plugin(program, served, DIALECTS[dialect or served[0]], limits or Limits())


class Plugin:
    """A plugin. Neither it nor its parsers are for several threads at once.

    Attributes:
        name: What its file is called.
        dialects: The dialects that it serves.
        dialect: The one that it is spoken to in.
        manifest: What it says of itself; that of a parser module where it is spoken to as one.
    """

    def __init__(self, program: Program, dialects: tuple[str, ...], dialect: Dialect, limits: Limits) -> None:
        self.name = program.name
        self.dialects = dialects
        self.dialect = dialect.name
        self._program = program
        self._dialect = dialect
        self._limits = limits
        self._session: Session | None = None
        self._strikes = 0
        self.manifest = self._read_manifest()

    @property
    def encodings(self) -> tuple[str, ...]:
        """The encodings of the messages that it parses, such as `ros2msg`."""
        return self.manifest.encodings

    def parser(
        self,
        topic: str,
        type_name: str,
        schema: bytes,
        *,
        array_policy: ArrayPolicy | None = None,
        embedded_time: bool = False,
    ) -> Parser:
        """Return a parser for the messages of a topic.

        Args:
            topic: The topic.
            type_name: The type of its messages, as the recording has it.
            schema: What the type is, in the form that the plugin's encoding has.
            array_policy: What becomes of long arrays; by default what the plugin does by itself.
            embedded_time: Whether a time that the plugin finds in a message is the time of its values; else what says
                so (`__timestamp`) is a value as any other.

        Raises:
            PluginError: The plugin does not make one.
            RequestError: The topic or the type has a NUL byte.
        """
        if "\0" in topic + type_name:
            raise RequestError("a topic and a type have no NUL byte")
        return Parser(self, ParserRequest(topic, type_name, schema, array_policy), embedded_time)

    @property
    def read_layout(self) -> ReadLayout:
        """What reads the outputs of its dialect."""
        return self._dialect.read_layout

    def session(self) -> Session:
        """Return the plugin as it runs; a new one if it was stopped before.

        Raises:
            PluginError: It cannot be started.
        """
        if self._strikes == MAXIMUM_STRIKES:
            raise PluginError(
                f"{self.name}: broke its contract {MAXIMUM_STRIKES} times, and is not run again"
            )
        if self._session is None:
            self._session = self._begun(self._start)
        return self._session

    def _start(self) -> Session:
        if isinstance(self.manifest, ModuleManifest):
            return ModuleSession(self._program, self._dialect, self._limits, self.manifest)
        return FunctionsSession(self._program, self._dialect, self._limits)

    def _begun(self, start: Callable[[], _T]) -> _T:
        try:
            return start()
        except Trap as trap:
            raise PluginError(f"{self.name}: it was stopped while it began: {trap.reason}") from None

    def strike(self) -> None:
        """Count a time that the plugin was stopped or broke its contract: modules are not run after the third."""
        if self._dialect.name == "module":
            self._strikes += 1

    def runs(self, session: Session) -> bool:
        """Tell whether a session is the one that runs, and was not thrown away."""
        return session is self._session

    def discard(self) -> None:
        """Throw away what runs, after a trap: the next session is a fresh one."""
        self._session = None

    def _read_manifest(self) -> Manifest | ModuleManifest:
        if self._dialect.name == "module":
            return read_module_manifest(self._program.data)
        instance = self._begun(lambda: Instance(self._program, self._limits, None))
        try:
            text = manifest_text(instance)
        except Trap as trap:
            raise PluginError(f"{self.name}: it was stopped in pj_plugin_manifest: {trap.reason}") from None
        try:
            return read_manifest(text)
        except PluginError:
            if self._dialect.name == "page":
                raise
            return read_released_manifest(text)  # which is no YAML


def manifest_text(instance: Instance) -> str:
    """Return what `pj_plugin_manifest` says.

    Raises:
        PluginError: It is no text.
        Trap: The plugin was stopped.
    """
    address = instance.call("pj_plugin_manifest") & 0xFFFF_FFFF
    try:
        return instance.text(address, MAXIMUM_SIZE).decode()
    except UnicodeDecodeError as error:
        raise PluginError(f"manifest: byte {error.start} is not UTF-8") from None


class Parser:
    """Parses the messages of a topic. A context manager, which gives back what it has in the plugin.

    One that is not closed keeps that as long as its plugin runs.
    """

    def __init__(self, plugin: Plugin, request: ParserRequest, embedded_time: bool) -> None:
        self._plugin = plugin
        self._request = request
        self._embedded_time = embedded_time
        self._templates = Templates()
        self._session: Session | None = None
        self._handle = 0
        self._ready()

    def __enter__(self) -> Parser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give back what it has in the plugin."""
        session, self._session = self._session, None
        if session is not None and self._plugin.runs(session):
            try:
                session.destroy(self._handle)
            except Trap as trap:
                self._plugin.discard()
                raise self._error(None, f"stopped while the parser was destroyed: {trap.reason}") from None

    def parse(self, data: Buffer, time: int | None = None) -> Parsed:
        """Parse one message. Many go faster with `parse_batch`.

        Args:
            data: The message.
            time: When it was recorded, in nanoseconds since 1970.

        Raises:
            PluginError: The plugin was stopped, or did what its contract forbids.
        """
        view = memoryview(data).cast("B")
        times = None if time is None else numpy.array([time], "i8")
        messages = Messages(view, numpy.zeros(1, "i8"), numpy.array([len(view)], "i8"), times)
        try:
            outputs = next(self._outputs(messages))
        except BrokenContract as broken:
            raise self._broken(broken.index, broken.reason) from None
        begin, size = int(outputs.begins[0]), int(outputs.sizes[0])
        if size <= 0:
            return Parsed((), time, outputs.refused[0])
        output = bytes(outputs.memory[begin : begin + size])
        try:
            layout = self._plugin.read_layout(output, self._embedded_time)
            if layout.time is not None:
                time = message_time(output, layout)
            pairs = [
                Pair(each.key, each.kind, field_value(output, each, len(view))) for each in layout.fields
            ]
        except PluginError as error:
            raise self._broken(0, str(error)) from None
        return Parsed(tuple(pairs), time)

    def parse_batch(self, data: Buffer, ranges: Buffer, times: Buffer | None = None) -> Batch:
        """Parse many messages at once, in a loop within WebAssembly.

        Args:
            data: What the messages are in.
            ranges: Where each is: two numbers of 64 bits for each, the first byte and the one after the last.
            times: When each was recorded, in nanoseconds since 1970: a number of 64 bits for each.

        Raises:
            BatchError: The plugin was stopped, or did what its contract forbids; the error has what came before that.
            RequestError: A range is not within `data`, or there are not as many times as messages.
        """
        messages = _messages(memoryview(data).cast("B"), ranges, times)
        collector = Collector(messages, self._plugin.read_layout, self._embedded_time, self._templates)
        try:
            for outputs in self._outputs(messages):
                collector.add(outputs)
        except BrokenContract as broken:
            reason = str(self._broken(broken.index, broken.reason))
        except PluginError as error:
            reason = str(error)
        else:
            return collector.batch()
        raise BatchError(reason, collector.batch())

    def _outputs(self, messages: Messages) -> Iterator[Outputs]:
        """Run messages through the plugin, and return what it writes as often as there is no more room for it.

        Raises:
            BrokenContract: The plugin was stopped, or did what its contract forbids.
            PluginError: It cannot be started, has no memory, or does not make the parser again.
        """
        first = 0
        while first < len(messages):
            session = self._ready()
            count = 0
            done = 0
            try:
                count = session.load(messages, first)
                while done < count:
                    stop = session.run(self._handle, count)
                    before, done = done, session.done
                    if done > before:
                        yield session.outputs(first, before, done)
                    if stop not in (Stop.DONE, Stop.FULL) or done == before:
                        raise BrokenContract(first + done, session.offence(stop, done))
            except Trap as trap:
                before, done = done, session.done if count else 0
                if done > before:
                    yield session.outputs(first, before, done)
                self._plugin.discard()
                # Many messages together may take more instructions than one may.
                if not (trap.out_of_instructions and done > before):
                    raise BrokenContract(first + done, f"it was stopped: {trap.reason}") from None
            first += done

    def _ready(self) -> Session:
        """Return the session that the parser is made in, after a trap a fresh one."""
        session = self._plugin.session()
        if session is not self._session:
            try:
                self._handle = session.create(self._request)
            except PluginError as error:
                raise self._error(None, str(error)) from None
            except Trap as trap:
                self._plugin.discard()
                self._plugin.strike()
                raise self._error(None, f"it was stopped while the parser was made: {trap.reason}") from None
            self._session = session
        return session

    def _broken(self, index: int, reason: str) -> PluginError:
        """Return the error for a broken contract, and count it."""
        self._plugin.strike()
        return self._error(index, reason)

    def _error(self, index: int | None, reason: str) -> PluginError:
        message = "" if index is None else f"message {index}: "
        return PluginError(
            f"{self._plugin.name}: {self._request.topic} ({self._request.type_name}): {message}{reason}"
        )


def _messages(data: memoryview, ranges: Buffer, times: Buffer | None) -> Messages:
    if memoryview(ranges).nbytes % 16:
        raise RequestError(f"the ranges have {memoryview(ranges).nbytes} bytes; a range has 16")
    if times is not None and memoryview(times).nbytes % 8:
        raise RequestError(f"the times have {memoryview(times).nbytes} bytes; a time has 8")
    pairs = numpy.frombuffer(memoryview(ranges), "<u8").reshape(-1, 2)
    begins, ends = pairs[:, 0], pairs[:, 1]
    if len(pairs) and (bool((begins > ends).any()) or int(ends.max()) > len(data)):
        raise RequestError(f"a range of a message is not within the {len(data)} bytes of data")
    recorded = None if times is None else numpy.frombuffer(memoryview(times), "<i8")
    if recorded is not None and len(recorded) != len(pairs):
        raise RequestError(f"there are {len(pairs)} messages and {len(recorded)} times")
    return Messages(data, begins.astype("i8"), (ends - begins).astype("i8"), recorded)
