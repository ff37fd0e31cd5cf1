"""Reading and writing the manifest of an output folder."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.manifest import (
    MANIFEST_NAME,
    Manifest,
    SequentialNumbers,
    digest,
    is_intact,
    read_manifest,
)
from rosidl_adapter_proto.interfaces.model import TypeName

MANIFEST = Manifest(
    "f00d", (TypeName("my_msgs", "msg", "A"), TypeName("my_msgs", "srv", "B")), {"proto/a": digest(b"a")}
)
CONTENT: dict[str, Any] = {
    "version": 2,
    "fingerprint": "f00d",
    "interfaces": ["my_msgs/msg/A", "my_msgs/srv/B"],
    "outputs": {"proto/a": digest(b"a")},
    "numbers": None,
}


def test_it_is_written_and_read(tmp_path: Path) -> None:
    (tmp_path / MANIFEST_NAME).write_bytes(MANIFEST.to_json())

    assert json.loads(MANIFEST.to_json()) == CONTENT
    assert MANIFEST.to_json().endswith(b"\n}\n")
    assert read_manifest(tmp_path) == MANIFEST


def test_sequential_numbers(tmp_path: Path) -> None:
    numbers = SequentialNumbers("../rosidl-proto.lock", {"my_msgs/msg/A": {"a": 1, "gone": 2}})
    manifest = replace(MANIFEST, numbers=numbers)
    (tmp_path / MANIFEST_NAME).write_bytes(manifest.to_json())

    assert json.loads(manifest.to_json())["numbers"] == {
        "lock_file": "../rosidl-proto.lock",
        "fields": {"my_msgs/msg/A": {"a": 1, "gone": 2}},
    }
    assert read_manifest(tmp_path) == manifest


def test_there_is_none(tmp_path: Path) -> None:
    (tmp_path / "file").touch()

    assert read_manifest(tmp_path) is None
    assert read_manifest(tmp_path / "nowhere") is None
    assert read_manifest(tmp_path / "file") is None


@pytest.mark.parametrize(
    ("damaged", "reason"),
    [
        (b"", "Expecting value: line 1 column 1 (char 0)"),
        (b"\xff", "'utf-8' codec can't decode byte 0xff in position 0: invalid start byte"),
        (b'{"version": 1', "Expecting ',' delimiter: line 1 column 14 (char 13)"),
        (b"[]", "list indices must be integers or slices, not str"),
        (b"{}", "'version'"),
        ({"version": 1}, "it has version 1, not 2"),
        ({"numbers": 3}, "'int' object is not subscriptable"),
        (
            {"numbers": {"lock_file": "l", "fields": {"m": {"a": "x"}}}},
            "invalid literal for int() with base 10: 'x'",
        ),
        ({"outputs": 3}, "'int' object is not iterable"),
        ({"outputs": {"/etc/passwd": ""}}, "it names '/etc/passwd', which is not inside the folder"),
        ({"outputs": {"../a": ""}}, "it names '../a', which is not inside the folder"),
        ({"outputs": {"proto/../../a": ""}}, "it names 'proto/../../a', which is not inside the folder"),
        ({"outputs": {"": ""}}, "it names '', which is not inside the folder"),
        ({"interfaces": [1]}, "'int' object has no attribute 'split'"),
        ({"interfaces": ["A"]}, "'A' is not of the form package/namespace/Name"),
    ],
)
def test_damaged(damaged: bytes | dict[str, Any], reason: str, tmp_path: Path) -> None:
    file = tmp_path / MANIFEST_NAME
    file.write_bytes(damaged if isinstance(damaged, bytes) else json.dumps(CONTENT | damaged).encode())

    with pytest.raises(GenerateError) as error:
        read_manifest(tmp_path)

    assert str(error.value) == (
        f"{file} is not a manifest that this version of rosidl-proto reads ({reason}); "
        f"remove {tmp_path} and generate it again"
    )


def test_unreadable(tmp_path: Path) -> None:
    (tmp_path / MANIFEST_NAME).mkdir()

    with pytest.raises(GenerateError, match=r"^cannot read .*/\.rosidl-proto\.json: Is a directory$"):
        read_manifest(tmp_path)


def test_is_intact(tmp_path: Path) -> None:
    file = tmp_path / "proto" / "a"
    assert not is_intact(tmp_path, MANIFEST)

    file.parent.mkdir()
    file.write_bytes(b"a")
    (tmp_path / "something else").touch()
    assert is_intact(tmp_path, MANIFEST)

    file.write_bytes(b"b")
    assert not is_intact(tmp_path, MANIFEST)
