"""Recordings: the files of a bag, in their order.

A recording is a folder of rosbag2, whose metadata.yaml names its files, or a single file: MCAP, sqlite3 (`.db3`) or a
ROS 1 bag.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from rosidl_adapter_proto.bags.compression import NONE, ZSTD
from rosidl_adapter_proto.bags.metadata import MAXIMUM_SIZE, METADATA_FILE, BagMetadata, read_metadata
from rosidl_adapter_proto.bags.places import Place, file_size, find_place
from rosidl_adapter_proto.bags.recorded_file import (
    ZSTD_SUFFIX,
    RecordedFile,
    open_file,
    open_reader,
    recognize,
)
from rosidl_adapter_proto.bags.storage import SUFFIXES, StorageReader
from rosidl_adapter_proto.errors import BagError


class Compression(NamedTuple):
    """How a file is compressed.

    Attributes:
        name: With what, as in `COMPRESSIONS`; empty if it is not.
        of: What rosbag2 has compressed, for people; empty where it is chunks.
    """

    name: str
    of: str = ""

    def __str__(self) -> str:
        return f"{self.name} ({self.of})" if self.of else self.name


@dataclass(frozen=True)
class Recording:
    """A bag: its files, and what metadata.yaml says.

    Attributes:
        path: The folder, or the single file.
        files: The files, in the order in which they were recorded; at least one.
        metadata: What metadata.yaml says, about all files of the folder; None without one.
        warnings: What is odd about the recording as a whole, for people.
    """

    path: str
    files: tuple[RecordedFile, ...]
    metadata: BagMetadata | None = None
    warnings: tuple[str, ...] = ()

    @property
    def storage(self) -> str:
        """The storage of its first file, by its name in rosbag2."""
        return self.files[0].storage

    def count_warnings(self, message_count: int) -> list[str]:
        """Return what to say if its files have fewer messages together than metadata.yaml says."""
        metadata = self.metadata
        is_folder = self.path != self.files[0].path
        if metadata is None or not (is_folder or len(metadata.paths) == 1):
            return []
        if metadata.message_count <= message_count:
            return []
        return [
            f"{self.path}: {METADATA_FILE} says {metadata.message_count} messages, but its files have {message_count}"
        ]

    @property
    def size(self) -> int:
        """How many bytes its files have, as they are stored."""
        return sum(file_size(find_place(file.path)) for file in self.files)

    def compression(self, index: int, reader: StorageReader) -> Compression:
        """Return how a file is compressed, as far as its first chunk says.

        Args:
            index: Which of `files`.
            reader: The file, open.

        Raises:
            BagError: It cannot be read.
        """
        if self.files[index].compressed:
            return Compression(ZSTD, "whole files")
        if self.metadata and self.metadata.compresses_messages:
            return Compression(self.metadata.compression_format, "each message")
        first = next(iter(reader.chunks()), None)
        return Compression(first.compression if first else NONE)

    def open(self, index: int, salvage: bool = False) -> StorageReader:
        """Open a file.

        Args:
            index: Which of `files`.
            salvage: Read what can be read of a damaged file.

        Raises:
            BagError: It cannot be read.
        """
        return open_reader(self.files[index], self.metadata, salvage)

    def readers(self, salvage: bool = False) -> Iterator[StorageReader]:
        """Yield a reader of each file in turn, which is closed when the next is asked for."""
        for index in range(len(self.files)):
            with self.open(index, salvage) as reader:
                yield reader


def find_recording(path: str) -> Recording:
    """Return the recording at a path.

    Args:
        path: A folder of rosbag2, a file of one, or a ROS 1 bag.

    Raises:
        BagError: There is none, or a file of it is missing.
    """
    place = find_place(path)
    if place.is_dir():
        return _folder(place)
    if not place.exists():
        raise BagError(f"{path}: no such file or folder")
    if not place.is_file():
        raise BagError(f"{path}: neither a file nor a folder, but a pipe or a device; copy it to a file")
    if place.name == METADATA_FILE:
        raise BagError(f"{path}: describes a bag; name the folder that it is in")
    file = recognize(path)
    metadata, warnings = _metadata_beside(place)
    return Recording(path, (file,), metadata, warnings)


def _folder(folder: Place) -> Recording:
    place = folder / METADATA_FILE
    present = sorted(
        (path for path in folder.iterdir() if Path(_plain_name(path)).suffix in SUFFIXES and path.is_file()),
        key=str,
    )
    try:
        metadata = _read_metadata(place)
    except BagError as error:
        raise BagError(
            f"{error}; or remove it, and the files are read in the order of their messages"
        ) from None
    if metadata is not None and metadata.paths:
        return _listed_files(folder, metadata, present)
    if not present:
        raise BagError(
            f"{folder}: no {METADATA_FILE} that names files, and no {' or '.join(SUFFIXES)} file in it"
        )
    plain = {path.name for path in present}
    twins = [path for path in present if path.name != _plain_name(path) in plain]
    recognized, warnings = _recognized([path for path in present if path not in twins])
    files = _by_start_time(recognized)
    names = ", ".join(find_place(file.path).name for file in files)
    reason = f"no {METADATA_FILE}" if metadata is None else f"{METADATA_FILE} names no files"
    warning = f"{folder}: {reason}; the files found, in the order of their first messages: {names}"
    warnings += [f"{path}: left out, since {_plain_name(path)} is there" for path in twins]
    return Recording(str(folder), tuple(files), metadata, (warning, *warnings))


def _recognized(paths: Sequence[Place]) -> tuple[list[RecordedFile], list[str]]:
    """Return what files are, and warnings; a recorder that was killed leaves one behind that has nothing in it."""
    empty = [path for path in paths if not file_size(path)]
    if len(empty) == len(paths):
        empty = []  # which is then an error
    files = [recognize(str(path)) for path in paths if path not in empty]
    return files, [f"{path}: empty; it is left out" for path in empty]


def _listed_files(folder: Place, metadata: BagMetadata, present: Sequence[Place]) -> Recording:
    paths = [_listed_file(folder, name) for name in metadata.paths]
    files, warnings = _recognized(paths)
    listed = {_plain_name(path) for path in paths}
    others = ", ".join(path.name for path in present if _plain_name(path) not in listed)
    if others:
        warnings.append(f"{folder}: {METADATA_FILE} does not name {others}, which is left out")
    storages = {file.storage for file in files} - {metadata.storage}
    if storages:
        warnings.append(
            f"{folder}: {METADATA_FILE} says {metadata.storage}, but there is {', '.join(sorted(storages))}"
        )
    return Recording(str(folder), tuple(files), metadata, tuple(warnings))


def _listed_file(folder: Place, name: str) -> Place:
    """Return a file that metadata.yaml names; rosbag2 leaves it compressed or decompressed when it is interrupted."""
    path = folder / name
    for candidate in (path, path.with_name(path.name + ZSTD_SUFFIX), path.with_name(_plain_name(path))):
        if candidate.is_file():
            return candidate
    raise BagError(
        f"{folder / METADATA_FILE}: names {name}, which is missing; name a file that is there instead"
    )


def _plain_name(path: Place) -> str:
    return path.name.removesuffix(ZSTD_SUFFIX)


def _by_start_time(files: list[RecordedFile]) -> list[RecordedFile]:
    times: dict[str, tuple[bool, int]] = {}
    for file in files:
        with open_reader(file, None, salvage=True) as reader:  # what is damaged is said when it is read
            times[file.path] = not reader.statistics.message_count, reader.statistics.start_time
    return sorted(files, key=lambda file: times[file.path])  # empty files come last


def _metadata_beside(path: Place) -> tuple[BagMetadata | None, tuple[str, ...]]:
    """Return the metadata in the folder of a file, if it is about that file."""
    place = path.parent / METADATA_FILE
    try:
        metadata = _read_metadata(place)
    except BagError as error:
        return None, (f"{error} (read without it)",)
    if metadata is None:
        return None, ()
    names = {_plain_name(Path(name)) for name in metadata.paths}
    return (metadata if _plain_name(path) in names else None), ()


def _read_metadata(place: Place) -> BagMetadata | None:
    if not place.is_file():
        return None
    with open_file(str(place)) as file:
        data = file.read(MAXIMUM_SIZE + 1)
    return (
        read_metadata(data, str(place)) if data.strip() else None
    )  # as a recorder leaves it that was killed
