"""Parser modules of PlotJuggler 4: the dialect `module`, which is experimental."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.dialects import Dialect
from rosidl_adapter_proto.plotjuggler.engine import Limits, Program, write
from rosidl_adapter_proto.plotjuggler.loops import BAD_TOKEN, ERROR_SIZE, OUTPUTS, Stop
from rosidl_adapter_proto.plotjuggler.module_manifest import Claim, ModuleManifest
from rosidl_adapter_proto.plotjuggler.session import (
    Messages,
    Outputs,
    Packed,
    ParserRequest,
    Session,
)
from rosidl_adapter_proto.plotjuggler.values import shown

OUTPUT_CAPACITY = 16 << 20
"""How many bytes an output may have here; the contract has no limit but memory."""
OUTPUT_ROOM = OUTPUT_CAPACITY + (4 << 20)
"""Where outputs are copied to; when it has no room for the largest, it is emptied before another message is parsed."""
INPUT_HEADER = struct.Struct("<B7xqQ")
BINDING_HEADER = struct.Struct("<HHIHHI")
SCALAR_ROUTE = 1
DECLINED = 1


class ModuleSession(Session):
    """A plugin whose parsers are tokens, which are bound to a type, and whose outputs are its own."""

    def __init__(self, program: Program, dialect: Dialect, limits: Limits, manifest: ModuleManifest) -> None:
        super().__init__(program, dialect, limits)
        abi = self.instance.call("pj_module_abi")
        if abi != 1:
            raise PluginError(f"{program.name}: pj_module_abi returned {abi}; 1 is the only one there is")
        self._manifest = manifest
        # Where the module says where its output is, two numbers of 64 bits, and room for the text of an error.
        self._slots = self.allocate(16 + ERROR_SIZE, "results")
        self.instance.grow(self._loop["memory"], OUTPUT_ROOM)

    def create(self, request: ParserRequest) -> int:
        if request.array_policy is not None:
            raise PluginError("modules have no policy for arrays, so arrays stay as it has them")
        claims = self._manifest.claims_of(request.type_name)
        if not claims:
            raise PluginError(f"its manifest claims no values of {request.type_name}")
        for index, claim in claims:
            token: int = self.instance.call("pj_module_create", index)
            if token == 0:
                raise PluginError(f"pj_module_create failed: {self._last_error(0)}")
            block = binding(index, claim, request)
            address = self.allocate(len(block), "what it is bound with")
            write(self.instance.view(), address, block)
            code = self.instance.call("pj_module_bind", token, address, len(block))
            if code == 0:
                self.free(address, len(block))
                return token
            reason = self._last_error(token)
            self.free(address, len(block))
            self.destroy(token)
            if code != DECLINED:
                raise PluginError(f"pj_module_bind returned {code}: {reason}")
        raise PluginError(f"pj_module_bind declined: {reason}")

    def _last_error(self, token: int) -> str:
        address = self._slots + 16
        size = self.instance.call("pj_module_last_error", token, address, ERROR_SIZE)
        if not 0 <= size <= ERROR_SIZE:
            return f"pj_module_last_error returned {size}, which is more than the {ERROR_SIZE} bytes that it may write"
        return _error_text(bytes(self.instance.view()[address : address + size]))

    def destroy(self, handle: int) -> None:
        self.instance.call("pj_module_destroy", handle)

    def free(self, address: int, size: int) -> None:
        self.instance.call("pj_module_free", address, size)

    def run(self, handle: int, count: int) -> Stop:
        room = OUTPUTS, OUTPUTS + OUTPUT_ROOM
        return Stop(
            self.instance.call_function(self._loop["run"], handle, count, *room, OUTPUT_CAPACITY, self._slots)
        )

    def outputs(self, first: int, begin: int, end: int) -> Outputs:
        rows = self._rows(begin, end)
        own = self._own()
        codes = rows[:, 3].astype("<i4")
        refused = {}
        for at in numpy.flatnonzero(codes < 0).tolist():
            place, size = rows[at, 2], rows[at, 1]
            text = _error_text(bytes(own[place : place + size]))
            refused[first + begin + at] = f"pj_module_parse returned {codes[at]}: {text}"
        return Outputs(first + begin, own, rows[:, 2], codes, refused)

    def offence(self, stop: Stop, row: int) -> str:
        address, size = struct.unpack_from("<QQ", self.instance.view(), self._slots)
        if stop is Stop.BAD_RESULT:
            code = self._rows(row, row + 1)[0, 3].astype("<i4")
            if code == BAD_TOKEN:
                return f"pj_module_parse does not know the token that it gave ({code})"
            if code > 0:
                return f"pj_module_parse returned {code}, which means nothing"
            return f"pj_module_last_error wrote more than the {ERROR_SIZE} bytes that it may write"
        if stop is Stop.BAD_DESCRIPTOR:
            memory = len(self.instance.view())
            return f"it says that its output is {size} bytes at {address}, but its memory has {memory}"
        return f"its output has {size} bytes; here it may have {OUTPUT_CAPACITY}"

    def _pack(self, messages: Messages, first: int, last: int) -> Packed:
        sizes = messages.sizes[first:last] + INPUT_HEADER.size
        return Packed(b"".join(_inputs(messages, first, last)), numpy.cumsum(sizes) - sizes, sizes)


def _inputs(messages: Messages, first: int, last: int) -> Iterator[bytes | memoryview]:
    """Return the inputs of messages: a header before each."""
    for index, message in enumerate(messages.slices(first, last), first):
        time = None if messages.times is None else int(messages.times[index])
        yield INPUT_HEADER.pack(time is not None, time or 0, len(message))
        yield message


def binding(claim_index: int, claim: Claim, request: ParserRequest) -> bytes:
    """Return what a module is bound with.

    The fields are the encoding, the type, its schema, the claim, the configuration and the digest of the schema; the
    last two are empty, as where there are none.
    """
    fields = [
        claim.encoding.encode(),
        request.type_name.encode(),
        request.schema,
        claim.claim_id.encode(),
        b"",
        b"",
    ]
    begin = BINDING_HEADER.size + 8 * len(fields)
    places = b""
    for field in fields:
        places += struct.pack("<II", begin, len(field))
        begin += len(field)
    header = BINDING_HEADER.pack(1, SCALAR_ROUTE, claim_index, 0, 0, len(fields))
    return header + places + b"".join(fields)


def _error_text(data: bytes) -> str:
    """Return the text of an error that a module has written."""
    return shown(data.partition(b"\0")[0].decode(errors="replace")) or "it says no reason"
