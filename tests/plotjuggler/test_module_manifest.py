"""Manifests of parser modules of PlotJuggler 4: JSON in a custom section."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import Error, PluginError
from rosidl_adapter_proto.plotjuggler.module_manifest import (
    Claim,
    ModuleManifest,
    has_start_section,
    parse_module_manifest,
    read_module_manifest,
)
from tests.plotjuggler import wat

SECTION = "pj_parser_module_manifest"
CLAIM = {
    "claim_id": "imu",
    "encoding": "ros2msg",
    "type_name": "sensor_msgs/Imu",
    "routes": ["scalar"],
    "priority": 5,
}
GOOD: dict[str, Any] = {
    "module_abi": 1,
    "id": "org.example",
    "name": "Example",
    "version": "1.2.3-rc.1+build.7",
    "claims": [
        {**CLAIM, "claim_id": "any", "type_name": "*", "priority": 9},
        {**CLAIM, "claim_id": "low", "priority": -1000},
        CLAIM,
        {
            **CLAIM,
            "claim_id": "proto",
            "encoding": "protobuf",
            "type_name": ".a.B",
            "routes": ["scalar", "object"],
        }
        | {"object_type": "kPointCloud", "schema_digests": ["sha256:" + "0aF9" * 16]},
        {**CLAIM, "claim_id": "json", "encoding": "json", "routes": ["object"], "object_type": "kImage"},
    ],
}


def text(change: Callable[[Any], Any] = lambda document: None) -> bytes:
    document = copy.deepcopy(GOOD)
    change(document)
    return json.dumps(document).encode()


def claim(**members: Any) -> bytes:
    return text(lambda document: document["claims"][2].update(members))


def test_a_manifest() -> None:
    manifest = parse_module_manifest(text())
    assert manifest == ModuleManifest("org.example", "Example", "1.2.3-rc.1+build.7", manifest.claims)
    assert manifest.claims[2] == Claim("imu", "ros2msg", "sensor_msgs/msg/Imu", ("scalar",), 5)
    assert manifest.claims[3].type_name == "a.B"
    assert manifest.encodings == ("ros2msg", "protobuf")
    assert [each.claim_id for _, each in manifest.claims_of("sensor_msgs/msg/Imu")] == ["imu", "low", "any"]
    assert [index for index, _ in manifest.claims_of("a.B")] == [3, 0]
    assert parse_module_manifest(text(lambda document: document.update(claims=[]))).claims == ()


LACKS = {
    member: text(lambda document, member=member: document.pop(member))  # type: ignore[misc]
    for member in ("module_abi", "id", "name", "version", "claims")
}
CLAIM_LACKS = {
    f"claims[2].{member}": text(lambda document, member=member: document["claims"][2].pop(member))  # type: ignore[misc]
    for member in CLAIM
}
WRONG = {
    **{data: f"{member}: is missing" for member, data in (LACKS | CLAIM_LACKS).items()},
    b"\xff": "byte 0 is not UTF-8",
    b"{\n]": "line 2: not valid JSON: Expecting property name enclosed in double quotes",
    b"[]": "the document: not an object",
    b"[" * 100_000: "nested too deep, or a number is too long",
    b'{"a": %s}' % (b"1" * 10_000): "nested too deep, or a number is too long",
    b'{"a": NaN}': "line 1: not valid JSON: there is no NaN",
    b" " * (1 << 20) + b"{}": "1048578 bytes; at most 1048576 are read",
    text(lambda document: document.update(module_abi=2)): "module_abi: 2 instead of 1",
    text(lambda document: document.update(module_abi=True)): "module_abi: not an integer",
    text(lambda document: document.update(name="")): "name: is empty",
    text(lambda document: document.update(id=1)): "id: not a text",
    text(
        lambda document: document.update(version="1.0")
    ): "version: '1.0' is no semantic version, such as 1.0.0",
    text(
        lambda document: document.update(version="01.0.0")
    ): "version: '01.0.0' is no semantic version, such as"
    " 1.0.0",
    text(lambda document: document.update(provenance="x")): "provenance: is for the host to say",
    text(lambda document: document.update(claims={})): "claims: not a list",
    text(lambda document: document["claims"].append(1)): "claims[5].: not an object",
    claim(claim_id="any"): "claims[2].claim_id: a second 'any'",
    claim(
        encoding="cdr"
    ): "claims[2].encoding: 'cdr' is none of bson, cbor, data_tamer, json, msgpack, omgidl,"
    " protobuf, ros1, ros1msg, ros2, ros2msg",
    claim(type_name="Imu"): "claims[2].type_name: 'Imu' is neither package/Type nor package/msg/Type",
    claim(type_name="a/srv/B"): "claims[2].type_name: 'a/srv/B' is neither package/Type nor package/msg/Type",
    claim(
        encoding="protobuf", type_name="a..B"
    ): "claims[2].type_name: 'a..B' is no full name of a protobuf message",
    claim(routes=[]): "claims[2].routes: is empty",
    claim(routes=["both"]): "claims[2].routes: 'both' is neither scalar nor object",
    claim(routes=[["scalar"]]): "claims[2].routes: ['scalar'] is neither scalar nor object",
    claim(
        routes=["object"], object_type="kImage", type_name="*"
    ): "claims[2].type_name: * is for the route scalar"
    " alone",
    claim(routes=["object"]): "claims[2].object_type: is missing",
    claim(object_type="kImage"): "claims[2].object_type: is for the route object alone",
    claim(priority=1001): "claims[2].priority: 1001 is not within -1000 and 1000",
    claim(priority=1.0): "claims[2].priority: not an integer",
    claim(
        schema_digests=["sha256:0"]
    ): "claims[2].schema_digests: 'sha256:0' is not sha256: and 64 hexadecimal digits",
    claim(provenance="x"): "claims[2].provenance: is for the host to say",
}


@pytest.mark.parametrize("data", WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_is_told(data: bytes) -> None:
    with pytest.raises(PluginError) as caught:
        parse_module_manifest(data)
    assert str(caught.value) == f"{SECTION}: {WRONG[data]}".replace("[5].:", "[5]:")


def test_the_section_of_the_file() -> None:
    data = wat.module(manifests=(text(),))
    assert read_module_manifest(data) == parse_module_manifest(text())
    assert not has_start_section(data)
    assert has_start_section(wat.wasm("(module (func $f) (start $f))"))
    other = wat.wasm("(module)") + wat.section("other", text())
    for file, count in ((other, 0), (data + wat.section(SECTION, text()), 2)):
        with pytest.raises(PluginError) as caught:
            read_module_manifest(file)
        assert str(caught.value) == f"{SECTION}: there are {count} such custom sections instead of one"
    with pytest.raises(PluginError, match="a section has"):
        read_module_manifest(data[:-1])
    with pytest.raises(PluginError, match="byte 9: a number does not end"):
        read_module_manifest(b"\0asm\1\0\0\0\0\xff\xff\xff\xff\xff\xff")


@given(st.data())
def test_damaged_manifests_give_our_errors_alone(data: st.DataObject) -> None:
    good = wat.module(manifests=(text(),))
    begin = data.draw(st.integers(8, len(good)))
    damaged = good[:begin] + data.draw(st.binary(max_size=4)) + good[begin + data.draw(st.integers(0, 8)) :]
    try:
        read_module_manifest(damaged)
    except Error:
        return
