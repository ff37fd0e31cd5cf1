"""Opens databases as their recorder left them: finished, killed while it wrote, or cut off. They are never changed."""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

from rosidl_adapter_proto.errors import BagError

JOURNAL_SUFFIXES = ("-wal", "-journal")
"""What the names of files end with that sqlite leaves beside a database if its recorder is killed."""


class Database(NamedTuple):
    """An open database.

    Attributes:
        connection: The connection to it, whose texts are bytes: names may be anything.
        warning: What is odd about it, for people; empty if nothing is.
        is_cut_off: Whether it has lost its end.
    """

    connection: sqlite3.Connection
    warning: str
    is_cut_off: bool


def open_database(file_path: str, path: str, salvage: bool, stack: ExitStack) -> Database:
    """Open a database for reading.

    Args:
        file_path: The file.
        path: What to call it, for people.
        salvage: Read what there is of a file that has lost its end.
        stack: Closes the connection, and removes the copy that may be needed.

    Raises:
        BagError: There is no such file, or it is no database.
    """
    file = Path(file_path)
    if not file.is_file():
        raise BagError(f"{path}: no such file")
    file = file.resolve()  # sqlite looks beside the file that a link leads to
    beside = [Path(f"{file}{suffix}") for suffix in JOURNAL_SUFFIXES]
    journals = [journal for journal in beside if journal.is_file() and journal.stat().st_size]
    page_size = _cut_page_size(file) if salvage and not journals else 0
    warning = ""
    if journals:
        names = " and ".join(journal.name for journal in journals)
        warning = f"{path}: its recorder did not finish; {names} beside it was read too, from a copy"
        file = _with_journals(file, journals, path, stack)
    elif page_size:
        warning = f"{path}: cut off in the page of {page_size} bytes that is its last; it is left out"
        file = _with_whole_pages(file, page_size, stack)
    # Nobody writes to it: so sqlite makes no files beside it, as it would otherwise in journal mode WAL.
    place = f"file:{quote(str(file.absolute()))}?mode=ro&immutable=1"
    connection = sqlite3.connect(place, uri=True, check_same_thread=False)
    stack.callback(connection.close)
    if salvage:  # else sqlite reads nothing of a file that has lost its end
        connection.execute("PRAGMA writable_schema = ON")
    connection.text_factory = bytes
    return Database(connection, warning, bool(page_size))


def reason_of(error: Exception) -> str:
    if "not a database" in str(error):
        return "no sqlite3 database"
    return f"sqlite3 says: {error}"


def _with_journals(file: Path, journals: list[Path], path: str, stack: ExitStack) -> Path:
    """Return a copy that has what its recorder, which was killed, had not yet written into a file."""
    folder = _temporary_folder(stack)
    for source in (file, *journals):
        shutil.copyfile(source, folder / source.name)
    connection = sqlite3.connect(folder / file.name)
    try:
        # With this, sqlite takes in what lies beside it.
        connection.execute("PRAGMA journal_mode = DELETE").fetchall()
    except sqlite3.Error as error:
        raise BagError(f"{path}: {reason_of(error)}") from None
    finally:
        connection.close()
    return folder / file.name


def _cut_page_size(file: Path) -> int:
    """Return the size of the pages of a file whose last one is not whole; 0 if it is."""
    with file.open("rb") as opened:
        head = opened.read(18)
    stated = int.from_bytes(head[16:18], "big")  # https://sqlite.org/fileformat.html#page_size
    page_size = 2**16 if stated == 1 else max(stated, 512)
    return page_size if file.stat().st_size % page_size else 0


def _with_whole_pages(file: Path, page_size: int, stack: ExitStack) -> Path:
    """Return a copy without the page in which a file was cut off: sqlite would fill it up with zeros."""
    copy = _temporary_folder(stack) / file.name
    shutil.copyfile(file, copy)
    size = copy.stat().st_size
    os.truncate(copy, size - size % page_size)
    return copy


def _temporary_folder(stack: ExitStack) -> Path:
    return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="rosidl-proto-")))
