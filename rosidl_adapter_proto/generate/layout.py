"""Writes an output folder, so that it holds what one run makes and nothing older.

A manifest in the folder knows every file that was made. Files are staged first and then moved into place, so that a
full disk or an interrupt leaves the old output as it was.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME, Manifest, digest, read_manifest

_STAGED_SUFFIX = ".rosidl-proto-new"


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


def changes(output: Path, manifest: Manifest, files: Mapping[str, bytes]) -> Changes:
    """Return what has to be done so that the folder holds `files`.

    Raises:
        GenerateError: The folder is not one of ours, or holds a file of somebody else in the place of one of ours.
    """
    check_ours(output)
    old = read_manifest(output)
    made = old.outputs if old else {}
    written = []
    for path, content in files.items():
        present = _read(output / path)
        if present == content:
            continue
        if present is not None and path not in made:
            raise GenerateError(
                f"{output / path} was not made by rosidl-proto; move it away or choose another folder with --output"
            )
        written.append(path)
    removed = [path for path in made if path not in files and (output / path).exists()]
    if not written and not removed and old != manifest:
        written.append(MANIFEST_NAME)
    return Changes(tuple(written), tuple(removed), len(files) - len(written))


def check_ours(output: Path) -> None:
    """Check that a folder is empty or was made by us.

    Raises:
        GenerateError: It is neither.
    """
    if not output.exists():
        return
    if not output.is_dir():
        raise GenerateError(f"{output} is not a folder; choose another with --output")
    if read_manifest(output) is None and any(output.iterdir()):
        raise GenerateError(
            f"{output} has files that were not made by rosidl-proto; choose an empty or new folder with --output"
        )


def write(output: Path, manifest: Manifest, files: Mapping[str, bytes], planned: Changes) -> None:
    """Carry out `planned`.

    Raises:
        GenerateError: A file cannot be written; the folder is as it was.
    """
    contents = {path: files[path] for path in planned.written if path in files}
    contents[MANIFEST_NAME] = manifest.to_json()
    staged: list[Path] = []
    new_folders: list[Path] = []
    try:
        for path, content in contents.items():
            target = output / path
            new_folders += _make_folder(target.parent)
            staged.append(target.with_name(target.name + _STAGED_SUFFIX))
            staged[-1].write_bytes(content)
    except BaseException as error:
        for file in staged:
            with contextlib.suppress(OSError):
                file.unlink()
        for folder in reversed(new_folders):
            with contextlib.suppress(OSError):
                folder.rmdir()
        if isinstance(error, OSError):
            raise GenerateError(
                f"cannot write to {output}: {error.strerror} ({error.filename}); nothing was changed"
            ) from error
        raise
    with _interrupts_deferred():
        for file in staged:  # the manifest comes last
            os.replace(file, file.with_name(file.name.removesuffix(_STAGED_SUFFIX)))
        for path in planned.removed:
            _remove(output, path)


def replace_file(file: Path, content: bytes) -> None:
    """Write a single file, all of it or not at all.

    Raises:
        GenerateError: It cannot be written.
    """
    staged = file.with_name(file.name + _STAGED_SUFFIX)
    try:
        staged.write_bytes(content)
        os.replace(staged, file)
    except OSError as error:
        staged.unlink(missing_ok=True)
        raise GenerateError(f"cannot write {file}: {error.strerror}") from error


def make_manifest(fingerprint: str, interfaces: Iterable[str], files: Mapping[str, bytes]) -> Manifest:
    """Return the manifest of a folder that holds `files`."""
    return Manifest(
        fingerprint, tuple(interfaces), {path: digest(content) for path, content in sorted(files.items())}
    )


def _read(file: Path) -> bytes | None:
    try:
        return file.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise GenerateError(f"cannot read {file}: {error.strerror}") from None


def _make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it, and return the ones that are new, outermost first."""
    new = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return new[::-1]


def _remove(output: Path, path: str) -> None:
    with contextlib.suppress(FileNotFoundError):
        (output / path).unlink()
    for folder in (output / path).parents:
        if folder == output:
            break
        try:
            folder.rmdir()
        except OSError:  # not empty
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
        raise KeyboardInterrupt
