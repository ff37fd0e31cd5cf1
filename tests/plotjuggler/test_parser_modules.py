"""Our plugins as parser modules of PlotJuggler 4, called as its SDK describes it."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from tests.plotjuggler.released_host import ReleasedHost, ReleasedParser
from tests.plotjuggler.topics import topics

GOOD, DECLINED, FAILED, NO_INSTANCE, MALFORMED, NO_CLAIM = 0, 1, -1, -2, -3, -4
SCALAR, OBJECT = 1, 2
ERROR_SIZE = 512


class ModuleHost(ReleasedHost):
    """The same engine, with the other functions."""

    def block(self, content: bytes) -> tuple[int, int]:
        address = self.call("pj_module_alloc", len(content))
        assert address > 0
        self.memory.write(self.store, content, address)
        return address, len(content)

    def bind(self, instance: int, content: bytes) -> int:
        address, size = self.block(content)
        answer = self.call("pj_module_bind", instance, address, size)
        self.call("pj_module_free", address, size)
        return answer

    def parse(self, instance: int, content: bytes) -> int | bytes:
        address, size = self.block(content)
        slots, _ = self.block(bytes(16))
        answer = self.call("pj_module_parse", instance, address, size, slots, slots + 8)
        place, length = struct.unpack("<QQ", self.memory.read(self.store, slots, slots + 16))
        self.call("pj_module_free", slots, 16)
        self.call("pj_module_free", address, size)
        return answer if answer else bytes(self.memory.read(self.store, place, place + length))

    def last_error(self, instance: int) -> str:
        address, size = self.block(bytes(ERROR_SIZE))
        length = self.call("pj_module_last_error", instance, address, size)
        return bytes(self.memory.read(self.store, address, address + length)).decode()


def binding(*texts: bytes, version: int = 1, route: int = SCALAR, claim: int = 0, missing: int = 0) -> bytes:
    texts = (*texts, *(b"" for _ in range(6 - len(texts))))
    header = struct.pack("<HHIHHI", version, route, claim, 0, 0, len(texts) - missing)
    content, place = b"", len(header) + 8 * len(texts)
    for text in texts:
        header += struct.pack("<II", place + len(content), len(text))
        content += text
    return header + content


def message(content: bytes, flags: int = 1, size: int | None = None) -> bytes:
    return struct.pack("<B7xqQ", flags, 5, len(content) if size is None else size) + content


def read_scalars(output: bytes) -> list[tuple[str, float | str]]:
    version, route, _, has_time, _, count = struct.unpack_from("<HBBB7xqI", output)
    assert (version, route, has_time) == (1, SCALAR, 0)
    place, pairs = 24, []
    for _ in range(count):
        name_place, name_size, kind = struct.unpack_from("<IIB", output, place)
        place += 9
        name = output[name_place : name_place + name_size].decode()
        value: float | str
        if kind == 4:
            (size,) = struct.unpack_from("<I", output, place)
            place += 4 + size
            value = output[place - size : place].decode()
        else:
            layout = struct.Struct("<" + "dqQ?"[kind])
            value = float(layout.unpack_from(output, place)[0])
            place += layout.size
        pairs.append((name, value))
    return pairs


@pytest.fixture
def host(plugin: Path) -> ModuleHost:
    return ModuleHost(plugin)


def bound(host: ModuleHost, encoding: str, index: int = 0) -> int:
    topic = topics(encoding)[index]
    instance = host.call("pj_module_create", 0)
    assert host.bind(instance, binding(encoding.encode(), topic.type_name.encode(), topic.schema)) == GOOD
    return instance


def test_the_version(host: ModuleHost, encoding: str) -> None:
    assert host.call("pj_module_abi") == 1


def test_the_same_series_as_in_the_released_program(host: ModuleHost, encoding: str) -> None:
    for index, topic in enumerate(topics(encoding)):
        instance = bound(host, encoding, index)
        parser = ReleasedParser(host, topic.type_name.encode(), topic.schema)
        for content in topic.messages:
            output = host.parse(instance, message(content))
            assert isinstance(output, bytes)
            expected = parser.parse(content)
            assert expected is not None
            found = [(f"/{name}", value) for name, value in read_scalars(output)]
            assert [repr(pair) for pair in found] == [repr((key, value)) for key, _, value in expected]
        host.call("pj_module_destroy", instance)
        assert host.parse(instance, message(b"")) == NO_INSTANCE


def test_an_output_stays_until_the_next_call_on_its_instance(host: ModuleHost, encoding: str) -> None:
    first, second = bound(host, encoding, 0), bound(host, encoding, 0)
    content = message(topics(encoding)[0].messages[0])
    address, size = host.block(content)
    slots, _ = host.block(bytes(16))
    places = []
    for instance in (first, second):
        assert host.call("pj_module_parse", instance, address, size, slots, slots + 8) == GOOD
        places.append(struct.unpack("<QQ", host.memory.read(host.store, slots, slots + 16))[0])
    assert places[0] != places[1]


@pytest.mark.parametrize(
    ("changes", "answer", "text"),
    [
        ({"version": 2}, MALFORMED, "the binding is not one of version 1"),
        ({"missing": 1}, MALFORMED, "the binding is not one of version 1"),
        ({"claim": 1}, NO_CLAIM, "the module has one claim"),
        ({"route": OBJECT}, DECLINED, "the module has scalars of one encoding only"),
    ],
)
def test_bindings_that_are_not_taken(
    host: ModuleHost, encoding: str, changes: dict[str, int], answer: int, text: str
) -> None:
    topic = topics(encoding)[0]
    instance = host.call("pj_module_create", 0)
    texts = (encoding.encode(), topic.type_name.encode(), topic.schema)
    assert host.bind(instance, binding(*texts, **changes)) == answer
    assert host.last_error(instance) == text
    assert host.parse(instance, message(b"")) == FAILED
    assert host.last_error(instance) == "the instance is not bound"


def test_damaged_bindings(host: ModuleHost, encoding: str) -> None:
    topic = topics(encoding)[0]
    instance = host.call("pj_module_create", 0)
    whole = binding(encoding.encode(), topic.type_name.encode(), topic.schema)
    for size in range(len(whole)):
        assert host.bind(instance, whole[:size]) == MALFORMED
    assert host.bind(instance, binding(b"json", b"a/T", b"")) == DECLINED
    assert host.bind(instance, binding(encoding.encode(), b"nothing", b"")) == FAILED
    for address, size in [(0, 64), (1 << 40, 64), (16, 1 << 40), (-1, 64)]:
        assert host.call("pj_module_bind", instance, address, size) == MALFORMED
    assert host.bind(instance, whole) == GOOD


def test_messages_that_are_not_taken(host: ModuleHost, encoding: str) -> None:
    instance = bound(host, encoding)
    content = topics(encoding)[0].messages[0]
    assert host.parse(instance, message(content, flags=2)) == MALFORMED
    assert host.last_error(instance) == "the message has unknown flags"
    assert host.parse(instance, message(content, size=len(content) + 1)) == MALFORMED
    assert host.parse(instance, message(content)[:23]) == MALFORMED
    assert host.parse(instance, message(content[:-1])) == FAILED
    assert "cut off" in host.last_error(instance)
    assert isinstance(host.parse(instance, message(content, flags=0)), bytes)


def test_what_is_no_instance(host: ModuleHost, encoding: str) -> None:
    assert host.call("pj_module_create", 1) == 0
    assert host.last_error(0) == "the module has one claim"
    for instance in (0, 1, -1, 1 << 40):
        assert host.bind(instance, binding(b"")) == NO_INSTANCE
        assert host.parse(instance, message(b"")) == NO_INSTANCE
        host.call("pj_module_destroy", instance)
    assert host.last_error(0) == "there is no such instance"
    assert host.call("pj_module_alloc", 1 << 40) == 0
    assert host.call("pj_module_last_error", 0, 1 << 40, ERROR_SIZE) == 0
