"""Writes an output folder, so that it holds what one run makes and nothing older.

A manifest in the folder knows every file that was made. New files are staged in a folder of their own and then moved
into place, so that a full disk or an interrupt leaves the old output as it was. While files are moved, the manifest
names both the old and the new ones and has no fingerprint: if the program is killed there, the next run knows which
files are its own, and makes the rest.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import FrameType

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.manifest import (
    MANIFEST_NAME,
    Manifest,
    SequentialNumbers,
    digest,
    read_manifest,
)
from rosidl_adapter_proto.interfaces.model import TypeName

if sys.platform != "win32":
    import fcntl

STAGING_NAME = ".rosidl-proto-new"
"""The folder, inside the output folder, that files are staged in. One that outlives its run is left over."""


@dataclass(frozen=True)
class Changes:
    """What a run does to an output folder; paths are relative to it.

    Attributes:
        written: Files that are new or differ.
        removed: Files that an earlier run made and this one does not.
        unchanged: How many files stay as they are.
    """

    written: tuple[str, ...]
    removed: tuple[str, ...]
    unchanged: int

    @property
    def any(self) -> bool:
        """Whether anything is to be done."""
        return bool(self.written or self.removed)


def check_ours(output: Path) -> None:
    """Check that a folder has no files or was made by us.

    Raises:
        GenerateError: It is neither.
    """
    try:
        if output.exists() and read_manifest(output) is None and _has_files(output):
            raise GenerateError(
                f"{output} has files that were not made by rosidl-proto; "
                "choose an empty or new folder with --output"
            )
    except NotADirectoryError:
        raise GenerateError(f"{output} is not a folder; choose another with --output") from None
    except OSError as error:
        raise GenerateError(f"cannot read {output}: {error.strerror}") from None


def _has_files(output: Path) -> bool:
    """Tell whether there are files. A run that was killed may leave empty folders, and what it had staged."""
    return any(
        not each.is_dir() or each.is_symlink() or _has_files(each)
        for each in output.iterdir()
        if each.name != STAGING_NAME
    )


def make_manifest(
    fingerprint: str,
    interfaces: Iterable[TypeName],
    files: Mapping[str, bytes],
    numbers: SequentialNumbers | None = None,
) -> Manifest:
    """Return the manifest of a folder that holds `files`."""
    outputs = {path: digest(content) for path, content in sorted(files.items())}
    return Manifest(fingerprint, tuple(interfaces), outputs, numbers)


def changes(output: Path, files: Mapping[str, bytes]) -> Changes:
    """Return what has to be done so that a folder holds `files`.

    Raises:
        GenerateError: It has a file of somebody else, or a link to another folder, in the place of one of ours.
    """
    old = read_manifest(output)
    made = old.outputs if old else {}
    _check_inside(output, (*files, *made))
    written = []
    for path, content in files.items():
        present = _read(output / path)
        if present == content:
            continue
        if present is not None and path not in made:
            raise _not_ours(output / path)
        written.append(path)
    removed = [path for path in made if path not in files and _is_file(output / path)]
    return Changes(tuple(written), tuple(removed), len(files) - len(written))


def write(output: Path, manifest: Manifest, files: Mapping[str, bytes]) -> Changes:
    """Make a folder hold `files`, and return what that changed.

    Raises:
        GenerateError: A file of somebody else is in the way, or a file cannot be written.
    """
    try:
        with contextlib.ExitStack() as cleanup:
            _make_folder(output, cleanup)
            cleanup.enter_context(alone_in(output))
            staging = output / STAGING_NAME
            _remove_folder(staging)
            cleanup.callback(_remove_folder, staging)
            planned = changes(output, files)
            old = read_manifest(output)
            if not planned.any and old == manifest:
                return planned
            for folder in sorted({(output / path).parent for path in (*planned.written, *planned.removed)}):
                _make_folder(folder, cleanup)
                if not os.access(folder, os.W_OK):
                    raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(folder))
            outputs = {**(old.outputs if old else {}), **manifest.outputs}
            both = Manifest("", (), outputs, manifest.numbers)
            moves = [(MANIFEST_NAME, both.to_json())]
            moves += [(path, files[path]) for path in planned.written]
            moves += [(MANIFEST_NAME, manifest.to_json())]
            staging.mkdir()
            for number, (_, content) in enumerate(moves):
                (staging / str(number)).write_bytes(content)
            with _interrupts_deferred():
                _move(staging, output, [path for path, _ in moves], planned.removed)
            return planned
    except OSError as error:
        place = f" ({error.filename})" if error.filename else ""
        raise GenerateError(
            f"cannot write to {output}: {error.strerror}{place}; nothing was changed"
        ) from error


def discard_left_over(output: Path) -> None:
    """Remove what a run that was killed had staged; what a run in progress has staged stays."""
    if (output / STAGING_NAME).exists():
        with contextlib.suppress(OSError), alone_in(output):
            _remove_folder(output / STAGING_NAME)


def install(output: Path, prefix: Path, places: Mapping[str, str]) -> None:
    """Copy what was generated to a prefix. Builds that run at the same time may install the same files.

    Args:
        output: An output folder; nothing is installed of one that was never written.
        prefix: The prefix; it is made if need be.
        places: Where each folder of the output goes in the prefix.

    Raises:
        GenerateError: Files cannot be written.
    """
    manifest = read_manifest(output)
    try:
        prefix.mkdir(parents=True, exist_ok=True)
        with alone_in(prefix):
            for path in manifest.outputs if manifest else ():
                folder, _, rest = path.partition("/")
                if folder in places:
                    _install_file(output / path, prefix / places[folder] / rest)
    except OSError as error:
        raise GenerateError(f"cannot write to {prefix}: {error.strerror} ({error.filename})") from None


def _install_file(file: Path, place: Path) -> None:
    content = file.read_bytes()
    if not place.is_file() or place.read_bytes() != content:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.unlink(missing_ok=True)  # a link of `--symlink-install` leads into the folder of another build
        replace_file(place, content)


def replace_file(file: Path, content: bytes) -> None:
    """Write a single file, all of it or not at all.

    Raises:
        OSError: It cannot be written.
    """
    target = file.resolve()  # a symbolic link stays one
    staged = target.with_name(target.name + STAGING_NAME)
    try:
        staged.write_bytes(content)
        staged.replace(target)
    finally:
        staged.unlink(missing_ok=True)


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Wait until no other run holds `folder`, and let others wait.

    Raises:
        OSError: The folder cannot be opened.
    """
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _move(staging: Path, output: Path, paths: list[str], removed: Iterable[str]) -> None:
    """Move each staged file to its path; the last is the manifest, which tells that all the others are there."""
    last = len(paths) - 1
    try:
        for number, path in enumerate(paths[:last]):
            (staging / str(number)).replace(output / path)
        for path in removed:
            _remove(output, path)
        (staging / str(last)).replace(output / paths[last])
    except OSError as error:
        raise GenerateError(
            f"cannot write all of {output}: {error.strerror} ({error.filename}); "
            "some files are new and some are old: run rosidl-proto again"
        ) from error


