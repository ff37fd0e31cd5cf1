"""Everything that a run makes, one row each.

What is written, what the manifest lists, where installing puts it, and what the installable project has follow from
these rows. A new file for each interface is a function, its template, and a row.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.generate.targets import Files, Generation, index, project, proto, python
from rosidl_adapter_proto.schema.proto import ProtoFile


@dataclass(frozen=True)
class Output:
    """Files of one kind.

    Attributes:
        folder: Their folder in the output folder.
        place: Where what is in that folder goes in a prefix; None for where Python has its packages.
        interface_files: Makes those of one interface; paths are relative to the folder.
        common_files: Makes those that interfaces have in common.
        is_wanted: Whether options ask for them.
    """

    folder: str
    place: str | None
    interface_files: Callable[[Generation, ProtoFile], Files] = lambda generation, file: {}
    common_files: Callable[[Generation], Files] = lambda generation: {}
    is_wanted: Callable[[Options], bool] = lambda options: True


OUTPUTS = (
    Output("proto", "share", proto.interface_files),
    Output("python", None, python.interface_files, python.package_files),
    Output("index", index.PLACE, common_files=index.resource_files),
)

SHARED_FOLDERS = {each.folder: each.place for each in OUTPUTS if each.place is not None}
"""Where the folders of an output folder that are not Python's go in a prefix."""


def places(python_folder: str) -> dict[str, str]:
    """Return where every folder of an output folder goes in a prefix with that folder of Python packages."""
    return {each.folder: python_folder if each.place is None else each.place for each in OUTPUTS}


Progress = Callable[[int, int], None]
"""Is told how many interfaces are done, and how many there are."""


def all_files(generation: Generation, progress: Progress | None = None) -> dict[str, bytes]:
    """Return the content of every file that a run makes, by path in the output folder."""
    outputs = _wanted(generation.options)
    made: list[dict[str, bytes]] = [{} for _ in outputs]
    for done, of_interface in enumerate(_interface_files(generation), 1):
        for files, more in zip(made, of_interface, strict=True):
            files.update(more)
        if progress:
            progress(done, len(generation.files))
    content: dict[str, bytes] = {}
    for each, files in zip(outputs, made, strict=True):
        files.update(each.common_files(generation))
        content.update((f"{each.folder}/{path}", data) for path, data in files.items())
    shared_folders = {each.folder: each.place for each in outputs if each.place is not None}
    content["pyproject.toml"] = project.project_file(generation, shared_folders)
    return content


def _interface_files(generation: Generation) -> Iterator[list[Files]]:
    """Yield the files of each interface, those of each output for themselves."""
    numbers = range(len(generation.files))
    # Formatting Python takes nearly all the time. Forking is only safe while there is one thread.
    workers = os.cpu_count() or 1
    if (
        len(numbers) < _WORTH_FORKING
        or workers == 1
        or threading.active_count() > 1
        or not hasattr(os, "fork")
    ):
        yield from (_files_of(generation, number) for number in numbers)
        return
    fork = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(workers, fork, _start_worker, (generation,)) as pool:
        yield from pool.map(_files_of_worker, numbers, chunksize=4)


_WORTH_FORKING = 16


def _files_of(generation: Generation, number: int) -> list[Files]:
    file = generation.files[number]
    return [each.interface_files(generation, file) for each in _wanted(generation.options)]


_of_worker: list[Generation] = []
"""What a worker generates. It has it from its parent, without copying what is large."""


def _start_worker(generation: Generation) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # interrupts are for the parent
    _of_worker.append(generation)


def _files_of_worker(number: int) -> list[Files]:
    return _files_of(_of_worker[0], number)


def _wanted(options: Options) -> list[Output]:
    return [each for each in OUTPUTS if each.is_wanted(options)]
