"""Which contracts a plugin meets, point by point, as far as one can tell without its messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy

from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.dialects import DIALECTS, Dialect
from rosidl_adapter_proto.plotjuggler.engine import (
    Instance,
    Limits,
    Program,
    Trap,
    is_wasi,
    read_program,
    write,
)
from rosidl_adapter_proto.plotjuggler.functions import FunctionsSession
from rosidl_adapter_proto.plotjuggler.host import manifest_text
from rosidl_adapter_proto.plotjuggler.loops import Stop
from rosidl_adapter_proto.plotjuggler.manifest import (
    read_manifest,
    read_released_manifest,
    unseen_by_released,
)
from rosidl_adapter_proto.plotjuggler.module_manifest import (
    ModuleManifest,
    has_start_section,
    read_module_manifest,
)
from rosidl_adapter_proto.plotjuggler.modules import INPUT_HEADER, ModuleSession
from rosidl_adapter_proto.plotjuggler.session import BrokenContract, Messages, ParserRequest, Session

MODULE_MEMORY = 256 << 20
MODULE_INSTRUCTIONS = 10_000_000
_REQUEST = ParserRequest("", "check_msgs/msg/Check", b"", None)
_MESSAGES = (b"", b"\0", bytes(64), b"\xff" * 64, b"\0\1\0\0" + b"\xff" * 4096)


@dataclass(frozen=True, slots=True)
class Point:
    """A part of a contract.

    Attributes:
        name: What is asked for.
        met: Whether the plugin meets it.
        remark: What is wrong, or what else there is to say.
    """

    name: str
    met: bool
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Report:
    """What came of the check of one dialect.

    Attributes:
        dialect: The dialect.
        points: The parts of its contract.
    """

    dialect: Dialect
    points: tuple[Point, ...]

    @property
    def served(self) -> bool:
        """Whether the plugin has what parses messages in this dialect."""
        return len(self.points) > 1

    @property
    def met(self) -> bool:
        """Whether every part of the contract is met."""
        return all(point.met for point in self.points)


def check_plugin(plugin: str | Path | bytes) -> tuple[Report, ...]:
    """Check a plugin against all dialects.

    Raises:
        PluginError: It cannot be read, or is no WebAssembly.
    """
    program = read_program(plugin)
    reports = []
    for dialect in DIALECTS.values():
        if dialect.parse in program.functions:
            points = _module_points if dialect.name == "module" else _function_points
            reports.append(Report(dialect, tuple(points(program, dialect))))
        else:
            reports.append(Report(dialect, (Point(f"exports {dialect.parse}", False, "it does not"),)))
    return tuple(reports)


def _export_points(program: Program, dialect: Dialect) -> Iterator[Point]:
    for function in dialect.functions:
        found = program.functions.get(function.name)
        remark = "" if found == function.signature else "it does not" if found is None else f"it is {found}"
        yield Point(f"exports {function.name} {function.signature}", not remark, remark)
    yield Point("exports its memory", "memory" in program.other_exports)


def _probe(name: str, probe: Callable[[], str]) -> Point:
    """Return a point that is met if a probe goes well; it returns what else there is to say."""
    try:
        return Point(name, True, probe())
    except Trap as trap:
        return Point(name, False, f"it was stopped: {trap.reason}")
    except PluginError as error:
        return Point(name, False, str(error))
    except BrokenContract as broken:
        return Point(name, False, broken.reason)


def _function_points(program: Program, dialect: Dialect) -> Iterator[Point]:
    """Return the points of a dialect of PlotJuggler 3."""
    unknown = [each for each in program.imports if not is_wasi(each)]
    known = f"{', '.join(program.imports)}: they do nothing" if program.imports else ""
    yield Point("imports nothing but WASI", not unknown, ", ".join(unknown) or known)
    exports = list(_export_points(program, dialect))
    yield from exports
    if unknown or not all(point.met for point in exports):
        return
    limits = Limits()

    def start() -> Session:
        return FunctionsSession(program, dialect, limits)

    begun = _probe("starts, and has memory for outputs", lambda: _nothing(start()))
    yield begun
    if not begun.met:
        return
    read = _read_as_released if dialect.name == "released" else _read_as_yaml
    yield _probe("has a manifest", lambda: read(manifest_text(Instance(program, limits, None))))
    yield _probe("takes an empty schema, or refuses it", lambda: _create(start()))
    yield _probe("refuses messages for no parser (self 0)", lambda: _parse_without_parser(start()))
    yield _probe("takes a policy for arrays for no parser", lambda: _policy(start()))
    yield _probe("takes or refuses messages of no sense", lambda: _parse_garbage(start()))


def _nothing(_: object) -> str:
    return ""


def _read_as_released(text: str) -> str:
    manifest = read_released_manifest(text)
    try:
        lost = unseen_by_released(text)
    except PluginError as error:
        lost = [f"it is no manifest of the page: {error}"]
    return "; ".join([f"encoding {manifest.encoding}", *lost])


def _read_as_yaml(text: str) -> str:
    return f"encoding {read_manifest(text).encoding}"


def _create(session: Session) -> str:
    try:
        handle = session.create(_REQUEST)
    except PluginError as error:
        return str(error)
    session.destroy(handle)
    return "takes it"


def _policy(session: Session) -> str:
    session.instance.call("pj_parser_set_array_policy", 0, 1, 500)
    return ""


def _results(session: Session, handle: int) -> list[int]:
    """Return what parsing returns for messages that mean nothing."""
    data = memoryview(b"".join(_MESSAGES))
    sizes = numpy.array([len(each) for each in _MESSAGES], "i8")
    count = session.load(Messages(data, numpy.cumsum(sizes) - sizes, sizes, None), 0)
    stop = session.run(handle, count)
    if stop is not Stop.DONE:
        raise BrokenContract(session.done, f"message {session.done}: {session.offence(stop, session.done)}")
    outputs = session.outputs(0, 0, count)
    for begin, size in zip(outputs.begins.tolist(), outputs.sizes.tolist(), strict=True):
        if size > 0:
            session.dialect.read_layout(bytes(outputs.memory[begin : begin + size]), False)
    results: list[int] = outputs.sizes.tolist()
    return results


def _parse_without_parser(session: Session) -> str:
    taken = [size for size in _results(session, 0) if size > 0]
    if taken:
        raise PluginError(f"{session.dialect.parse} with self 0 returned {taken[0]}")
    return ""


def _parse_garbage(session: Session) -> str:
    try:
        handle = session.create(_REQUEST)
    except PluginError:
        return "not tried, since it makes no parser without a schema"
    return f"refused {sum(size <= 0 for size in _results(session, handle))} of {len(_MESSAGES)}"


def _module_points(program: Program, dialect: Dialect) -> Iterator[Point]:
    """Return the points of modules of PlotJuggler 4."""
    yield Point("imports nothing", not program.imports, ", ".join(program.imports))
    exports = list(_export_points(program, dialect))
    yield from exports
    names = {function.name for function in dialect.functions}
    others = [
        name
        for name in (*program.functions, *program.other_exports)
        if name == "_start" or (name.startswith("pj_module_") and name not in names)
    ]
    yield Point("exports neither _start nor other names with pj_module_", not others, ", ".join(others))
    yield Point("has no start section", not has_start_section(program.data))
    maximum = program.memory_maximum
    remark = "it has none" if maximum is None else f"{maximum >> 20} MiB"
    yield Point(
        f"declares a maximum of its memory, of at most {MODULE_MEMORY >> 20} MiB",
        maximum is not None and maximum <= MODULE_MEMORY,
        remark,
    )
    try:
        manifest = read_module_manifest(program.data)
    except PluginError as error:
        yield Point("has a manifest", False, str(error))
        return
    yield Point("has a manifest", True, f"encodings {', '.join(manifest.encodings)}")
    if program.imports or not all(point.met for point in exports):
        return
    yield from _module_probes(program, dialect, manifest)


def _module_probes(program: Program, dialect: Dialect, manifest: ModuleManifest) -> Iterator[Point]:
    limits = Limits(MODULE_MEMORY, MODULE_INSTRUCTIONS)

    def start() -> ModuleSession:
        return ModuleSession(program, dialect, limits, manifest)

    begun = _probe("starts, and has version 1 of the ABI", lambda: _nothing(start()))
    yield begun
    if not begun.met:
        return
    yield _probe("makes a parser for each claim", lambda: _create_claims(start(), len(manifest.claims)))
    yield _probe(
        "makes none for a claim that it has not", lambda: _create_other(start(), len(manifest.claims))
    )
    yield _probe("takes, declines or refuses an empty schema", lambda: _create(start()))
    yield _probe("refuses messages for no parser (token 0)", lambda: _parse_without_token(start()))
    yield _probe("takes or refuses messages of no sense", lambda: _parse_garbage(start()))


def _parse_without_token(session: Session) -> str:
    address = session.allocate(INPUT_HEADER.size + 16, "a message")
    slots = (address + INPUT_HEADER.size, address + INPUT_HEADER.size + 8)
    write(session.instance.view(), address, INPUT_HEADER.pack(0, 0, 0))
    code = session.instance.call("pj_module_parse", 0, address, INPUT_HEADER.size, *slots)
    if code >= 0:
        raise PluginError(f"pj_module_parse returned {code}")
    return ""


def _create_claims(session: Session, count: int) -> str:
    for index in range(count):
        token = session.instance.call("pj_module_create", index)
        if not token:
            raise PluginError(f"pj_module_create({index}) returned 0")
        session.destroy(token)
    return ""


def _create_other(session: Session, index: int) -> str:
    if session.instance.call("pj_module_create", index):
        raise PluginError(f"pj_module_create({index}) did not return 0")
    return ""
