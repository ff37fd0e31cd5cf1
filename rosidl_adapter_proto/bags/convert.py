"""Converts whole bags from one serialization format to another, and from one storage to another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

from rosidl_adapter_proto.bags.conversion import ConversionResult, OnError, Progress, Settings
from rosidl_adapter_proto.bags.convert_file import FileTask
from rosidl_adapter_proto.bags.description import WrittenFile, describe
from rosidl_adapter_proto.bags.metadata import METADATA_FILE, write_metadata
from rosidl_adapter_proto.bags.model import Topic
from rosidl_adapter_proto.bags.output import check_new, written_aside
from rosidl_adapter_proto.bags.places import Place, file_size, find_place
from rosidl_adapter_proto.bags.recorded_file import ZSTD_SUFFIX
from rosidl_adapter_proto.bags.recording import Recording, find_recording
from rosidl_adapter_proto.bags.routes import formats, selected_topics
from rosidl_adapter_proto.bags.storage import MCAP, ROSBAG, SQLITE3, SUFFIXES, WRITTEN_SUFFIXES
from rosidl_adapter_proto.bags.topic_names import is_named, no_such_topic
from rosidl_adapter_proto.bags.workers import Workers
from rosidl_adapter_proto.converters import Converter, ConverterRegistry
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.time import to_nanoseconds

if TYPE_CHECKING:
    from rosidl_adapter_proto.time import Time


def convert_bag(
    source: Path | str,
    destination: Path | str,
    *,
    source_format: str | None = None,
    target_format: str | None = None,
    storage: str | None = None,
    compression: str | None = None,
    topics: str | Iterable[str] = (),
    excluded_topics: str | Iterable[str] = (),
    start: Time | None = None,
    end: Time | None = None,
    on_error: str = "stop",
    include: Iterable[Path | str] = (),
    distro: str | None = None,
    registry: ConverterRegistry | None = None,
    threads: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    workers: Workers | None = None,
) -> ConversionResult:
    """Convert a bag.

    The source is never changed. The result is written aside, and has its name once it is complete; what exists is
    never overwritten, and if anything fails, nothing is left of the result.

    Args:
        source: A folder that rosbag2 has recorded, a file of one, or a ROS 1 bag; a path, or a URL that fsspec knows.
        destination: The folder to write; or the file, if its name ends as those of a storage (`.mcap`, `.db3`) do.
            It may be a URL likewise.
        source_format: How the messages are serialized, whatever the bag says; by default what it says.
        target_format: What to convert to; by default `protobuf`, and `cdr` if the messages are protobuf.
        storage: The storage of the result, `mcap` or `sqlite3`; by default that of the source, and `mcap` for ROS 1.
        compression: How chunks are compressed, `none`, `zstd` or `lz4`; by default as in the source.
        topics: Which topics to convert: one or several names, or patterns with `*`, `?` and `[...]`; by default all.
        excluded_topics: Which topics to leave out, likewise.
        start: When the first message to convert was recorded: a `datetime`, nanoseconds since 1970, or another time;
            by default there is no start.
        end: When the first message not to convert any more was recorded; by default there is no end.
        on_error: What becomes of messages that cannot be converted: `stop`, `skip` or `copy` (`OnError`).
        include: Folders with definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else.
        registry: Where converter plugins come from; by default those that are installed.
        threads: On how many threads to convert; by default one for each processor.
        progress: Called whenever something was written, on any thread, but never on two at a time.
        workers: Where to convert the files of the bag, several at a time; by default here, one after the other.

    Returns:
        What was done. All numbers together are what the storage itself says.

    Raises:
        BagError: The bag, or a message of it, cannot be converted, or the result cannot be written.
        ConverterError: There is no converter for a serialization format.
        DefinitionError: A folder with definitions cannot be read.
        RequestError: What is asked for does not fit the bag.
        PlaceError: A place that is not on this machine cannot be reached.
    """
    settings = settings_of(
        source_format=source_format,
        target_format=target_format,
        storage=storage,
        compression=compression,
        topics=topics,
        excluded_topics=excluded_topics,
        start=start,
        end=end,
        on_error=on_error,
        include=include,
        distro=distro,
        registry=registry,
        threads=threads,
    )
    elsewhere = find_catalog(settings.include, settings.distro)
    return convert_with(
        find_place(source), find_place(destination), settings, elsewhere, workers or Workers(), progress
    )


def settings_of(
    *,
    topics: str | Iterable[str] = (),
    excluded_topics: str | Iterable[str] = (),
    start: Time | None = None,
    end: Time | None = None,
    on_error: str = "stop",
    include: Iterable[Path | str] = (),
    registry: ConverterRegistry | None = None,
    **others: Any,
) -> Settings:
    """Return the settings that are the arguments of `convert_bag`."""
    return Settings(
        topics=_patterns(topics),
        excluded_topics=_patterns(excluded_topics),
        start_time=0 if start is None else to_nanoseconds(start),
        end_time=None if end is None else to_nanoseconds(end),
        on_error=OnError(on_error),
        include=tuple(map(Path, include)),
        registry=registry or ConverterRegistry(),
        **others,
    )


def _patterns(topics: str | Iterable[str]) -> tuple[str, ...]:
    return (topics,) if isinstance(topics, str) else tuple(topics)


def convert_with(
    source: Place,
    destination: Place,
    settings: Settings,
    elsewhere: Catalog,
    workers: Workers,
    progress: Callable[[Progress], None] | None = None,
) -> ConversionResult:
    """Convert a bag as settings say, with definitions from elsewhere that it does not have; see `convert_bag`."""
    check_new(destination)
    if _is_inside(destination, source):
        raise RequestError(f"{destination} is inside of {source}, which is not changed; choose another place")
    recording = find_recording(str(source))
    storage, is_folder = _form(recording, destination, settings)
    topics = _topics(recording)
    _check_names([*settings.topics, *settings.excluded_topics], topics)
    selected = selected_topics(dict(enumerate(topics)), settings)
    source_format, target_format = formats(list(selected.values()), settings)
    Converter(source_format, target_format, settings.registry)  # that there is none is said before all else
    size = recording.size
    result = ConversionResult(warnings=recording.warnings, source_size=size)
    written: list[WrittenFile] = []
    with written_aside(destination, is_folder=is_folder) as place:
        names = _names(recording, storage)
        tasks = [
            FileTask(recording, index, file, source_format, target_format, storage, settings, elsewhere)
            for index, file in enumerate([place / name for name in names] if is_folder else [place])
        ]
        made = workers.convert_files(tasks, _summed(progress, size))
        for name, task, each in zip(names, tasks, made, strict=True):
            written.append(WrittenFile(name, each.topics, each.statistics))
            result += replace(each.result, size=file_size(task.destination))
        result += ConversionResult(warnings=recording.count_warnings(result.total.total))
        if is_folder:
            text = write_metadata(describe(storage, written, recording.metadata))
            (place / METADATA_FILE).write_bytes(text.encode())
    return result


def _is_inside(destination: Place, source: Place) -> bool:
    if isinstance(source, Path) and isinstance(destination, Path):
        return destination.resolve().is_relative_to(source.resolve())
    return f"{destination}/".startswith(f"{source}/")


def _summed(progress: Callable[[Progress], None] | None, total: int) -> Callable[[int, int], None]:
    """Return what adds up the progress of all files, and tells it."""
    done = message_count = 0
    lock = Lock()

    def add(size: int, messages: int) -> None:
        nonlocal done, message_count
        with lock:
            done += size
            message_count += messages
            if progress:
                progress(Progress(min(done, total), total, message_count))

    return add


def _form(recording: Recording, destination: Place, settings: Settings) -> tuple[str, bool]:
    """Return the storage of the result, and whether it is a folder."""
    by_name = SUFFIXES.get(destination.suffix)
    storage = settings.storage or by_name or recording.storage
    storage = MCAP if storage == ROSBAG and storage != by_name else storage
    if storage not in WRITTEN_SUFFIXES:
        raise RequestError(f"storage {storage!r} cannot be written; {' and '.join(WRITTEN_SUFFIXES)} can")
    if by_name not in (None, storage):
        raise RequestError(f"{destination} ends as a file of {by_name}, and the storage is to be {storage}")
    if storage == SQLITE3 and settings.compression not in (None, "none"):
        raise RequestError("files of sqlite3 are not compressed; leave --compression out, or write mcap")
    if by_name and len(recording.files) > 1:
        raise RequestError(
            f"{recording.path} has {len(recording.files)} files, each of which becomes one: "
            f"name a folder instead of {destination}"
        )
    return storage, by_name is None


def _topics(recording: Recording) -> list[Topic]:
    """Return the topics of all files."""
    if recording.metadata and any(file.is_copied for file in recording.files):
        return [information.topic for information in recording.metadata.topics]
    topics: list[Topic] = []
    for reader in recording.readers(salvage=True):  # what is damaged is said when it is converted
        topics += reader.topics.values()
    return topics


def _check_names(patterns: Sequence[str], topics: Sequence[Topic]) -> None:
    names = sorted({topic.name for topic in topics})
    for pattern in patterns:
        if not any(is_named(name, [pattern]) for name in names):
            raise RequestError(no_such_topic(pattern, names))


def _names(recording: Recording, storage: str) -> list[str]:
    """Return the names of the files of the result, after those of the source."""
    stems = [Path(find_place(file.path).name.removesuffix(ZSTD_SUFFIX)).stem for file in recording.files]
    if len(set(stems)) < len(stems):
        stems = [f"{stem}_{index}" for index, stem in enumerate(stems)]
    return [stem + WRITTEN_SUFFIXES[storage] for stem in stems]
