"""Running protoc."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorProto

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate import protoc
from rosidl_adapter_proto.generate.protoc import compile_protos

TIME = 'syntax = "proto3"; package a.pb; message Time { sfixed32 sec = 1; }'
USER = 'syntax = "proto3"; import "a/Time.proto"; package b.pb; message User { .a.pb.Time some_time = 1; }'


def test_only_wanted_files_are_returned() -> None:
    descriptors = compile_protos({"a/Time.proto": TIME, "b/User.proto": USER}, ["b/User.proto"])

    assert list(descriptors) == ["b/User.proto"]
    file = FileDescriptorProto.FromString(descriptors["b/User.proto"])
    assert (file.name, file.package, list(file.dependency)) == ("b/User.proto", "b.pb", ["a/Time.proto"])
    assert file.message_type[0].field[0].type_name == ".a.pb.Time"
    assert not file.message_type[0].field[0].HasField("json_name")
    assert not file.HasField("source_code_info")


def test_nothing_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protoc, "_PROTOC", ["/not/there"])

    assert compile_protos({"a/Time.proto": TIME}, []) == {}


def test_what_protoc_brings_along_can_be_imported() -> None:
    text = 'syntax = "proto3"; import "google/protobuf/timestamp.proto"; package a.pb;'

    assert list(compile_protos({"a/Stamp.proto": text}, ["a/Stamp.proto"])) == ["a/Stamp.proto"]


@pytest.mark.parametrize(
    ("protos", "said"),
    [
        (
            {"a/Time.proto": TIME.replace("= 1", "= 0")},
            r"^a/Time.proto:1:\d+: Field numbers must be positive integers.",
        ),
        (
            {"a/Time.proto": TIME.replace("sfixed32 sec", "ä")},
            r"^a/Time.proto:1:\d+: ",
        ),
        (
            {"a/Time.proto": USER},
            r"^a/Time.proto:.*itself",
        ),
        ({"a/Time.proto": 'syntax = "proto3"; import "c.proto";'}, r"^c.proto: File not found"),
    ],
)
def test_a_file_that_protoc_refuses(protos: dict[str, str], said: str) -> None:
    with pytest.raises(GenerateError, match=r"^protoc failed with exit code 1:\n") as error:
        compile_protos(protos, list(protos))

    assert re.search(said, str(error.value), re.MULTILINE)
    assert tempfile.gettempdir() not in str(error.value)


def test_protoc_cannot_be_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protoc, "_PROTOC", ["/not/there"])

    with pytest.raises(GenerateError) as error:
        compile_protos({"a/Time.proto": TIME}, ["a/Time.proto"])

    assert str(error.value) == "cannot run protoc: [Errno 2] No such file or directory: '/not/there'"


def test_modules_in_the_current_folder_do_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`google` and `grpc_tools` may well be folders of a user's project."""
    for name in ("grpc_tools", "google", "types", "signal"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the wrong module')")
    monkeypatch.chdir(tmp_path)

    assert compile_protos({"a/Time.proto": TIME}, ["a/Time.proto"])
