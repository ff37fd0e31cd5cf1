"""Writing an output folder: what changes, what never does, and what is left when writing fails."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME, Manifest, read_manifest
from rosidl_adapter_proto.generate.output_tree import (
    STAGING_NAME,
    Changes,
    alone_in,
    changes,
    check_ours,
    discard_left_over,
    make_manifest,
    replace_file,
    write,
)
from tests.folders import content, times

OLD = {"a": b"old a", "proto/p/b": b"old b", "proto/q/r/c": b"old c"}
NEW = {"a": b"new a", "proto/p/b": b"old b", "proto/s/t/d": b"new d"}


def put(output: Path, files: dict[str, bytes]) -> Changes:
    return write(output, make_manifest(str(sorted(files)), (), files), files)


def files_in(output: Path) -> dict[str, bytes]:
    """Return the files of a folder without the manifest, which is checked to name exactly these."""
    files = {path: data for path, data in content(output).items() if data is not None}
    del files[MANIFEST_NAME]
    manifest = read_manifest(output)
    assert manifest == make_manifest(str(sorted(files)), (), files)
    return files


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """A folder that holds `OLD`."""
    put(tmp_path / "out", OLD)
    return tmp_path / "out"


def test_new_folder(tmp_path: Path) -> None:
    output = tmp_path / "not" / "there"

    assert put(output, OLD) == Changes(tuple(OLD), (), 0)
    assert files_in(output) == OLD


def test_only_what_differs_is_written(output: Path) -> None:
    before = times(output)

    assert put(output, NEW) == Changes(("a", "proto/s/t/d"), ("proto/q/r/c",), 1)
    assert files_in(output) == NEW
    assert not (output / "proto" / "q").exists()
    assert times(output)["proto/p/b"] == before["proto/p/b"]


def test_nothing_is_written_twice(output: Path) -> None:
    before = times(output)

    assert changes(output, OLD) == Changes((), (), 3)
    assert put(output, OLD) == Changes((), (), 3)
    assert times(output) == before


def test_only_the_manifest_differs(output: Path) -> None:
    before = times(output)

    assert write(output, make_manifest("other", (), OLD), OLD) == Changes((), (), 3)
    assert {path for path, time in times(output).items() if time != before[path]} == {MANIFEST_NAME}
    assert read_manifest(output) == make_manifest("other", (), OLD)


def test_a_changed_or_missing_file_is_made_again(output: Path) -> None:
    (output / "a").write_bytes(b"edited")
    (output / "proto" / "q" / "r" / "c").unlink()
    (output / "proto" / "q" / "r").rmdir()

    assert put(output, OLD) == Changes(("a", "proto/q/r/c"), (), 1)
    assert files_in(output) == OLD


def test_files_of_others_stay(output: Path) -> None:
    (output / "proto" / "q" / "r" / "notes").write_bytes(b"mine")
    (output / "empty").mkdir()

    put(output, NEW)

    assert (output / "proto" / "q" / "r" / "notes").read_bytes() == b"mine"
    assert not (output / "proto" / "q" / "r" / "c").exists()
    assert (output / "empty").is_dir()


def test_what_python_cached_goes_with_its_module(tmp_path: Path) -> None:
    """What was left would still be a package, an empty one."""
    put(tmp_path, {"a/m.py": b"", "b/m.py": b""})
    cached = [tmp_path / folder / "__pycache__" / "m.cpython-311.pyc" for folder in "ab"]
    for file in cached:
        make_file(file)
    make_file(tmp_path / "b" / "__pycache__" / "mine.cpython-311.pyc")

    put(tmp_path, {})

    assert set(content(tmp_path)) == {
        MANIFEST_NAME,
        "b",
        "b/__pycache__",
        "b/__pycache__/mine.cpython-311.pyc",
    }


def make_file(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"mine")


def make_dangling_link(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.symlink_to("nowhere")


@pytest.mark.parametrize("make", [make_file, make_dangling_link, Path.mkdir])
def test_somebody_elses_file_in_the_place_of_ours(make: Callable[[Path], None], output: Path) -> None:
    place = output / "e"
    make(place)
    before = content(output)

    for attempt in (changes, put):
        with pytest.raises(GenerateError) as error:
            attempt(output, OLD | {"e": b"ours"})

        assert str(error.value) == (
            f"{place} was not made by rosidl-proto; move it away, or choose another folder with --output"
        )
        assert content(output) == before


def test_somebody_elses_file_that_is_the_same(output: Path) -> None:
    make_file(output / "e")

    assert put(output, OLD | {"e": b"mine"}) == Changes((), (), 4)


def test_somebody_elses_file_in_the_place_of_a_folder(output: Path) -> None:
    (output / "proto" / "s").write_bytes(b"mine")
    before = content(output)

    with pytest.raises(GenerateError, match=r"^cannot write to .*/out: .*/proto/s.*; nothing was changed$"):
        put(output, NEW)

    assert content(output) == before


def test_a_link_in_the_place_of_ours_is_replaced_not_followed(output: Path, tmp_path: Path) -> None:
    make_file(tmp_path / "target")
    (output / "a").unlink()
    (output / "a").symlink_to(tmp_path / "target")

    put(output, OLD)

    assert files_in(output) == OLD
    assert (tmp_path / "target").read_bytes() == b"mine"


@pytest.mark.parametrize("files", [NEW, OLD, {}], ids=["new", "same", "none"])
def test_nothing_is_changed_behind_a_link(files: dict[str, bytes], output: Path, tmp_path: Path) -> None:
    """A folder of ours that somebody replaced by a link: what is there is theirs, even if it has our names."""
    theirs = tmp_path / "theirs"
    (output / "proto" / "q").rename(theirs)
    (theirs / "r" / "c").write_bytes(b"theirs")
    link = output / "proto" / "q"
    link.symlink_to(theirs)
    before = content(tmp_path)

    for attempt in (changes, put):
        with pytest.raises(GenerateError) as error:
            attempt(output, files)

        assert str(error.value) == (
            f"{link} is a symbolic link, and rosidl-proto changes nothing outside {output}; "
            "remove the link, or choose another folder with --output"
        )
        assert content(tmp_path) == before
    link.unlink()
    put(output, files)
    assert files_in(output) == files


def test_what_python_cached_behind_a_link_stays(tmp_path: Path) -> None:
    output = tmp_path / "out"
    put(output, {"a/m.py": b""})
    make_file(tmp_path / "theirs" / "m.cpython-311.pyc")
    (output / "a" / "__pycache__").symlink_to(tmp_path / "theirs")

    put(output, {})

    assert content(tmp_path / "theirs") == {"m.cpython-311.pyc": b"mine"}


def test_the_output_folder_may_be_a_link(output: Path, tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(output)

    check_ours(link)
    put(link, NEW)

    assert link.is_symlink()
    assert files_in(output) == NEW


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (make_file, "{} is not a folder; choose another with --output"),
        (
            lambda path: make_file(path / "x" / "y"),
            "{} has files that were not made by rosidl-proto; choose an empty or new folder with --output",
        ),
        (
            lambda path: make_file(path / MANIFEST_NAME),
            "{0}/.rosidl-proto.json is not a manifest that this version of rosidl-proto reads "
            "(Expecting value: line 1 column 1 (char 0)); remove {0} and generate it again",
        ),
    ],
)
def test_a_folder_that_is_not_ours(make: Callable[[Path], None], message: str, tmp_path: Path) -> None:
    output = tmp_path / "out"
    make(output)
    before = content(tmp_path)

    with pytest.raises(GenerateError) as error:
        check_ours(output)

    assert str(error.value) == message.format(output)
    assert content(tmp_path) == before


def test_a_folder_that_is_ours(output: Path, tmp_path: Path) -> None:
    check_ours(output)
    check_ours(tmp_path / "nowhere")
    (tmp_path / "empty" / "empty").mkdir(parents=True)
    check_ours(tmp_path / "empty")


def test_a_folder_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "iterdir", refuse)

    with pytest.raises(GenerateError, match=r"^cannot read /.*: Permission denied$"):
        check_ours(tmp_path)


class Fault:
    """Stands for a method of `Path`, and fails when it is called for the second time on a staged file."""

    def __init__(self, error: BaseException, method: Callable[..., object]) -> None:
        self.error, self.method, self.calls = error, method, 0

    def __get__(self, path: Path, owner: type[Path]) -> Callable[..., object]:
        def call(*arguments: object) -> object:
            self.calls += STAGING_NAME in str(path)
            if self.calls == 2:
                if isinstance(self.error, OSError):
                    self.error.filename = str(path)
                raise self.error
            return self.method(path, *arguments)

        return call


@pytest.mark.parametrize("old", [OLD, {}])
@pytest.mark.parametrize(
    "error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt(), MemoryError()]
)
def test_failing_while_staging(
    old: dict[str, bytes], error: BaseException, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "out"
    if old:
        put(output, old)
    before = content(tmp_path)
    monkeypatch.setattr(Path, "write_bytes", Fault(error, Path.write_bytes))

    with pytest.raises(GenerateError if isinstance(error, OSError) else type(error)) as caught:
        put(output, NEW)

    if isinstance(error, OSError):
        assert str(caught.value) == (
            f"cannot write to {output}: No space left on device ({output}/{STAGING_NAME}/1); nothing was changed"
        )
    assert content(tmp_path) == before


def test_a_folder_that_cannot_be_written(output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write everywhere, so a refusal is put in its place."""
    before = content(output)
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != output / "proto" / "q" / "r")

    with pytest.raises(GenerateError) as error:
        put(output, NEW)

    assert str(error.value) == (
        f"cannot write to {output}: Permission denied ({output}/proto/q/r); nothing was changed"
    )
    assert content(output) == before


