"""Converts many bags: what is done is not done again, and one that fails does not keep the others from it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from rosidl_adapter_proto.bags.conversion import ConversionResult, Progress, Settings
from rosidl_adapter_proto.bags.convert import convert_with, settings_of
from rosidl_adapter_proto.bags.metadata import METADATA_FILE
from rosidl_adapter_proto.bags.places import Place, RemotePath, find_place, is_pattern, matching_places
from rosidl_adapter_proto.bags.recorded_file import ZSTD_SUFFIX
from rosidl_adapter_proto.bags.storage import MCAP, SUFFIXES, WRITTEN_SUFFIXES
from rosidl_adapter_proto.bags.workers import Workers
from rosidl_adapter_proto.errors import BagError, Error, RequestError
from rosidl_adapter_proto.generate.request import find_catalog


@dataclass(frozen=True)
class BagOutcome:
    """What became of one of many bags.

    Attributes:
        source: The bag.
        destination: What was to be written.
        result: What was done; None if the bag failed, or was there already.
        error: Why it failed; empty if it did not.
    """

    source: str
    destination: str
    result: ConversionResult | None = None
    error: str = ""

    @property
    def was_there(self) -> bool:
        """Whether it was there already, so that there was nothing to do."""
        return self.result is None and not self.error

    @property
    def is_incomplete(self) -> bool:
        """Whether it was converted, but without some of its messages, or with some that could only be copied."""
        return self.result is not None and not self.result.is_complete


@dataclass(frozen=True)
class BagsProgress:
    """How far the conversion of many bags is.

    Attributes:
        bags_done: How many bags are done, failed, or were there already.
        bags: How many there are.
        done: How many bytes of them are done.
        message_count: How many messages were written.
    """

    bags_done: int
    bags: int
    done: int = 0
    message_count: int = 0


@dataclass(frozen=True)
class BagTask:
    """A bag, and what it is converted to."""

    source: Place
    destination: Place


def plan_bags(
    sources: Iterable[str | Path], destination: str | Path, storage: str | None = None
) -> list[BagTask]:
    """Return which bags to convert, and to what.

    A folder becomes a folder of the same name, and a file a file.

    Args:
        sources: Bags, and patterns of them with `*`, `?` and `[...]`; paths or URLs.
        destination: The folder that the results go to.
        storage: Their storage; by default that of each source.

    Raises:
        BagError: A file system cannot list what there is.
        PlaceError: It cannot be reached.
        RequestError: Nothing fits a pattern, or two bags would have the same result.
    """
    folder = find_place(destination)
    tasks: dict[str, BagTask] = {}
    for source in _expanded(sources):
        result = folder / _result_name(source, storage)
        other = tasks.setdefault(str(result), BagTask(source, result)).source
        if other != source:
            raise RequestError(
                f"{other} and {source} would both become {result}; convert them one after the other"
            )
    return list(tasks.values())


def _expanded(sources: Iterable[str | Path]) -> Iterator[Place]:
    for source in map(str, sources):
        if not is_pattern(source):
            yield find_place(source)
            continue
        found = matching_places(source)
        if not found:
            raise RequestError(f"no bag fits {source}")
        yield from found


def _result_name(source: Place, storage: str | None) -> str:
    name = source.name.removesuffix(ZSTD_SUFFIX)
    stem, dot, suffix = name.rpartition(".")
    own = SUFFIXES.get(dot + suffix)
    if own is None:
        return name
    return stem + WRITTEN_SUFFIXES.get(storage or own, WRITTEN_SUFFIXES[MCAP])


def convert_bags(
    tasks: Sequence[BagTask],
    settings: Settings | None = None,
    *,
    workers: Workers | None = None,
    progress: Callable[[BagsProgress], None] | None = None,
    finished: Callable[[BagOutcome], None] | None = None,
) -> list[BagOutcome]:
    """Convert bags, as many at a time as there are workers.

    The results are written aside and have their names once they are complete. So a bag whose result is there is done,
    and the same call again does what is left.

    Args:
        tasks: What `plan_bags` has returned. The folder that they go to is made.
        settings: How to convert each of them.
        workers: Where the files of the bags are converted; by default here, one after the other.
        progress: Called whenever something was written, on any thread, but never on two at a time.
        finished: Called with each bag that is done, on the thread of the caller.

    Returns:
        What became of the bags, in the order in which they were done.
    """
    workers = workers or Workers()
    run = _Run(settings or settings_of(), workers, len(tasks), progress or (lambda progress: None))
    outcomes = []
    for folder in {task.destination.parent for task in tasks}:
        _make_folder(folder)
    for outcome in run.outcomes(tasks):
        outcomes.append(outcome)
        if finished:
            finished(outcome)
    return outcomes


def _make_folder(folder: Place) -> None:
    if isinstance(folder, RemotePath):
        return  # made with what is in it
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BagError(f"cannot write {folder}: {error.strerror}") from None


class _Run:
    """Conversions that are under way together."""

    def __init__(
        self, settings: Settings, workers: Workers, bags: int, progress: Callable[[BagsProgress], None]
    ) -> None:
        self._settings = settings
        self._elsewhere = find_catalog(settings.include, settings.distro)
        self._workers = workers
        self._progress = progress
        self._lock = Lock()
        self._bags = bags
        self._bags_done = self._done = self._message_count = 0

    def outcomes(self, tasks: Sequence[BagTask]) -> Iterator[BagOutcome]:
        """Convert bags, and yield what became of each when it is done."""
        if self._workers.count == 1:
            yield from map(self._convert, tasks)
            return
        with ThreadPoolExecutor(self._workers.count, thread_name_prefix="convert-bag") as threads:
            try:
                for future in as_completed([threads.submit(self._convert, task) for task in tasks]):
                    yield future.result()
            except BaseException:  # such as Control-C, or what uses the outcomes fails
                threads.shutdown(wait=False, cancel_futures=True)
                self._workers.stop()
                raise

    def _convert(self, task: BagTask) -> BagOutcome:
        last = Progress(0, 0, 0)

        def add(now: Progress) -> None:
            nonlocal last
            self._add(0, now.done - last.done, now.message_count - last.message_count)
            last = now

        names = str(task.source), str(task.destination)
        try:
            if _is_done(task.destination):
                return BagOutcome(*names)
            result = convert_with(
                task.source, task.destination, self._settings, self._elsewhere, self._workers, add
            )
            return BagOutcome(*names, result)
        except Error as error:
            return BagOutcome(*names, error=str(error))
        finally:
            self._add(1)

    def _add(self, bags: int, size: int = 0, message_count: int = 0) -> None:
        with self._lock:
            self._bags_done += bags
            self._done += size
            self._message_count += message_count
            self._progress(BagsProgress(self._bags_done, self._bags, self._done, self._message_count))


def _is_done(destination: Place) -> bool:
    """Tell whether a result is there, and complete: in a folder, metadata.yaml is written last."""
    if destination.suffix in SUFFIXES:
        return destination.is_file()
    return (destination / METADATA_FILE).is_file()
