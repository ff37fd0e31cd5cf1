"""Writes files and folders aside, and moves them into place once they are complete.

What is written lies in a folder beside its place, `.NAME.partial-XXXXXXXX`, which is locked as long as its run lives.
If a run is killed, that folder is all that is left of it, and the next run to the same place removes it.

File systems elsewhere have neither locks nor, often, names that can be changed: there each file is moved, which object
stores do by copying it, metadata.yaml last, and what a run leaves that was killed stays.
"""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import secrets
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from rosidl_adapter_proto.bags.metadata import METADATA_FILE
from rosidl_adapter_proto.bags.places import Place, RemotePath
from rosidl_adapter_proto.errors import BagError, Error

if sys.platform != "win32":
    import fcntl

_PARTIAL = ".{}.partial-"
_AT_CURRENT_FOLDER = -100
_NO_REPLACE = 1


@contextlib.contextmanager
def written_aside(destination: Place, *, is_folder: bool) -> Iterator[Place]:
    """Yield where to write what belongs to `destination`, and move it there when the block is done.

    Everything is on the disk before it has its name. If the block fails, nothing of it is left.

    Args:
        destination: Where it goes; nothing may be there.
        is_folder: Whether it is a folder, which is made for the block, or a file, which the block makes.

    Raises:
        BagError: Something is there, another run is writing it, or the file system refuses.
        PlaceError: The file system cannot be reached.
    """
    if isinstance(destination, RemotePath):
        with _written_aside_remotely(destination, is_folder) as remote_place:
            yield remote_place
        return
    try:
        check_new(destination)
        _remove_left_over(destination)
        aside = destination.with_name(_aside_name(destination))
        aside.mkdir()
        try:
            with _locked(aside):
                place = aside / destination.name
                if is_folder:
                    place.mkdir()
                yield place
                _flush(aside)
                _rename_to_new(place, destination)
                _flush_folder(destination.parent)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
    except OSError as error:
        place_of_error = f" ({error.filename})" if error.filename else ""
        raise BagError(
            f"cannot write {destination}: {error.strerror or error}{place_of_error}; nothing is left of it"
        ) from error


@contextlib.contextmanager
def _written_aside_remotely(destination: RemotePath, is_folder: bool) -> Iterator[RemotePath]:
    """Do the same in a file system that is not on this machine."""
    check_new(destination)
    aside = destination.with_name(_aside_name(destination))
    place = aside / destination.name
    try:
        (place if is_folder else aside).mkdir()
        yield place
        check_new(destination)
        _move_remotely(place, destination, is_folder)
    finally:
        with contextlib.suppress(Error):  # what went wrong before is what counts
            aside.remove()


def _move_remotely(source: RemotePath, destination: RemotePath, is_folder: bool) -> None:
    """Move a file, or the files of a folder, of which metadata.yaml comes last: without it the bag is not complete."""
    try:
        if not is_folder:
            source.move_file(destination)
            return
        destination.mkdir()
        for file in sorted(source.iterdir(), key=lambda file: (file.name == METADATA_FILE, file.name)):
            file.move_file(destination / file.name)
    except BaseException:
        with contextlib.suppress(Error):
            destination.remove()
        raise


def _aside_name(destination: Place) -> str:
    return _PARTIAL.format(destination.name) + secrets.token_hex(4)


def check_new(destination: Place) -> None:
    """Check that nothing is at a place yet, and that the folder that it goes to is there.

    Raises:
        BagError: It is not so.
    """
    if isinstance(destination, RemotePath):
        if destination.exists():
            raise _exists(destination)
        return  # its file system makes folders as they are needed, if it has any
    if os.path.lexists(destination):
        raise _exists(destination)
    if not destination.parent.is_dir():
        raise BagError(f"cannot write {destination}: there is no folder {destination.parent}; make it first")


def _exists(destination: Place) -> BagError:
    return BagError(f"{destination} exists, and nothing is overwritten; choose another name, or remove it")


def _remove_left_over(destination: Path) -> None:
    """Remove what runs to the same place left that were killed."""
    for folder in destination.parent.iterdir():
        if folder.name.startswith(_PARTIAL.format(destination.name)) and folder.is_dir():
            try:
                with _locked(folder):
                    shutil.rmtree(folder)
            except BlockingIOError:
                raise BagError(
                    f"{destination} is being written by another run, in {folder}; choose another name, or wait for it"
                ) from None


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder; BlockingIOError tells that another program holds it."""
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError:  # a file system without locks
            pass
        yield
    finally:
        os.close(descriptor)


def _flush(folder: Path) -> None:
    """Wait until a folder is on the disk, with all that is in it."""
    for path, _, files in os.walk(folder):
        for name in files:
            _flush_file(Path(path, name), os.O_RDWR)
        _flush_folder(Path(path))


def _flush_folder(folder: Path) -> None:
    if sys.platform != "win32":
        _flush_file(folder, os.O_RDONLY)


def _flush_file(file: Path, flags: int) -> None:
    descriptor = os.open(file, flags)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _rename_to_new(source: Path, destination: Path) -> None:
    """Rename a file or a folder, unless something has come to the new place, where rename(2) would replace it."""
    if sys.platform == "linux":
        program = ctypes.CDLL(None, use_errno=True)
        paths = os.fsencode(source), os.fsencode(destination)
        rename = getattr(program, "renameat2", None)  # glibc has it since 2.28
        if rename and not rename(_AT_CURRENT_FOLDER, paths[0], _AT_CURRENT_FOLDER, paths[1], _NO_REPLACE):
            return
        code = ctypes.get_errno() if rename else errno.ENOSYS
        if code == errno.EEXIST:
            raise _exists(destination)
        if code not in (
            errno.EINVAL,
            errno.ENOSYS,
        ):  # those are a file system, or a kernel, that cannot do it
            raise OSError(code, os.strerror(code), str(destination))
    if os.path.lexists(destination):
        raise _exists(destination)
    source.rename(destination)
