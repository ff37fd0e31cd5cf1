"""What the CMake files run, without CMake."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate.index import RESOURCE_FOLDER
from rosidl_adapter_proto.hooks.ament import main
from tests.folders import content, write_package

TRACK = "std_msgs/Header header\nuint32 id\n"


@pytest.fixture
def build(folder: Path) -> Path:
    """An arguments file as CMake writes it, for a package with one message and a dependency in a prefix."""
    write_package(folder / "src" / "track_msgs", {"msg/Track.msg": TRACK})
    write_package(folder / "ros/share/std_msgs", {"msg/Header.msg": "string frame_id\n"})
    file = folder / "arguments"
    arguments = [
        *("--package", "track_msgs", "--output", str(folder / "build")),
        *("--interface", f"{folder}/src/track_msgs:msg/Track.msg"),
        *("--dependency", str(folder / "ros/share/std_msgs")),
    ]
    file.write_text("\n".join(arguments) + "\n")
    return file


def run(command: str, arguments: Path) -> int:
    return main([command, f"@{arguments}"])


def test_generate(build: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("parse", "check"):
        assert run(command, build) == 0
        assert not (folder / "build").exists()

    assert run("generate", build) == 0

    assert capsys.readouterr() == ("", "")
    for part, package in (("package", "track_msgs/msg/Track"), ("dependencies", "std_msgs/msg/Header")):
        made = {path for path, data in content(folder / "build" / part).items() if data is not None}
        assert made == {
            ".rosidl-proto.json",
            "pyproject.toml",
            f"index/rosidl_proto/{package.partition('/')[0]}",
            f"proto/{package}.proto",
            *(f"python/rosidl_proto/{package}{end}" for end in ("_pb2.py", "_pb2.pyi", "_adapter.py")),
            *(f"python/rosidl_proto/{os.path.dirname(package)}/{end}" for end in ("__init__.py", "py.typed")),
        }
    depfile = (folder / "build/depfile").read_text()
    assert depfile.startswith(f"{folder}/build/stamp: ")
    assert f"{folder}/src/track_msgs/msg/Track.msg \\\n" in depfile
    assert f"{folder}/ros/share/std_msgs/msg/Header.msg \\\n" in depfile
    assert "templates/python/adapter.py.jinja" in depfile
    assert (folder / "build/stamp").is_file()


def test_installed_dependencies(build: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are not made again, unless they were made from other definitions, or in another way, or by this build."""
    run("generate", build)
    made = (folder / "build/dependencies/index/rosidl_proto/std_msgs").read_bytes()
    resource = folder / "other" / RESOURCE_FOLDER / "std_msgs"
    resource.parent.mkdir(parents=True)
    resource.write_bytes(made)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(folder / "other"))
    assert run("generate", build) == 0
    assert (folder / "build/dependencies/proto/std_msgs").is_dir(), "it goes on making what it made"

    build.write_text(build.read_text().replace(f"{folder}/build", f"{folder}/second"))
    assert run("generate", build) == 0
    assert (folder / "second/package/proto/track_msgs").is_dir()
    assert not (folder / "second/dependencies").exists()

    resource.write_bytes(made.replace(b'"hash"', b'"sequential"'))
    build.write_text(build.read_text().replace(f"{folder}/second", f"{folder}/third"))
    assert run("generate", build) == 0
    assert (folder / "third/dependencies/proto/std_msgs").is_dir()

    resource.write_bytes(made)
    (folder / "ros/share/std_msgs/msg/Header.msg").write_text("string frame_id\nuint32 seq\n")
    build.write_text(build.read_text().replace(f"{folder}/third", f"{folder}/fourth"))
    assert run("generate", build) == 0
    assert (folder / "fourth/dependencies/proto/std_msgs").is_dir()


def test_a_dependency_that_is_not_one_any_more(build: Path, folder: Path) -> None:
    run("generate", build)
    (folder / "src/track_msgs/msg/Track.msg").write_text("uint32 id\n")

    assert run("generate", build) == 0

    made = content(folder / "build/dependencies")
    assert not [path for path in made if "std_msgs" in path]


def test_a_damaged_resource(
    build: Path, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    resource = folder / "other" / RESOURCE_FOLDER / "std_msgs"
    resource.parent.mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(folder / "other"))
    for text, reason in (
        ("{", "Expecting property name enclosed in double quotes: line 1 column 2 (char 1)"),
        ("{}", "GeneratedPackage.__init__() missing 5 required positional arguments: "),
        ("[]", "rosidl_adapter_proto.generate.index.GeneratedPackage() argument after ** must be a mapping"),
    ):
        resource.write_text(text)
        assert run("generate", build) == 1
        error = capsys.readouterr().err
        assert error.startswith(
            f"{resource} is not a resource that this version of rosidl-proto reads ({reason}"
        )
        assert error.endswith("); install its package again, or remove the file\n")


@pytest.mark.parametrize(
    ("command", "text", "error"),
    [
        (
            "parse",
            "uint32 id\nuint32 3d\n",
            "{file}:2:8: '3d' is not a valid field name; use lower case letters, digits and single underscores, "
            "beginning with a letter\n  uint32 3d\n         ^\n",
        ),
        ("parse", "no_msgs/Such x\n", ""),
        (
            "check",
            "no_msgs/Such x\n",
            "no_msgs/msg/Such was not found, but track_msgs/msg/Track.x ({file}:1:14) needs it; "
            "did you mean nav_msgs or sensor_msgs or tf2_msgs?\n"
            "looked in package track_msgs, {folder}/ros/share/std_msgs, embedded store lyrical\n",
        ),
    ],
)
def test_what_is_wrong(
    command: str, text: str, error: str, build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder / "src/track_msgs/msg/Track.msg"
    file.write_text(text)

    code = run(command, build)

    printed = capsys.readouterr()
    assert (code, printed.out) == (1 if error else 0, "")
    assert printed.err == error.format(file=file, folder=folder)


def test_a_definition_in_another_folder(
    build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build.write_text(build.read_text().replace("msg/Track.msg", "types/Track.msg"))

    assert run("parse", build) == 1
    assert capsys.readouterr().err == (
        f"{folder}/src/track_msgs/types/Track.msg is not in a folder msg, srv or action, which says what it defines; "
        "move it to one\n"
    )
