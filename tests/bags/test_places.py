"""Bags at places that are not on this machine: in memory, and behind a web server."""

from __future__ import annotations

import builtins
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import fsspec
import pytest
import zstandard

from rosidl_adapter_proto.bags import places
from rosidl_adapter_proto.bags.bag import open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.output import written_aside
from rosidl_adapter_proto.bags.places import RemotePath, find_place, is_pattern, matching_places
from rosidl_adapter_proto.errors import BagError, Error, PlaceError, RequestError
from tests.bags.recordings import START, Recorded, contents, mcap_bytes, strings

MESSAGES = strings("/a", 12)


@pytest.fixture(autouse=True)
def in_folder(folder: Path) -> None:
    """Every test has an empty folder."""


@pytest.fixture
def memory() -> Iterator[Any]:
    """Yield the file system of fsspec that is in memory, which is empty."""
    system = fsspec.filesystem("memory")
    system.rm("/", recursive=True) if system.ls("/") else None
    yield system
    for path in system.ls("/", detail=False):
        system.rm(path, recursive=True)


def names(system: Any) -> list[str]:
    """Return all files in a file system."""
    return sorted(system.find("/"))


def texts(path: str, **options: Any) -> list[str]:
    return [each.message.data for each in open_bag(path).messages(**options)]


def numbered(first: int, count: int) -> list[str]:
    return [f"/a {i}" for i in range(first, first + count)]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("bags/a", Path("bags/a")),
        ("C:/bags/a", Path("C:/bags/a")),
        ("file:///bags/a%20b", Path("/bags/a b")),
        ("s3://bucket/a/", RemotePath("s3://bucket/a")),
        (Path("a"), Path("a")),
        (RemotePath("s3://bucket/a"), RemotePath("s3://bucket/a")),
    ],
)
def test_paths_and_urls(text: str, place: Path | RemotePath) -> None:
    assert find_place(text) == place


def test_a_remote_path_is_like_a_path() -> None:
    path = RemotePath("s3://bucket/a/b.mcap")
    assert (path.name, path.suffix, str(path.parent)) == ("b.mcap", ".mcap", "s3://bucket/a")
    assert path.parent / "c" == path.with_name("c") == RemotePath("s3://bucket/a/c")


def test_patterns(memory: Any) -> None:
    for name in ("b1", "b2", "c1"):
        Path(name).mkdir()
        memory.pipe(f"/bags/{name}/metadata.yaml", b"")
    Path("[x]").mkdir()
    assert list(matching_places("b*")) == [Path("b1"), Path("b2")]
    assert list(map(str, matching_places("memory://bags/b?"))) == ["memory:///bags/b1", "memory:///bags/b2"]
    assert [is_pattern(text) for text in ("b*", "b1", "[x]", "[y]", "s3://b/*")] == [
        True,
        False,
        False,
        True,
        True,
    ]


def test_mcap_is_read_in_place(memory: Any) -> None:
    memory.pipe("/a.mcap", mcap_bytes(MESSAGES))
    assert texts("memory://a.mcap") == numbered(0, 12)
    assert texts("memory://a.mcap", start=START + 10**10) == numbered(10, 2)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_there_and_back(memory: Any, storage: str) -> None:
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    convert_bag("in.mcap", "memory://bags/there", storage=storage)
    suffix = {"mcap": ".mcap", "sqlite3": ".db3"}[storage]
    assert names(memory) == [f"/bags/there/in{suffix}", "/bags/there/metadata.yaml"]
    convert_bag("memory://bags/there", "memory://bags/back", storage="mcap")
    assert texts("memory://bags/there") == texts("memory://bags/back") == numbered(0, 12)
    convert_bag("memory://bags/back/in.mcap", "back.mcap", target_format="cdr")
    found = contents(Path("back.mcap")).messages
    assert [(each.log_time, each.data) for each in found] == [(each.log_time, each.data) for each in MESSAGES]


def test_single_files_there(memory: Any) -> None:
    memory.pipe("/in.mcap", mcap_bytes(MESSAGES))
    result = convert_bag("memory://in.mcap", "memory://out.mcap")
    assert names(memory) == ["/in.mcap", "/out.mcap"]
    assert result.size == memory.size("/out.mcap") and result.source_size == memory.size("/in.mcap")


def test_files_that_are_compressed_there(memory: Any) -> None:
    memory.pipe("/in.mcap.zstd", zstandard.compress(mcap_bytes(MESSAGES)))
    assert texts("memory://in.mcap.zstd") == numbered(0, 12)


