"""Paths that the file system refuses: each is an error that names it, and none a fault of the program."""

from __future__ import annotations

import errno
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate import output_tree
from tests.cli.conftest import Run
from tests.folders import content, write_package

LONG = "a" * 300


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (f"generate {LONG}", 3, f"package '{LONG}' was not found"),
        (f"generate ./{LONG}", 2, f"cannot read {LONG}: File name too long; give another file or folder\n"),
        (
            f"generate {LONG}.msg",
            2,
            f"cannot read {LONG}.msg: File name too long; give another file or folder\n",
        ),
        (f"generate src/{LONG}", 3, "package 'src' was not found"),
        (
            f"generate src -I {LONG}",
            2,
            f"cannot read {LONG}: File name too long; give another file or folder\n",
        ),
        (f"generate src -o {LONG}", 3, f"cannot read {LONG}: File name too long"),
        (
            f"generate src --numbering sequential --lock-file {LONG}",
            3,
            f"cannot read {LONG}: File name too long; name the lock file with --lock-file\n",
        ),
        (f"list -I {LONG}", 2, f"cannot read {LONG}: File name too long; give another file or folder\n"),
        (
            "list -I circle",
            2,
            "cannot read circle: Too many levels of symbolic links; give another file or folder\n",
        ),
        (f"show {LONG}/A", 3, f"package '{LONG}' was not found"),
        (
            f"lock drop a/msg/A.a --lock-file {LONG}",
            3,
            f"cannot read {LONG}: File name too long; name the lock file",
        ),
        (f"hook install --prefix {LONG}", 3, f"{LONG} is not a prefix of ROS packages"),
    ],
)
def test_names_that_are_refused(
    arguments: str, code: int, message: str, my_msgs: Path, folder: Path, run: Run
) -> None:
    (folder / "circle").symlink_to("circle")
    before = content(folder)

    ended = run(*arguments.split())

    assert (ended.code, ended.out) == (code, "")
    assert ended.err.startswith(f"Error: {message}")
    assert content(folder) == before


@pytest.mark.parametrize("length", [244, 245, 250, 251])
def test_long_names_of_interfaces(length: int, folder: Path, run: Run) -> None:
    name = "A" * length
    write_package(folder / "src/my_msgs", {f"msg/{name}.msg": "bool a\n"})

    ended = run("generate", "src")

    if length == 244:
        assert (ended.code, ended.err) == (0, "")
        return
    assert (ended.code, ended.out) == (3, "")
    assert ended.err == (
        f"Error: my_msgs/msg/{name}: the name is {length - 244} characters too long for generated files, whose names "
        "have at most 255, '_adapter.py' included; shorten it\n"
    )


def test_links_that_lead_nowhere(my_msgs: Path, folder: Path, run: Run) -> None:
    for name in ("circle", "msg/circle.msg/", "deep/circle"):
        link = folder / "src" / name
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(link.name)

    assert run("generate", "src/deep").err.startswith("Error: no interface definitions in src/deep: ")
    (folder / "src/msg/circle.msg").unlink()
    (folder / "src/msg").rmdir()
    assert run("generate", "./src").code == 0


def test_a_folder_that_is_gone(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "gone").mkdir()
    monkeypatch.chdir(folder / "gone")
    (folder / "gone").rmdir()

    ended = run("list")

    assert (ended.code, ended.out) == (2, "")
    assert ended.err == (
        "Error: cannot tell the current folder: No such file or directory; change to one that exists\n"
    )


def test_no_temporary_folder(my_msgs: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/nowhere")

    ended = run("generate", "src")

    assert (ended.code, ended.out) == (3, "")
    start, _, end = ended.err.partition("/nowhere/rosidl-proto-")
    assert start == "Error: cannot run protoc in a temporary folder: No such file or directory ("
    assert end.endswith("); make room there, or set TMPDIR to another folder\n")


def full(name: str) -> Callable[..., None]:
    def refuse(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", name)

    return refuse


def test_a_full_temporary_folder(
    my_msgs: Path, folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "write_text", full("/tmp/x.proto"))

    ended = run("generate", "src")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err == (
        "Error: cannot run protoc in a temporary folder: No space left on device (/tmp/x.proto); "
        "make room there, or set TMPDIR to another folder\n"
    )
    assert not (folder / "generated").exists()


def test_a_full_output_folder(my_msgs: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(output_tree, "_make_folder", full("generated/proto"))

    assert run("generate", "src").err == (
        "Error: cannot write to generated: No space left on device (generated/proto); nothing was changed\n"
    )


def test_an_index_that_cannot_be_read(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "ros/share/ament_index/resource_index").mkdir(parents=True)
    index = folder / "ros/share/ament_index/resource_index/rosidl_proto"
    index.symlink_to(index.name)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(folder / "ros"))

    ended = run("list")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err == (
        f"Error: cannot read {index}: Too many levels of symbolic links; take its prefix off AMENT_PREFIX_PATH\n"
    )
