"""What is written aside, and moved into place once it is complete."""

from __future__ import annotations

import ctypes
import errno
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from rosidl_adapter_proto.bags.output import written_aside
from rosidl_adapter_proto.errors import BagError


def names(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.iterdir())


def write_file(destination: Path, before_the_end: Callable[[], object] = lambda: None) -> None:
    with written_aside(destination, is_folder=False) as place:
        place.write_bytes(b"new")
        assert not destination.exists()
        before_the_end()


def write_folder(destination: Path, before_the_end: Callable[[], object] = lambda: None) -> None:
    with written_aside(destination, is_folder=True) as place:
        (place / "a").write_bytes(b"new")
        assert not destination.exists()
        before_the_end()


WRITES = pytest.mark.parametrize("write", [write_file, write_folder])


def exists(place: Path) -> str:
    return f"^{re.escape(str(place))} exists, and nothing is overwritten; choose another name, or remove it$"


@WRITES
def test_what_is_complete_is_moved_into_place(tmp_path: Path, write: Callable[..., None]) -> None:
    write(tmp_path / "out")

    assert names(tmp_path) == ["out"]
    written = tmp_path / "out"
    assert (written / "a" if written.is_dir() else written).read_bytes() == b"new"
    assert written.stat().st_mode == created_here(tmp_path, is_folder=written.is_dir()).stat().st_mode


def created_here(folder: Path, *, is_folder: bool) -> Path:
    place = folder / "made"
    place.mkdir() if is_folder else place.touch()
    return place


@WRITES
def test_nothing_is_left_of_what_fails(tmp_path: Path, write: Callable[..., None]) -> None:
    def fail() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "out", fail)
    assert names(tmp_path) == []


def test_a_full_disk(tmp_path: Path) -> None:
    def fail() -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(BagError) as caught:
        write_file(tmp_path / "out", fail)
    assert str(caught.value) == (
        f"cannot write {tmp_path / 'out'}: No space left on device; nothing is left of it"
    )
    assert names(tmp_path) == []


def make_file(place: Path) -> None:
    place.write_bytes(b"old")


def make_link(place: Path) -> None:
    place.symlink_to("nowhere")


@WRITES
@pytest.mark.parametrize("make", [make_file, make_link, Path.mkdir])
def test_what_exists_is_not_overwritten(
    tmp_path: Path, write: Callable[..., None], make: Callable[[Path], None]
) -> None:
    make(tmp_path / "out")
    with pytest.raises(BagError, match=exists(tmp_path / "out")):
        write(tmp_path / "out")
    assert names(tmp_path) == ["out"]


@WRITES
@pytest.mark.parametrize("make", [make_file, make_link, Path.mkdir])
@pytest.mark.parametrize("kernel_can_do_it", [True, False])
def test_what_came_meanwhile_is_not_overwritten(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    write: Callable[..., None],
    make: Callable[[Path], None],
    kernel_can_do_it: bool,
) -> None:
    if not kernel_can_do_it:
        monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: SimpleNamespace())
    before = None

    def come() -> None:
        nonlocal before
        make(tmp_path / "out")
        before = (tmp_path / "out").lstat()

    with pytest.raises(BagError, match=exists(tmp_path / "out")):
        write(tmp_path / "out", come)
    assert names(tmp_path) == ["out"]
    after = (tmp_path / "out").lstat()
    assert before and (before.st_ino, before.st_size) == (after.st_ino, after.st_size)


def test_renaming_where_the_kernel_cannot_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: SimpleNamespace())
    write_folder(tmp_path / "out")
    assert names(tmp_path) == ["out"]


def test_no_folder_to_write_to(tmp_path: Path) -> None:
    with pytest.raises(BagError) as caught:
        write_file(tmp_path / "no" / "out")
    assert str(caught.value) == (
        f"cannot write {tmp_path / 'no' / 'out'}: there is no folder {tmp_path / 'no'}; make it first"
    )


KILLED = """
import os, signal, sys
from pathlib import Path
from rosidl_adapter_proto.bags.output import written_aside
with written_aside(Path(sys.argv[1]), is_folder=True) as place:
    (place / "a").write_bytes(b"x")
    print("writing", flush=True)
    sys.stdin.read()
"""


def test_the_next_run_removes_what_a_killed_one_left(tmp_path: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path / "out")], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdout and process.stdout.readline() == b"writing\n"
        (left,) = names(tmp_path)
        assert re.fullmatch(r"\.out\.partial-[0-9a-f]{8}", left)
        with pytest.raises(BagError) as caught:
            write_folder(tmp_path / "out")
        assert str(caught.value) == (
            f"{tmp_path / 'out'} is being written by another run, in {tmp_path / left}; "
            "choose another name, or wait for it"
        )
        write_folder(tmp_path / "other")
        process.kill()
        assert process.wait() == -signal.SIGKILL
    assert names(tmp_path) == [left, "other"]

    write_folder(tmp_path / "out")
    assert names(tmp_path) == ["other", "out"]