@pytest.mark.usefixtures("memory")
def test_temporary_files_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(places.tempfile, "tempdir", str(tmp_path / "temporary"))  # type: ignore[attr-defined]
    convert_bag("in.mcap", "memory://there", storage="sqlite3")
    assert texts("memory://there") == numbered(0, 12)
    assert not list((tmp_path / "temporary").iterdir())


def test_nothing_is_overwritten(memory: Any) -> None:
    memory.pipe("/out.mcap", b"mine")
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    with pytest.raises(BagError) as error:
        convert_bag("in.mcap", "memory://out.mcap")
    message = "memory://out.mcap exists, and nothing is overwritten; choose another name, or remove it"
    assert str(error.value) == message
    assert memory.cat("/out.mcap") == b"mine" and names(memory) == ["/out.mcap"]


def test_nothing_is_overwritten_that_came_in_the_meantime(memory: Any) -> None:
    destination = RemotePath("memory://out")
    with (
        pytest.raises(BagError, match=r"^memory://out exists"),
        written_aside(destination, is_folder=True) as place,
    ):
        (place / "a").write_bytes(b"new")
        memory.pipe("/out/b", b"mine")
    assert names(memory) == ["/out/b"]


def test_nothing_is_left_of_what_fails(memory: Any) -> None:
    bad = [*MESSAGES, Recorded("/a", START + 10**12, b"\0\1\0\0bad")]
    Path("in.mcap").write_bytes(mcap_bytes(bad))
    with pytest.raises(BagError, match="message 13 of /a"):
        convert_bag("in.mcap", "memory://out")
    assert names(memory) == []


