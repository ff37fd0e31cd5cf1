"""`rosidl generate -t proto`, with ROS's own program."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import Error
from tests.folders import write_package
from tests.programs import run

ROSIDL = Path(sys.executable).with_name("rosidl")


@pytest.mark.skipif(not ROSIDL.exists(), reason="needs rosidl_cli: pip install '.[ros]'")
def test_rosidl_generate(tmp_path: Path) -> None:
    write_package(
        tmp_path / "my_msgs", {"msg/Place.msg": "base_msgs/Point position\n", "srv/Go.srv": "---\n"}
    )
    write_package(tmp_path / "include" / "base_msgs", {"msg/Point.msg": "float64 x\n"})

    run(
        *(ROSIDL, "generate", "-t", "proto", "-o", "out", "-I", "include"),
        *("my_msgs", f"{tmp_path}/my_msgs:msg/Place.msg", "my_msgs/srv/Go.srv"),
        folder=tmp_path,
    )

    for path in ("my_msgs/msg/Place", "my_msgs/srv/Go", "base_msgs/msg/Point"):
        assert (tmp_path / f"out/proto/{path}.proto").is_file()
        assert (tmp_path / f"out/python/rosidl_proto/{path}_adapter.py").is_file()

    (tmp_path / "my_msgs/msg/Place.msg").write_text("Point position\n")
    error = run(
        ROSIDL,
        "generate",
        "-t",
        "proto",
        "-o",
        "out",
        "my_msgs",
        "my_msgs/msg/Place.msg",
        folder=tmp_path,
        code=1,
    )
    assert (
        "my_msgs/msg/Point was not found, but my_msgs/msg/Place.position (my_msgs/msg/Place.msg:1:7)" in error
    )


@pytest.mark.skipif(not ROSIDL.exists(), reason="needs rosidl_cli: pip install '.[ros]'")
def test_among_other_types(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`rosidl generate` runs one type after the other: those behind this one have to get their turn."""
    from rosidl_adapter_proto.hooks.rosidl_cli import GenerateProto

    interfaces = [f"{write_package(folder / 'my_msgs', {'msg/deep/A.msg': 'B b'})}:msg/deep/A.msg"]
    reason = "my_msgs/msg/B was not found, but my_msgs/msg/A.b"

    assert GenerateProto("proto").generate("my_msgs", interfaces, [], folder / "out/proto") == []
    warning = capsys.readouterr().err
    assert warning.startswith(f"Warning: no protobuf types can be made of my_msgs: {reason} ")

    with pytest.raises(Error, match=f"^{reason} "):
        GenerateProto("proto", strict=True).generate("my_msgs", interfaces, [], folder / "out/proto")
    with pytest.raises(Error, match=f"^{reason} "):
        GenerateProto("proto").generate("my_msgs", interfaces, [], folder / "out")

    command = ("-t", "proto[strict: true]", "-o", "proto", "my_msgs", *interfaces)
    assert reason in run(ROSIDL, "generate", *command, folder=folder, code=1)
    (folder / "my_msgs/msg/deep/A.msg").write_text("int8 b\n")
    run(ROSIDL, "generate", *command, folder=folder)
    assert (folder / "proto/proto/my_msgs/msg/A.proto").is_file()
