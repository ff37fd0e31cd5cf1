"""What the CMake files run, without CMake."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

import rosidl_adapter_proto
from rosidl_adapter_proto.generate.targets.index import RESOURCE_FOLDER
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
    stamp, needs = (folder / "build/depfile").read_text().rstrip("\n").split(": ")
    assert stamp == f"{folder}/build/stamp"
    assert Path(stamp).is_file()
    assert needs == rosidl_adapter_proto.__file__


def made_again(build: Path) -> set[str]:
    """Generate from nothing, and return the dependencies that were generated."""
    output = build.parent / "build"
    shutil.rmtree(output, ignore_errors=True)
    assert run("generate", build) == 0
    index = output / "dependencies/index/rosidl_proto"
    return {file.name for file in index.iterdir()} if index.is_dir() else set()


def resource(prefix: Path, name: str) -> Path:
    file = prefix / RESOURCE_FOLDER / name
    file.parent.mkdir(parents=True, exist_ok=True)
    return file


def test_what_comes_with_a_dependency(build: Path, folder: Path) -> None:
    """It is not made again, unless it was made from other definitions, or in another way."""
    assert made_again(build) == {"std_msgs"}
    made = (folder / "build/dependencies/index/rosidl_proto/std_msgs").read_bytes()
    file = resource(folder / "ros", "std_msgs")
    file.write_bytes(made)
    assert made_again(build) == set()
    assert str(file) in (folder / "build/depfile").read_text()

    for other in (made.replace(b'"hash"', b'"sequential"'), b"{", b"[]", b'{"of": "another version"}'):
        file.write_bytes(other)
        assert made_again(build) == {"std_msgs"}

    file.write_bytes(made)
    (folder / "ros/share/std_msgs/msg/Header.msg").write_text("string frame_id\nuint32 seq\n")
    assert made_again(build) == {"std_msgs"}


def test_what_comes_with_a_dependency_of_a_dependency(build: Path, folder: Path) -> None:
    write_package(folder / "other/share/middle_msgs", {"msg/Middle.msg": "std_msgs/Header header\n"})
    with build.open("a") as arguments:
        arguments.write(f"--dependency\n{folder}/other/share/middle_msgs\n")
    (folder / "src/track_msgs/msg/Track.msg").write_text(
        "middle_msgs/Middle middle\nstd_msgs/Header header\n"
    )
    assert made_again(build) == {"middle_msgs", "std_msgs"}
    made = (folder / "build/dependencies/index/rosidl_proto/middle_msgs").read_bytes()

    resource(folder / "other", "middle_msgs").write_bytes(made)

    assert made_again(build) == set()


def test_what_happens_to_be_installed(build: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What came with a package that this one does not depend on may be gone tomorrow."""
    made_again(build)
    made = (folder / "build/dependencies/index/rosidl_proto/std_msgs").read_bytes()
    resource(folder / "other", "std_msgs").write_bytes(made)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(folder / "other"))

    assert made_again(build) == {"std_msgs"}


