"""Where the files of bags are converted: here, in processes of this machine, or on a cluster.

A task is one file, since that is the largest thing that needs nothing of another one; what a bag needs besides, to look
which files there are and to write its metadata, is little, and is done by whoever asks for the bag.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from glob import escape
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Event
from typing import TypeAlias

from rosidl_adapter_proto.bags.convert_file import FileResult, FileTask, convert_file
from rosidl_adapter_proto.errors import BagError, Error, PlaceError

Report: TypeAlias = Callable[[int, int], None]
"""What is called whenever something was written, with the numbers of bytes of the source and of messages."""

RETRIES = 2
"""How often a file is tried again if a process or a connection failed."""

_FIRST_DELAY = 1.0  # seconds before the first retry; each further one waits twice as long


class Workers:
    """Converts files, several at a time; what may go well another time is tried again.

    Attributes:
        count: How many files are converted at a time. With one, all is done on the thread of the caller.

    Args:
        count: How many files are converted at a time.
        convert: Converts one file, on any thread. A `PlaceError` tells that another try may go well.
        threads: On how many threads to convert each file, unless its settings say so; None for one on each processor.
        retries: How often a file is tried again.
        stop: Ends the calls of `convert` that are under way, with any error.
    """

    def __init__(
        self,
        count: int = 1,
        convert: Callable[[FileTask, Report], FileResult] = convert_file,
        *,
        threads: int | None = None,
        retries: int = RETRIES,
        stop: Callable[[], None] = lambda: None,
    ) -> None:
        self.count = count
        self._convert_once = convert
        self._threads_each = threads
        self._retries = retries
        self._stop = stop
        self._stopped = Event()
        self._threads = ThreadPoolExecutor(count, thread_name_prefix="convert-file")

    def convert_files(self, tasks: Sequence[FileTask], report: Report) -> list[FileResult]:
        """Convert files, and return what was made, in the order of the tasks. It may be called on several threads.

        Raises:
            BagError: A file cannot be converted; none of these tasks is still under way then.
            PlaceError: A process or a connection failed, again and again.
        """
        if self.count == 1:
            return [self._convert(task, report) for task in tasks]
        futures = [self._threads.submit(self._convert, task, report) for task in tasks]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            self.stop()
            raise
        finally:
            for future in futures:
                future.cancel()
            for future in futures:
                if not future.cancelled():
                    future.exception()  # waits: what it writes lies where the caller is about to remove it

    def stop(self) -> None:
        """End all that is under way, as errors of its tasks."""
        self._stopped.set()
        self._stop()

    def close(self) -> None:
        """Let go of all threads; nothing may be under way."""
        self._threads.shutdown()

    def _convert(self, task: FileTask, report: Report) -> FileResult:
        if self._threads_each and task.settings.threads is None:
            task = replace(task, settings=replace(task.settings, threads=self._threads_each))
        for attempt in range(self._retries + 1):
            if self._stopped.is_set():
                break
            size = message_count = 0

            def count(more_size: int, more_messages: int) -> None:
                nonlocal size, message_count
                size += more_size
                message_count += more_messages
                report(more_size, more_messages)

            try:
                return self._convert_once(task, count)
            except PlaceError:
                report(-size, -message_count)
                if attempt == self._retries:
                    raise
                _remove_parts(task)
                self._stopped.wait(_FIRST_DELAY * 2**attempt)
        raise PlaceError(f"{_name(task)}: stopped")


def _remove_parts(task: FileTask) -> None:
    """Remove what a try has left; other file systems write over it."""
    if isinstance(task.destination, Path):
        for part in task.destination.parent.glob(escape(task.destination.name) + "*"):
            part.unlink()


def _name(task: FileTask) -> str:
    return task.recording.files[task.index].path


@dataclass(frozen=True)
class Trouble:
    """An error of another process, in words: not every exception can be sent.

    Attributes:
        text: What is wrong, where, and what to do.
        may_pass: Whether another try may go well.
    """

    text: str
    may_pass: bool

    def error(self) -> Error:
        """Return it as an exception."""
        return PlaceError(self.text) if self.may_pass else BagError(self.text)


def attempt(task: FileTask, report: Report) -> FileResult | Trouble:
    """Convert a file in a process of workers."""
    try:
        return convert_file(task, report)
    except Error as error:
        return Trouble(str(error), isinstance(error, PlaceError))
    except OSError as error:
        return Trouble(f"{error.filename or task.destination}: {error.strerror or error}", False)


@contextlib.contextmanager
def processes(count: int, *, retries: int = RETRIES) -> Iterator[Workers]:
    """Yield workers that are processes of this machine, each with its share of the processors.

    They are started anew (`spawn`), since threads do not survive a fork: a program that uses them must be importable,
    with what it does under `if __name__ == "__main__"`.

    Args:
        count: How many.
        retries: How often a file is tried again if a process or a connection failed.
    """
    pool = _Processes()
    threads = max((os.cpu_count() or 1) // count, 1)
    workers = Workers(count, pool.convert, threads=threads, retries=retries, stop=pool.stop)
    try:
        yield workers
    finally:
        pool.close()
        workers.close()


class _Processes:
    """Processes, started as they are needed; one that ends takes no other with it."""

    def __init__(self) -> None:
        self._idle: list[_Process] = []
        self._all: list[_Process] = []

    def convert(self, task: FileTask, report: Report) -> FileResult:
        """Convert a file in one of them."""
        try:
            process = self._idle.pop()
        except IndexError:
            process = _Process()
            self._all.append(process)
        outcome = process.convert(task, report)
        self._idle.append(process)
        if isinstance(outcome, Trouble):
            raise outcome.error()
        return outcome

    def stop(self) -> None:
        """End all processes, whatever they do."""
        for process in self._all:
            process.stop()

    def close(self) -> None:
        """End all processes, and wait for that."""
        self.stop()
        for process in self._all:
            process.close()


class _Process:
    """A process that converts one file after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, other = context.Pipe()
        self._process = context.Process(target=_serve, args=(other,), daemon=True)
        self._process.start()
        other.close()

    def convert(self, task: FileTask, report: Report) -> FileResult | Trouble:
        """Convert a file, and report what was done as long as it goes on."""
        try:
            self._connection.send(task)
            while True:
                message: FileResult | Trouble | tuple[int, int] = self._connection.recv()
                if not isinstance(message, tuple):
                    return message
                report(*message)
        except (EOFError, OSError):
            self._process.join()
            raise PlaceError(f"{_name(task)}: {self._ending()} while it was converted") from None

    def stop(self) -> None:
        """End the process."""
        self._process.terminate()

    def close(self) -> None:
        """Wait until it has ended."""
        self._process.join()
        self._connection.close()

    def _ending(self) -> str:
        code = self._process.exitcode or 0
        if code < 0:
            return f"the process was killed by {signal.Signals(-code).name}"
        return f"the process ended with exit code {code}"


def _serve(connection: Connection) -> None:
    """Convert what is sent, in a process of its own."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # Control-C ends the program that started it, which ends it in turn
    with contextlib.suppress(EOFError, BrokenPipeError):  # the program that started it is gone
        while True:
            outcome = attempt(connection.recv(), lambda size, messages: connection.send((size, messages)))
            connection.send(outcome)