def test_failing_while_moving(output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", Fault(OSError(errno.EIO, "Input/output error"), Path.replace))
        with pytest.raises(GenerateError) as error:
            put(output, NEW)

    assert str(error.value) == (
        f"cannot write all of {output}: Input/output error ({output}/{STAGING_NAME}/1); "
        "some files are new and some are old: run rosidl-proto again"
    )
    assert not (output / STAGING_NAME).exists()
    put(output, NEW)
    assert files_in(output) == NEW


def test_an_interrupt_while_moving_waits(
    output: Path, monkeypatch: pytest.MonkeyPatch, interruptible: None
) -> None:
    replace = Path.replace

    def interrupted(path: Path, target: Path) -> Path:
        signal.raise_signal(signal.SIGINT)
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", interrupted)

    with pytest.raises(KeyboardInterrupt):
        put(output, NEW)

    assert files_in(output) == NEW
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_writing_in_a_thread(output: Path) -> None:
    thread = threading.Thread(target=put, args=(output, NEW))
    thread.start()
    thread.join()

    assert files_in(output) == NEW


KILLED = """
import os, signal, sys
from pathlib import Path
from rosidl_adapter_proto.generate.output_tree import make_manifest, write

calls, last = 0, int(sys.argv[2])
def counted(method):
    def call(path, *arguments, **options):
        global calls
        if ".rosidl-proto-new" in str(path) or method is Path.unlink:
            calls += 1
        if calls > last:
            os.kill(os.getpid(), signal.SIGKILL)
        return method(path, *arguments, **options)
    return call
for name in ("mkdir", "write_bytes", "replace", "unlink"):
    setattr(Path, name, counted(getattr(Path, name)))
files = eval(sys.argv[3])
write(Path(sys.argv[1]), make_manifest(str(sorted(files)), (), files), files)
"""


@pytest.mark.parametrize("old", [{}, OLD])
def test_killed_anywhere(old: dict[str, bytes], tmp_path: Path) -> None:
    """Whenever a run is killed, the next one makes everything right, even if it makes something else."""
    finished = False
    for last in range(1, 20):
        output = tmp_path / f"out{last}"
        if old:
            put(output, old)
        process = subprocess.run(
            [sys.executable, "-c", KILLED, str(output), str(last), repr(NEW)], check=False
        )
        finished = process.returncode == 0
        assert finished or process.returncode == -signal.SIGKILL
        other = {"proto/p/b": b"other b", "e": b"other e"}

        for files in (NEW, other) if last % 2 else (other, NEW):
            check_ours(output)
            put(output, files)
            assert files_in(output) == files
        if finished:
            break
    assert finished
    assert last > 8


def test_what_a_killed_run_had_staged_is_removed(output: Path) -> None:
    make_file(output / STAGING_NAME / "0")

    discard_left_over(output)

    assert files_in(output) == OLD
    assert not (output / STAGING_NAME).exists()


def test_runs_wait_for_each_other(output: Path) -> None:
    """A second run does not begin to write, nor to clean up, before the first is done."""
    make_file(output / STAGING_NAME / "0")
    threads = [
        threading.Thread(target=put, args=(output, NEW)),
        threading.Thread(target=discard_left_over, args=(output,)),
    ]
    with alone_in(output):
        for thread in threads:
            thread.start()
            thread.join(0.05)
            assert thread.is_alive()
        assert (output / STAGING_NAME / "0").exists()
        assert (output / "a").read_bytes() == b"old a"
    for thread in threads:
        thread.join()

    assert files_in(output) == NEW


def test_without_locks(output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(descriptor: int, operation: int) -> None:
        raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr(fcntl, "flock", refuse)

    put(output, NEW)

    assert files_in(output) == NEW


def test_while_moving_the_manifest_knows_both(output: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Manifest | None] = []
    unlink = Path.unlink

    def look_and_unlink(path: Path, missing_ok: bool = False) -> None:
        seen.append(read_manifest(output))
        unlink(path)

    monkeypatch.setattr(Path, "unlink", look_and_unlink)

    put(output, NEW)

    assert seen
    assert seen[0] is not None
    assert seen[0].fingerprint == ""
    assert set(seen[0].outputs) == {*OLD, *NEW}


def test_replace_file(tmp_path: Path) -> None:
    file = tmp_path / "lock"
    replace_file(file, b"1")
    replace_file(file, b"2")

    assert content(tmp_path) == {"lock": b"2"}


def test_replace_file_keeps_a_link(tmp_path: Path) -> None:
    make_file(tmp_path / "real" / "lock")
    (tmp_path / "lock").symlink_to("real/lock")

    replace_file(tmp_path / "lock", b"2")

    assert (tmp_path / "lock").is_symlink()
    assert content(tmp_path / "real") == {"lock": b"2"}


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("method", ["write_bytes", "replace"])
def test_replace_file_fails(
    error: BaseException, method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_file(tmp_path / "lock")
    fault = Fault(error, getattr(Path, method))
    fault.calls = 1
    monkeypatch.setattr(Path, method, fault)

    with pytest.raises(type(error)):
        replace_file(tmp_path / "lock", b"new")

    assert content(tmp_path) == {"lock": b"mine"}