@pytest.mark.parametrize("command", ["check", "generate"])
def test_a_dependency_that_was_skipped(
    command: str, build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its fields would be numbered here, and not as its own build will number them."""
    resource(folder / "ros", "std_msgs").write_bytes(b"")

    assert run(command, build) == 1
    assert capsys.readouterr().err == (
        "track_msgs refers to std_msgs, which was built without protobuf types: a warning says why when std_msgs is "
        "built\n"
    )

    (folder / "src/track_msgs/msg/Track.msg").write_text("uint32 id\n")
    assert run(command, build) == 0


def test_install(build: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("generate", build)
    with build.open("a") as arguments:
        arguments.write(f"--prefix\n{folder}/prefix\n--python-folder\nlib/site\n")
    (folder / "prefix/share/std_msgs/msg").mkdir(parents=True)
    link = folder / "prefix/share/std_msgs/msg/Header.proto"
    link.symlink_to(folder / "gone")

    assert run("install", build) == 0

    files = {path: data for path, data in content(folder / "prefix").items() if data is not None}
    assert set(files) == {
        "share/std_msgs/msg/Header.proto",
        "share/ament_index/resource_index/rosidl_proto/std_msgs",
        *(
            f"lib/site/rosidl_proto/std_msgs/msg/Header{end}"
            for end in ("_pb2.py", "_pb2.pyi", "_adapter.py")
        ),
        *(f"lib/site/rosidl_proto/std_msgs/msg/{end}" for end in ("__init__.py", "py.typed")),
    }
    assert not link.is_symlink()
    before = link.stat()
    assert run("install", build) == 0
    assert link.stat() == before

    (folder / "prefix/share").rename(folder / "prefix/away")
    (folder / "prefix/share").write_text("")
    assert run("install", build) == 1
    assert capsys.readouterr().err.startswith(f"cannot write to {folder}/prefix: ")


def test_a_dependency_that_is_not_one_any_more(build: Path, folder: Path) -> None:
    run("generate", build)
    (folder / "src/track_msgs/msg/Track.msg").write_text("uint32 id\n")

    assert run("generate", build) == 0

    made = content(folder / "build/dependencies")
    assert not [path for path in made if "std_msgs" in path]


def test_sequential_numbers(build: Path, folder: Path) -> None:
    """The lock file has what is generated here, and the output depends on it."""
    lock_file = folder / "numbers.lock"
    with build.open("a") as arguments:
        arguments.write(f"--numbering\nsequential\n--lock-file\n{lock_file}\n")
    assert made_again(build) == {"std_msgs"}
    assert '"std_msgs/msg/Header"' in lock_file.read_text()
    assert str(lock_file) in (folder / "build/depfile").read_text()

    made = (folder / "build/dependencies/index/rosidl_proto/std_msgs").read_bytes()
    resource(folder / "ros", "std_msgs").write_bytes(made)
    lock_file.unlink()
    assert made_again(build) == set()
    assert list(json.loads(lock_file.read_text())["messages"]) == ["track_msgs/msg/Track"]


def test_the_lock_file_of_another_branch(
    build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A build follows its lock file; where that is lost, the folder of the build knows the numbers."""
    definition, lock_file = folder / "src/track_msgs/msg/Track.msg", folder / "numbers.lock"
    definition.write_text("uint32 id\nuint8[] data\n")
    with build.open("a") as arguments:
        arguments.write(f"--numbering\nsequential\n--lock-file\n{lock_file}\n")
    assert run("generate", build) == 0
    assert capsys.readouterr().err == (
        f"Warning: {lock_file} is new: it keeps the numbers of fields, so commit it\n"
    )
    lock_file.write_text(lock_file.read_text().replace('"2 bytes ', '"5 bytes '))

    assert run("generate", build) == 0
    proto = folder / "build/package/proto/track_msgs/msg/Track.proto"
    assert "bytes data = 5;" in proto.read_text()

    lock_file.unlink()
    assert run("generate", build) == 1
    package = folder / "build/package"
    assert capsys.readouterr().err == (
        f"track_msgs/msg/Track.data has number 5 in {package}/.rosidl-proto.json, but there is no {lock_file}, and a "
        f"new one has 2 for it; restore {lock_file} from version control; or, if nothing is left that was serialized "
        f"with the old numbers, give --renumber, or remove {package} and generate it again\n"
    )
    assert not lock_file.exists()


def test_a_folder_that_cannot_be_written(
    build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "build/depfile").mkdir(parents=True)

    assert run("generate", build) == 1
    assert capsys.readouterr().err == (
        f"cannot write to {folder}/build: Is a directory ({folder}/build/depfile)\n"
    )


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
            "looked in package track_msgs, {folder}/ros/share/std_msgs, embedded store lyrical (messages only)\n",
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


@pytest.mark.parametrize("path", ["msg/Track.txt", "types/Track.idl", "msg/deep/Track.idl"])
def test_what_is_no_definition(
    path: str, build: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build.write_text(build.read_text().replace("msg/Track.msg", path))

    assert run("parse", build) == 1
    assert capsys.readouterr().err == (
        f"{folder}/src/track_msgs/{path} is no definition: it has to be a .msg, .srv or .action file, or an .idl "
        "file in a folder named msg, srv or action\n"
    )


def test_a_python_root_that_is_no_name(build: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with build.open("a") as arguments:
        arguments.write("--python-root\nmy-protos\n")

    assert run("check", build) == 1
    assert capsys.readouterr().err == "'my-protos' cannot be the name of a Python package\n"
