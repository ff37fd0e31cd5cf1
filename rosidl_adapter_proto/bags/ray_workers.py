"""Files of bags converted on a Ray cluster."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.bags.convert_file import FileResult, FileTask
from rosidl_adapter_proto.bags.places import Place, file_size, find_place
from rosidl_adapter_proto.bags.workers import RETRIES, Report, Trouble, Workers, attempt
from rosidl_adapter_proto.errors import PlaceError, RequestError


@contextlib.contextmanager
def ray_workers(
    address: str | None = None,
    *,
    count: int | None = None,
    threads: int | None = None,
    retries: int = RETRIES,
) -> Iterator[Workers]:
    """Yield workers that are tasks of a Ray cluster: each converts one file.

    All machines of the cluster must have this package, and reach the bags by the same paths or URLs.

    Args:
        address: The cluster, such as `ray://head:10001`; by default the one that the program is connected to, or that
            `$RAY_ADDRESS` names, or that runs on this machine, or a new one on this machine.
        count: How many files are converted at a time; by default one for each processor of the cluster.
        threads: On how many threads, and so processors, to convert each file; by default 1.
        retries: How often a file is tried again if a machine or a connection failed.

    Raises:
        RequestError: Ray is not installed, or cannot be reached.
    """
    try:
        import ray as library
    except ImportError:
        raise RequestError("Ray is not installed; `pip install 'rosidl-adapter-proto[ray]'`") from None
    ray: Any = library
    connected = not ray.is_initialized()
    if connected:
        try:
            ray.init(address=address, log_to_driver=False)
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise RequestError(
                f"Ray cannot be reached at {address or 'its default address'}: {error}"
            ) from error
    try:
        tasks = _Tasks(ray, threads or 1)
        count = count or max(int(ray.cluster_resources().get("CPU", 1)) // (threads or 1), 1)
        workers = Workers(count, tasks.convert, threads=threads or 1, retries=retries, stop=tasks.cancel)
        try:
            yield workers
        finally:
            workers.close()
    finally:
        if connected:
            ray.shutdown()


class _Tasks:
    """Tasks of Ray."""

    def __init__(self, ray: Any, threads: int) -> None:
        self._ray = ray
        self._convert = ray.remote(num_cpus=threads, max_retries=0)(
            _convert_remotely
        )  # `Workers` tries again
        self._running: set[Any] = set()

    def convert(self, task: FileTask, report: Report) -> FileResult:
        """Convert a file as a task, and wait for it."""
        source = task.recording.files[task.index].path
        reference = self._convert.remote(_with_absolute_paths(task))
        self._running.add(reference)
        try:
            outcome: FileResult | Trouble = self._ray.get(reference)
        except self._ray.exceptions.RayError as error:
            raise PlaceError(f"{source}: Ray: {_last_line(error)}") from error
        finally:
            self._running.discard(reference)
        if isinstance(outcome, Trouble):
            raise outcome.error()
        if not task.destination.is_file():
            raise PlaceError(
                f"{task.destination}: written on a machine of the cluster, and not to be found on this one; "
                "OUT must be the same place for all of them"
            )
        report(file_size(find_place(source)), outcome.statistics.message_count)
        return outcome

    def cancel(self) -> None:
        """End all tasks."""
        for reference in list(self._running):
            self._ray.cancel(reference, force=True)


def _convert_remotely(task: FileTask) -> FileResult | Trouble:
    return attempt(task, lambda size, messages: None)


def _with_absolute_paths(task: FileTask) -> FileTask:
    """Return the task for a process whose current folder is another one."""
    files = [replace(file, path=_absolute(find_place(file.path))) for file in task.recording.files]
    return replace(
        task,
        recording=replace(task.recording, files=tuple(files)),
        destination=find_place(_absolute(task.destination)),
        settings=replace(task.settings, include=tuple(map(Path.absolute, task.settings.include))),
    )


def _absolute(place: Place) -> str:
    return str(place.absolute() if isinstance(place, Path) else place)


def _last_line(error: Exception) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[-1]
