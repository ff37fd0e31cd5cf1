"""The files of our plugins: what is in them, as the programs that load them check it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import rosidl_adapter_proto
from rosidl_adapter_proto.plotjuggler.manifest import (
    read_manifest,
    read_released_manifest,
    unseen_by_released,
)
from rosidl_adapter_proto.plotjuggler.module_manifest import read_module_manifest
from tests.plotjuggler.released_host import ReleasedHost
from tests.plotjuggler.topics import ENCODINGS
from tests.plotjuggler.wasm_sections import FUNCTION, I32, I64, MEMORY, Module, read_module

START_SECTION = 8
MEBIBYTE = 1 << 20


def signature(parameters: list[int], *results: int) -> tuple[bytes, bytes]:
    return bytes(parameters), bytes(results)


PAGE = {
    "pj_plugin_manifest": signature([], I32),
    "pj_parser_create": signature([I32] * 3, I32),
    "pj_parser_set_array_policy": signature([I32] * 3),
    "pj_parser_parse": signature([I32] * 4, I32),
}
RELEASED = {
    "pj_parser_decode": signature([I32] * 4, I32),
    "pj_parser_destroy": signature([I32]),
    "malloc": signature([I32], I32),
    "free": signature([I32]),
}
MODULE = {
    "pj_module_abi": signature([], I32),
    "pj_module_create": signature([I32], I64),
    "pj_module_destroy": signature([I64]),
    "pj_module_bind": signature([I64] * 3, I32),
    "pj_module_parse": signature([I64] * 5, I32),
    "pj_module_last_error": signature([I64] * 3, I64),
    "pj_module_alloc": signature([I64], I64),
    "pj_module_free": signature([I64] * 2),
    "_initialize": signature([]),
}


@pytest.fixture(params=ENCODINGS)
def encoding(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def module(plugin: Path) -> Module:
    return read_module(plugin.read_bytes())


def test_a_plugin_imports_nothing(module: Module) -> None:
    assert module.imports == 0


def test_a_plugin_exports_the_functions_of_all_dialects_and_no_others(module: Module) -> None:
    functions = {name for name, (kind, _) in module.exports.items() if kind == FUNCTION}
    expected = {**PAGE, **RELEASED, **MODULE}
    assert functions == set(expected)
    assert {name: module.signature(name) for name in functions} == expected
    assert module.exports["memory"][0] == MEMORY
    assert len(module.exports) == len(functions) + 1


def test_a_plugin_does_nothing_when_it_is_loaded(module: Module) -> None:
    assert START_SECTION not in module.sections


def test_the_memory_has_a_maximum(module: Module) -> None:
    ((minimum, maximum),) = module.memories
    assert minimum * 65536 < MEBIBYTE
    assert maximum is not None and maximum * 65536 == 256 * MEBIBYTE


def test_plugins_are_small(plugin: Path) -> None:
    assert plugin.stat().st_size < 300_000


def test_the_manifest(plugin: Path, encoding: str) -> None:
    host = ReleasedHost(plugin)
    text = host.text(host.call("pj_plugin_manifest"))
    manifest = read_manifest(text)
    assert manifest == read_released_manifest(text)
    assert unseen_by_released(text) == []
    assert host.manifest["plugin_type"] == "MessageParser"
    assert host.manifest["encoding"] == encoding
    assert host.manifest["version"] == rosidl_adapter_proto.__version__


def test_the_manifest_of_the_module(plugin: Path, module: Module, encoding: str) -> None:
    ((name, content),) = module.custom
    assert name == "pj_parser_module_manifest"
    claim = {"claim_id": "all", "encoding": encoding, "type_name": "*", "routes": ["scalar"], "priority": 0}
    assert json.loads(content) == {
        "module_abi": 1,
        "id": f"rosidl_adapter_proto.{encoding}",
        "name": f"rosidl_adapter_proto {encoding}",
        "version": rosidl_adapter_proto.__version__,
        "claims": [claim],
    }
    assert read_module_manifest(plugin.read_bytes()).encodings == (encoding,)