def test_nothing_is_left_if_files_cannot_be_moved(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    move, moved = type(memory).mv, []

    def fails(self: Any, source: str, target: str, **options: Any) -> None:
        if source.endswith("metadata.yaml"):
            raise OSError("gone")
        moved.append(target)
        move(self, source, target, **options)

    monkeypatch.setattr(type(memory), "mv", fails)
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    with pytest.raises(PlaceError, match=r"OSError: gone$"):
        convert_bag("in.mcap", "memory://out")
    assert moved == ["/out/in.mcap"] and names(memory) == []


def test_no_bucket_is_made(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[str] = []
    monkeypatch.setattr(type(memory), "makedirs", lambda self, path: made.append(path))
    RemotePath("memory://folder/a").mkdir()
    monkeypatch.setattr("fsspec.core.url_to_fs", lambda url: (memory, "bucket/folder/b"))
    RemotePath("s3://bucket/folder/b").mkdir()
    assert made == ["/folder/a"]


def test_a_bucket_is_missing(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(self: Any, data: bytes) -> int:
        raise FileNotFoundError("The specified bucket does not exist")

    monkeypatch.setattr("fsspec.implementations.memory.MemoryFile.write", missing, raising=False)
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    with pytest.raises(BagError) as error:
        convert_bag("in.mcap", "memory://bucket/out.mcap")
    assert re.fullmatch(
        r"memory://bucket/.out.mcap.partial-\w+/out.mcap: cannot be written: there is no such folder or bucket; "
        "make it first",
        str(error.value),
    )
    assert names(memory) == []


def test_a_bag_does_not_go_into_itself(memory: Any) -> None:
    memory.pipe("/in/a.mcap", mcap_bytes(MESSAGES))
    with pytest.raises(
        RequestError, match=r"^memory://in/out is inside of memory://in, which is not changed"
    ):
        convert_bag("memory://in", "memory://in/out")


@pytest.mark.parametrize(
    ("url", "kind", "message"),
    [
        ("memory://missing", BagError, "memory://missing: no such file or folder"),
        ("nope://a", RequestError, "nope://a: Protocol not known: nope"),
    ],
)
def test_what_is_not_there(url: str, kind: type[Error], message: str) -> None:
    with pytest.raises(kind) as error:
        open_bag(url)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("raised", "kind", "message"),
    [
        (FileNotFoundError("a"), BagError, "no such file or folder"),
        (PermissionError("Forbidden"), BagError, "Forbidden"),
        (ValueError("no range requests"), BagError, "no range requests"),
        (NotImplementedError(), BagError, "nothing can be written there; choose another place"),
        (OSError("reset"), PlaceError, "OSError: reset"),
        (TimeoutError(), PlaceError, "TimeoutError: "),
        (BagError("known"), BagError, None),
    ],
)
def test_errors_of_file_systems(
    memory: Any, monkeypatch: pytest.MonkeyPatch, raised: Exception, kind: type[Error], message: str | None
) -> None:
    def failing(*arguments: Any, **options: Any) -> Any:
        raise raised

    monkeypatch.setattr(type(memory), "isfile", failing)
    with pytest.raises(kind) as error:
        open_bag("memory://a")
    assert str(error.value) == ("known" if message is None else f"memory://a: {message}")


def test_the_package_of_the_file_system_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(url: str) -> None:
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr("fsspec.core.url_to_fs", missing)
    with pytest.raises(RequestError) as error:
        open_bag("s3://bucket/a")
    assert str(error.value) == "s3://bucket/a: Install s3fs to access S3"


def test_fsspec_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def importing(name: str, *rest: Any, **options: Any) -> Any:
        if name.startswith("fsspec"):
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", importing)
    with pytest.raises(RequestError) as error:
        open_bag("s3://bucket/a")
    assert str(error.value) == "s3://bucket/a: URLs need fsspec; `pip install rosidl-adapter-proto[remote]`"


def test_paths_do_not_need_fsspec() -> None:
    Path("in.mcap").write_bytes(mcap_bytes(MESSAGES))
    program = (
        "import sys; from rosidl_adapter_proto.bags.convert import convert_bag;"
        "convert_bag('in.mcap', 'out.mcap'); print('fsspec' in sys.modules)"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout == "False\n"


def test_a_broken_connection_is_no_damage(memory: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    memory.pipe("/a.mcap", mcap_bytes(MESSAGES, chunk_size=100))
    read = places._RemoteFile.read
    count = 0

    def breaking(self: Any, size: int | None = -1) -> bytes:
        nonlocal count
        count += 1
        if count > 20:
            self._file.read = lambda size: 1 / 0
        return read(self, size)

    monkeypatch.setattr(places._RemoteFile, "read", breaking)
    monkeypatch.setattr("rosidl_adapter_proto.bags.workers._FIRST_DELAY", 0)
    with pytest.raises(PlaceError, match=r"^memory://a.mcap: ZeroDivisionError: division by zero$"):
        convert_bag("memory://a.mcap", "out.mcap", on_error="skip")
    assert not Path("out.mcap").exists()


class Server(BaseHTTPRequestHandler):
    """Serves the current folder, and ranges of its files."""

    protocol_version = "HTTP/1.1"
    ranges: list[tuple[int, int]] = []  # noqa: RUF012

    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        file = Path(self.path.lstrip("/"))
        if not file.is_file():
            self.send_error(404)
            return
        data = file.read_bytes()
        start, end = 0, len(data) - 1
        asked = self.headers.get("Range")
        if asked:
            first, _, last = asked.removeprefix("bytes=").partition("-")
            start, end = int(first), min(int(last), end)
            self.ranges.append((start, end + 1))
        self.send_response(206 if asked else 200)
        self.send_header("Accept-Ranges", "bytes")
        self.send_header("Content-Range", f"bytes {start}-{end}/{len(data)}")
        self.send_header("Content-Length", str(end + 1 - start))
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(data[start : end + 1])

    def log_message(self, format: str, *arguments: object) -> None:
        """Say nothing."""


@pytest.fixture
def server() -> Iterator[str]:
    """Yield the URL of a web server for the current folder."""
    with ThreadingHTTPServer(("127.0.0.1", 0), Server) as running:
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        Server.ranges.clear()
        yield f"http://127.0.0.1:{running.server_port}"
        running.shutdown()
        thread.join()


def test_a_web_server(server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(places, "_BLOCK_SIZE", 2**16)
    big = [Recorded("/a", each.log_time, b"\0\1\0\0\1\0\0\1" + bytes(2**24 + 1)) for each in MESSAGES[:3]]
    Path("a.mcap").write_bytes(mcap_bytes(sorted([*MESSAGES, *big]), compression=0))
    with open_bag(f"{server}/a.mcap") as bag:
        assert bag.message_count == 15
    assert sum(end - start for start, end in Server.ranges) < 2**20


def test_what_a_web_server_has_not(server: str) -> None:
    with pytest.raises(BagError, match=r"/b.mcap: no such file or folder$"):
        open_bag(f"{server}/b.mcap")
