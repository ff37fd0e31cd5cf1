"""`rosidl-proto generate --from-bag`."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from rosidl_adapter_proto.bags.types import ros_definition
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME
from rosidl_adapter_proto.schema.registry import TypeRegistry
from tests.cli.conftest import Run
from tests.folders import content, write_package

RULE = "=" * 80
TRACK = "# Where something went.\nstd_msgs/Header header  # when\nPoint[<=9] points\n"
POINT = "# A place [m].\nfloat64 x\nfloat64 y\n"
SHAPES = {"msg/Track.msg": TRACK, "msg/Point.msg": POINT, "msg/Unused.msg": "bool a\n"}
RECORDED = f"{TRACK}\n{RULE}\nMSG: my_msgs/Point\n{POINT}"


def record(path: Path, *topics: tuple[str, str, str], messages: int = 1, encoding: str = "ros2msg") -> Path:
    """Write a recording of topics with their types and the text of these."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(encoding.removesuffix("msg"))
        for name, type_name, text in topics:
            schema = writer.register_schema(type_name, encoding if text else "", text.encode())
            channel = writer.register_channel(name, "cdr" if encoding == "ros2msg" else "ros1", schema)
            for time in range(messages):
                writer.add_message(channel, time, b"\0\1\0\0", time)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def generated(folder: Path) -> dict[str, bytes | None]:
    return {path: each for path, each in content(folder).items() if path != MANIFEST_NAME}


def test_the_same_as_from_the_folder(folder: Path, run: Run) -> None:
    write_package(folder / "src" / "my_msgs", SHAPES)
    record(folder / "a.mcap", ("/track", "my_msgs/msg/Track", RECORDED))

    ended = run("generate", "--from-bag", "a.mcap", "--output", "recorded", "--distro", "jazzy")
    assert (ended.code, ended.out.endswith("0 removed, 0 unchanged\n")) == (0, True)
    again = run("generate", "--from-bag", "a.mcap", "--output", "recorded", "--distro", "jazzy")
    assert "files: 0 written, 0 removed, " in again.out

    names = ("my_msgs/msg/Track", "my_msgs/msg/Point")
    run("generate", *names, "--include", "src", "--output", "installed", "--distro", "jazzy")
    assert generated(folder / "recorded") == generated(folder / "installed")


def test_every_type_of_ros_is_the_installed_one(
    folder: Path, run: Run, ros_prefix: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(ros_prefix))
    registry = TypeRegistry(events=True)  # apart from generated code of other tests
    names = [each for each in registry if each.startswith(("sensor_msgs/msg/", "std_srvs/srv/"))]
    assert len(names) > 25
    texts = {each: ros_definition(registry[each]).data.decode() for each in names}
    types = {each: f"{each}_Event" if "/srv/" in each else each for each in names}
    record(folder / "a.mcap", *((f"/{each}", types[each], text) for each, text in texts.items()))
    needed = {str(each) for name in names for each in registry.definitions(name)}

    assert run("generate", *needed, "--output", "installed").code == 0
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    monkeypatch.setattr(sys, "prefix", str(folder))
    ended = run("generate", "--from-bag", "a.mcap", "--output", "recorded")

    assert ended.code == 0
    assert generated(folder / "recorded").items() >= generated(folder / "installed").items()


def test_ros1(folder: Path, run: Run) -> None:
    text = (
        f"Header header\nlower_msgs/thing Thing\nstring None=it's # all\n{RULE}\nMSG: std_msgs/Header\nuint32 seq\n"
        f"time stamp\nstring frame_id\n{RULE}\nMSG: lower_msgs/thing\nbyte camelCase\n"
    )
    record(folder / "a.mcap", ("/track", "My_Pkg/Track", text), encoding="ros1msg")
    assert run("generate", "--from-bag", "a.mcap").code == 0
    proto = folder / "generated/proto"
    assert 'None = "it\'s # all"' in (proto / "My_Pkg/msg/Track.proto").read_text()
    assert "int32 camelCase" in (proto / "lower_msgs/msg/thing.proto").read_text()
    assert "fixed32 seq" in (proto / "std_msgs/msg/Header.proto").read_text()


