"""Plugins of PlotJuggler 3, as it runs them (`released`) and as its page says (`page`)."""

from __future__ import annotations

import numpy

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.dialects import Dialect
from rosidl_adapter_proto.plotjuggler.engine import Limits, Program, write
from rosidl_adapter_proto.plotjuggler.loops import GUARD, Stop
from rosidl_adapter_proto.plotjuggler.session import (
    Messages,
    Outputs,
    Packed,
    ParserRequest,
    Session,
)

OUTPUT_CAPACITY = 1 << 20
"""How many bytes an output has at most: what PlotJuggler 3 gives, without telling the plugin."""
_MANY_OUTPUTS = 3 << 20


class FunctionsSession(Session):
    """A plugin whose parsers are pointers, and whose outputs go where it is told."""

    def __init__(self, program: Program, dialect: Dialect, limits: Limits) -> None:
        super().__init__(program, dialect, limits)
        self._room = self._output_room()
        # What parsers were made of: the released host keeps these texts as long as the parser, which may point to them.
        self._texts: dict[int, list[list[tuple[int, int]]]] = {}

    def _output_room(self) -> tuple[int, int]:
        """Return where outputs begin, and where the guard of the last one begins at the latest."""
        for size in (OUTPUT_CAPACITY + _MANY_OUTPUTS, OUTPUT_CAPACITY):
            if address := self.instance.allocate(size + 7 + len(GUARD)):
                begin = (address + 7) // 8 * 8
                return begin, begin + size
        raise PluginError(
            f"{self.instance.program.name}: it has no memory for outputs ({OUTPUT_CAPACITY} bytes)"
        )

    def create(self, request: ParserRequest) -> int:
        policy = request.array_policy
        if policy is not None and "pj_parser_set_array_policy" not in self.instance.program.functions:
            raise PluginError("it does not export pj_parser_set_array_policy, so arrays stay as it has them")
        topic = request.topic if self.dialect.name == "page" else ""  # the released host gives none
        texts: list[tuple[int, int]] = []
        try:
            for text in (topic.encode(), request.type_name.encode(), request.schema):
                texts.append((self.allocate(len(text) + 1, "a text"), len(text) + 1))
                write(self.instance.view(), texts[-1][0], text + b"\0")
            handle: int = self.instance.call("pj_parser_create", *(address for address, _ in texts))
            if not handle:
                raise PluginError("pj_parser_create returned 0: it does not take the type or the schema")
        except PluginError:
            self._free_texts(texts)
            raise
        self._texts.setdefault(handle, []).append(texts)
        if policy is not None:
            self.instance.call("pj_parser_set_array_policy", handle, policy.clamp, policy.maximum)
        return handle

    def destroy(self, handle: int) -> None:
        if "pj_parser_destroy" in self.instance.program.functions:
            self.instance.call("pj_parser_destroy", handle)
        self._free_texts(self._texts[handle].pop())

    def _free_texts(self, texts: list[tuple[int, int]]) -> None:
        for address, size in texts:
            self.free(address, size)

    def free(self, address: int, size: int) -> None:
        functions = self.instance.program.functions
        if "malloc" in functions and "free" in functions:
            self.instance.call("free", address)

    def run(self, handle: int, count: int) -> Stop:
        return Stop(
            self.instance.call_function(self._loop["run"], handle, count, *self._room, OUTPUT_CAPACITY)
        )

    def outputs(self, first: int, begin: int, end: int) -> Outputs:
        rows = self._rows(begin, end)
        sizes = rows[:, 3].astype("<i4")
        refused = {
            first + begin + at: f"{self.dialect.parse} returned {sizes[at]}"
            for at in numpy.flatnonzero(sizes <= 0).tolist()
        }
        return Outputs(first + begin, self.instance.view(), rows[:, 2], sizes, refused)

    def offence(self, stop: Stop, row: int) -> str:
        if stop is Stop.GUARD_OVERWRITTEN:
            return f"it wrote past the {OUTPUT_CAPACITY} bytes that an output has"
        rows = self._rows(row, row + 1)
        return f"it says that it wrote {rows[0, 3]} bytes, but an output has at most {OUTPUT_CAPACITY}"

    def _pack(self, messages: Messages, first: int, last: int) -> Packed:
        begins = messages.begins[first:last]
        sizes = messages.sizes[first:last]
        low, high = int(begins.min()), int((begins + sizes).max())
        if high - low <= 2 * int(sizes.sum()):
            return Packed(messages.data[low:high], begins - low, sizes)
        return Packed(b"".join(messages.slices(first, last)), numpy.cumsum(sizes) - sizes, sizes)