def _read(file: Path) -> bytes | None:
    """Return the content of a file, or None if nothing is there."""
    try:
        return file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        if file.is_symlink():
            raise _not_ours(file) from None
        return None
    except IsADirectoryError:
        raise _not_ours(file) from None
    except OSError as error:
        raise GenerateError(f"cannot read {file}: {error.strerror}") from None


def _is_file(file: Path) -> bool:
    return os.path.isfile(file) or os.path.islink(file)


def _check_inside(output: Path, paths: Iterable[str]) -> None:
    """Check that no folder of a file of ours is a symbolic link: what is behind it is not ours to change or remove."""
    folders = {folder for path in paths for folder in PurePosixPath(path).parents}
    for folder in sorted(folders - {PurePosixPath()}):
        if os.path.islink(output / folder):
            raise GenerateError(
                f"{output / folder} is a symbolic link, and rosidl-proto changes nothing outside {output}; "
                "remove the link, or choose another folder with --output"
            )


def _not_ours(file: Path) -> GenerateError:
    return GenerateError(
        f"{file} was not made by rosidl-proto; move it away, or choose another folder with --output"
    )


def _make_folder(folder: Path, cleanup: contextlib.ExitStack) -> None:
    """Make a folder and those above it; `cleanup` removes those of them that are still empty."""
    for each in reversed([each for each in (folder, *folder.parents) if not each.exists()]):
        cleanup.callback(_remove_empty, each)
        each.mkdir(exist_ok=True)


def _remove_empty(folder: Path) -> bool:
    """Remove a folder if it is empty, and tell whether it was."""
    try:
        folder.rmdir()
    except OSError:
        return False
    return True


def _remove_folder(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)


def _remove(output: Path, path: str) -> None:
    """Remove a file, what Python cached of it, and the folders that are empty without it."""
    file = output / path
    file.unlink(missing_ok=True)
    cache = file.parent / "__pycache__"
    if not cache.is_symlink():
        for cached in cache.glob(f"{file.stem}.*.pyc"):
            cached.unlink(missing_ok=True)
        _remove_empty(cache)
    for folder in file.parents:
        if folder == output or not _remove_empty(folder):
            break


@contextlib.contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Hold back Ctrl-C until the block is done: moving files into place is short and must not stop half way."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[tuple[int, FrameType | None]] = []
    previous = signal.signal(signal.SIGINT, lambda number, frame: received.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
    if received:
        signal.raise_signal(signal.SIGINT)