def test_what_is_asked_for_with_the_definitions_of_a_recording(folder: Path, run: Run) -> None:
    write_package(folder / "src" / "my_msgs", {**SHAPES, "msg/Point.msg": "int8 x\n"})
    record(folder / "a.mcap", ("/track", "my_msgs/msg/Track", RECORDED))

    ended = run("generate", "my_msgs", "--from-bag", "a.mcap", "--include", "src", "--no-deps")

    assert ended.code == 0
    assert ended.err.startswith(
        "Warning: my_msgs/msg/Track: the recording neither defines all of it nor says which"
    )
    assert ended.err.endswith(
        "Warning: my_msgs/msg/Point is defined differently by definition of topic /track: MSG my_msgs/msg/Point and "
        "src/my_msgs/msg/Point.msg; the first is used, since the recording comes before src\n"
    )
    assert sorted(each.stem for each in (folder / "generated").rglob("*.proto")) == [
        "Point",
        "Track",
        "Unused",
    ]


def test_without_dependencies(folder: Path, run: Run) -> None:
    record(folder / "a.mcap", ("/track", "my_msgs/msg/Track", RECORDED))
    ended = run("generate", "--from-bag", "a.mcap", "--no-deps")
    assert ended.code == 0
    assert [each.stem for each in (folder / "generated").rglob("*.proto")] == ["Track"]


def test_a_configuration_names_no_types_of_a_recording(folder: Path, run: Run) -> None:
    (folder / "pyproject.toml").write_text('[tool.rosidl-proto]\npackages = ["nowhere_msgs"]\n')
    record(folder / "a.mcap", ("/point", "my_msgs/msg/Point", POINT))
    ended = run("generate", "--from-bag", "a.mcap")
    assert ended.out == "generated: 1 interface, files: 8 written, 0 removed, 0 unchanged\n"


def test_several_recordings(folder: Path, run: Run) -> None:
    record(folder / "a.mcap", ("/point", "my_msgs/msg/Point", POINT))
    record(
        folder / "b.mcap", ("/place", "my_msgs/msg/Point", POINT), ("/other", "my_msgs/msg/Other", "bool a\n")
    )
    record(folder / "c.mcap", ("/old", "my_msgs/msg/Point", "float32 x\n"))

    both = run("generate", "--from-bag", "a.mcap", "--from-bag", "b.mcap", "-v")
    assert both.out.startswith(
        "my_msgs/msg/Point from definition of topic /point: MSG my_msgs/msg/Point\n"
        "my_msgs/msg/Other from definition of topic /other: MSG my_msgs/msg/Other\n"
    )
    differ = run("generate", "--from-bag", "a.mcap", "--from-bag", "c.mcap")
    assert (differ.code, differ.err) == (
        3,
        "Error: my_msgs/msg/Point is not the same in topics /point and /old: code can only have one version\n",
    )


def test_topics_without_messages_need_no_definition(folder: Path, run: Run) -> None:
    record(
        folder / "a.mcap",
        ("/point", "my_msgs/msg/Point", POINT),
        ("/lost", "qualia/msg/A", ""),
        messages=0,
    )
    assert run("generate", "--from-bag", "a.mcap").code == 0
    record(folder / "b.mcap", ("/lost", "qualia/msg/A", ""))
    ended = run("generate", "--from-bag", "b.mcap", "--distro", "jazzy")
    assert (ended.code, ended.err) == (
        3,
        "Error: topic /lost (qualia/msg/A): package 'qualia' was not found; looked in the recording, embedded store "
        "jazzy (messages only); give the folder of its package with --include FOLDER, or the distribution it is from "
        "with --distro\n",
    )


def test_a_recording_without_ros_types(folder: Path, run: Run) -> None:
    record(folder / "a.mcap")
    ended = run("generate", "--from-bag", "a.mcap")
    assert (ended.code, ended.err) == (2, "Error: a.mcap: no topic has messages of a ROS type\n")
    missing = run("generate", "--from-bag", "b.mcap")
    assert (missing.code, missing.err) == (3, "Error: b.mcap: no such file or folder\n")
