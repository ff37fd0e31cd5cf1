"""Where bags are: paths on this machine, and URLs of what fsspec knows, such as `s3://bucket/drive-12`.

A `RemotePath` does what `pathlib.Path` does for a path, as far as bags need it; so code that has a `Place` need not
know which of the two it is. Paths never import fsspec.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from glob import glob, has_magic
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias, cast
from urllib.parse import unquote, urlsplit

from rosidl_adapter_proto.errors import BagError, PlaceError, RequestError

if TYPE_CHECKING:
    from typing_extensions import Buffer

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")
_BLOCK_SIZE = 2**23  # bytes that are fetched at once; the next ones are fetched while these are used
_NO_FOLDER = "cannot be written: there is no such folder or bucket; make it first"
_BLOCKS = 8  # of them are kept in memory for each open file


@dataclass(frozen=True)
class RemotePath:
    """A file or a folder that is not on this machine; its methods are those of `pathlib.Path`.

    Attributes:
        url: Its URL, without a slash at the end.
    """

    url: str

    def __str__(self) -> str:
        return self.url

    def __truediv__(self, name: str) -> RemotePath:
        return RemotePath(f"{self.url}/{name}")

    @property
    def name(self) -> str:
        """The last part of the path."""
        return self.url.rpartition("/")[2]

    @property
    def suffix(self) -> str:
        """What its name ends with, such as `.mcap`."""
        return PurePosixPath(self.name).suffix

    @property
    def parent(self) -> RemotePath:
        """The folder that it is in."""
        return RemotePath(self.url.rpartition("/")[0])

    def with_name(self, name: str) -> RemotePath:
        """Return another place in the same folder."""
        return self.parent / name

    def exists(self) -> bool:
        """Tell whether anything is there."""
        return bool(self._ask("exists"))

    def is_file(self) -> bool:
        """Tell whether it is a file."""
        return bool(self._ask("isfile"))

    def is_dir(self) -> bool:
        """Tell whether it is a folder. A page of a web server is a file."""
        return not self.is_file() and bool(self._ask("isdir"))

    def mkdir(self) -> None:
        """Make the folder, unless it is in a bucket, as object stores have them: there is nothing to make there."""
        with _told(self):
            file_system, path = self._file_system()
            if path.startswith("/"):  # else the first part is a bucket, which must not be made by mistake
                file_system.makedirs(path)

    def iterdir(self) -> Iterator[RemotePath]:
        """Yield what is in the folder."""
        for path in self._ask("ls", detail=False):
            yield self / path.rstrip("/").rpartition("/")[2]

    def size(self) -> int:
        """Return the size of the file in bytes."""
        size = self._ask("size")
        if size is None:
            raise BagError(
                f"{self}: its size is not known, so it cannot be read from its end; download it first"
            )
        return int(size)

    def read_bytes(self) -> bytes:
        """Return what is in the file."""
        return bytes(self._ask("cat_file"))

    def write_bytes(self, data: bytes) -> None:
        """Write the file."""
        self._ask("pipe_file", data)

    def open(self, mode: str) -> BinaryIO:
        """Open the file, to read its bytes (`rb`) or to write them (`wb`)."""
        options: dict[str, Any] = {"block_size": _BLOCK_SIZE}
        if mode == "rb":
            options |= {"cache_type": "background", "cache_options": {"maxblocks": _BLOCKS}}
        return cast("BinaryIO", _RemoteFile(self, self._ask("open", mode, **options)))

    def download(self, target: Path) -> None:
        """Copy the file to this machine."""
        self._ask("get_file", str(target))

    def upload(self, source: Path) -> None:
        """Copy a file of this machine there."""
        with _told(self, _NO_FOLDER):
            file_system, path = self._file_system()
            file_system.put_file(str(source), path)

    def move_file(self, target: RemotePath) -> None:
        """Move the file to another place in the same file system."""
        self._ask("mv", target._file_system()[1])

    def remove(self) -> None:
        """Remove the file, or the folder with all that is in it, if there is one."""
        if self.exists():
            self._ask("rm", recursive=True)

    def matches(self) -> list[RemotePath]:
        """Return what fits the path, which is a pattern, in order."""
        with _told(self):
            file_system, path = self._file_system()
            return [
                RemotePath(file_system.unstrip_protocol(found)) for found in sorted(file_system.glob(path))
            ]

    def _ask(self, method: str, *arguments: Any, **options: Any) -> Any:
        """Call a method of the file system with the path."""
        with _told(self):
            file_system, path = self._file_system()
            return getattr(file_system, method)(path, *arguments, **options)

    def _file_system(self) -> tuple[Any, str]:
        try:
            from fsspec.core import url_to_fs
        except ImportError:
            raise RequestError(
                f"{self}: URLs need fsspec; `pip install rosidl-adapter-proto[remote]`"
            ) from None
        try:
            found: tuple[Any, str] = url_to_fs(self.url)
        except (ImportError, ValueError) as error:  # what to install, and unknown protocols
            raise RequestError(f"{self}: {error}") from None
        return found


Place: TypeAlias = Path | RemotePath
"""A path on this machine, or somewhere else."""


class _RemoteFile(io.BufferedIOBase):
    """An open remote file, whose errors are ours."""

    def __init__(self, place: RemotePath, file: Any) -> None:
        self._place = place
        self._file = file

    def readable(self) -> bool:
        return bool(self._file.readable())

    def writable(self) -> bool:
        return bool(self._file.writable())

    def seekable(self) -> bool:
        return bool(self._file.seekable())

    def read(self, size: int | None = -1) -> bytes:
        with _told(self._place):
            return bytes(self._file.read(-1 if size is None else size))

    def write(self, data: Buffer) -> int:
        with _told(self._place, _NO_FOLDER):
            return int(self._file.write(data))

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        with _told(self._place):
            return int(self._file.seek(offset, whence))

    def tell(self) -> int:
        return int(self._file.tell())

    def close(self) -> None:
        if not self.closed:
            super().close()
            with _told(self._place, _NO_FOLDER):
                self._file.close()


@contextlib.contextmanager
def _told(place: RemotePath, missing: str = "no such file or folder") -> Iterator[None]:
    """Raise our errors for those of file systems, of which each has its own; `missing` tells what is not found."""
    try:
        yield
    except (BagError, PlaceError, RequestError):
        raise
    except FileNotFoundError:
        raise BagError(f"{place}: {missing}") from None
    except NotImplementedError:
        raise BagError(f"{place}: nothing can be written there; choose another place") from None
    except (PermissionError, ValueError) as error:  # the latter where a server sends no parts of files
        raise BagError(f"{place}: {error}") from error
    except Exception as error:
        raise PlaceError(f"{place}: {type(error).__name__}: {error}") from error


def find_place(path: str | os.PathLike[str] | Place) -> Place:
    """Return the place that a path or a URL names. `file://` is a path too."""
    if isinstance(path, RemotePath):
        return path
    text = os.fspath(path)
    if not _URL.match(text):
        return Path(text)
    if text.lower().startswith("file://"):
        return Path(unquote(urlsplit(text).path))
    return RemotePath(text.rstrip("/"))


def file_size(place: Place) -> int:
    """Return the size of a file in bytes."""
    return place.size() if isinstance(place, RemotePath) else place.stat().st_size


def is_pattern(text: str) -> bool:
    """Tell whether a path or a URL is a pattern, with `*`, `?` or `[...]`, and no name of something that is there."""
    return has_magic(text) and (bool(_URL.match(text)) or not os.path.lexists(text))


def matching_places(pattern: str) -> Sequence[Place]:
    """Return the places that fit a pattern, in order.

    Raises:
        BagError: The file system cannot list what there is.
        PlaceError: It cannot be reached.
    """
    place = find_place(pattern)
    if isinstance(place, RemotePath):
        return place.matches()
    return [Path(found) for found in sorted(glob(str(place)))]


@contextlib.contextmanager
def local_copy(place: Place, suffixes_beside: Sequence[str] = ()) -> Iterator[Path]:
    """Yield a file of this machine with what is in another; for a path it is that file itself.

    Args:
        place: The file.
        suffixes_beside: What the names of files beside it may end with that are to lie beside the copy too.

    Raises:
        BagError: There is no such file, or no room for it.
        PlaceError: It cannot be reached.
    """
    if isinstance(place, Path):
        yield place
        return
    with tempfile.TemporaryDirectory(prefix="rosidl-proto-") as folder:
        if file_size(place) > shutil.disk_usage(folder).free:
            raise BagError(f"{place}: too large to be copied to {folder}; set TMPDIR to a larger disk")
        place.download(Path(folder, place.name))
        for suffix in suffixes_beside:
            beside = place.with_name(place.name + suffix)
            if beside.is_file():
                beside.download(Path(folder, beside.name))
        yield Path(folder, place.name)


@contextlib.contextmanager
def written_locally(place: Place) -> Iterator[Path]:
    """Yield where to write a file on this machine that goes to a place when the block is done."""
    if isinstance(place, Path):
        yield place
        return
    with tempfile.TemporaryDirectory(prefix="rosidl-proto-") as folder:
        file = Path(folder, place.name)
        yield file
        place.upload(file)
