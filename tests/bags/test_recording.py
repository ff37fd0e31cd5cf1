"""Recordings: folders and files, in which order, compressed or not, and what metadata.yaml adds or contradicts."""

from __future__ import annotations

import os
import random
import re
import tempfile
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace

import pytest
import zstandard

from rosidl_adapter_proto.bags.metadata import (
    BagMetadata,
    TopicInformation,
    write_inner_metadata,
    write_metadata,
)
from rosidl_adapter_proto.bags.model import Selection, Topic
from rosidl_adapter_proto.bags.recording import find_recording
from rosidl_adapter_proto.errors import BagError
from tests.bags.databases import NAMED_QOS, QOS, ROWS, STRING_HASH, Row, database, rows_of
from tests.bags.mcap_files import Recorded, mcap_file
from tests.bags.test_ros1 import ROWS as ROS1_ROWS
from tests.bags.test_ros1 import bag


def _mcap(path: Path, rows: Iterable[Row] = ROWS) -> Path:
    path.write_bytes(
        mcap_file([Recorded(row.topic, i, row.time, row.time, row.data) for i, row in enumerate(rows)])
    )
    return path


def _compress(path: Path) -> Path:
    compressed = Path(f"{path}.zstd")
    compressed.write_bytes(zstandard.ZstdCompressor().compress(path.read_bytes()))
    path.unlink()
    return compressed


def _describe(folder: Path, *paths: str, storage: str = "sqlite3", **more: object) -> Path:
    (folder / "metadata.yaml").write_text(write_metadata(BagMetadata(storage, paths, **more)))  # type: ignore[arg-type]
    return folder


def _read(path: Path, salvage: bool = False) -> list[Row]:
    return [row for reader in find_recording(str(path)).readers(salvage) for row in rows_of(reader)]


@pytest.fixture(params=["sqlite3", "mcap"])
def split(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    """A folder of three files whose numbers do not begin at 0 and whose names have another order; and its storage."""
    make, suffix = (database, ".db3") if request.param == "sqlite3" else (_mcap, ".mcap")
    for name, first, last in (("b_9", 0, 10), ("b_10", 10, 25), ("a_11", 25, 40)):
        make(tmp_path / f"{name}{suffix}", rows=ROWS[first:last])
    return tmp_path, request.param


def _names(storage: str, *names: str) -> list[str]:
    return [f"{name}{'.db3' if storage == 'sqlite3' else '.mcap'}" for name in names]


def test_a_folder_is_read_in_the_order_of_its_metadata(split: tuple[Path, str]) -> None:
    folder, storage = split
    _describe(folder, *_names(storage, "b_9", "b_10", "a_11"), storage=storage)
    recording = find_recording(str(folder))
    assert (recording.path, recording.storage, recording.warnings) == (str(folder), storage, ())
    assert [Path(file.path).name for file in recording.files] == _names(storage, "b_9", "b_10", "a_11")
    assert _read(folder) == list(ROWS)
    with recording.open(1) as reader:
        assert rows_of(reader) == list(ROWS[10:25])


def test_a_folder_without_metadata_is_read_in_the_order_of_time(split: tuple[Path, str]) -> None:
    folder, storage = split
    (database if storage == "sqlite3" else _mcap)(folder / _names(storage, "aa_empty")[0], rows=())
    names = ", ".join(_names(storage, "b_9", "b_10", "a_11", "aa_empty"))
    recording = find_recording(str(folder))
    found = "the files found, in the order of their first messages"
    assert recording.warnings == (f"{folder}: no metadata.yaml; {found}: {names}",)
    assert _read(folder) == list(ROWS)
    _describe(folder, storage=storage)
    assert find_recording(str(folder)).warnings == (
        f"{folder}: metadata.yaml names no files; {found}: {names}",
    )


def test_what_a_killed_recorder_leaves_is_read(split: tuple[Path, str]) -> None:
    """Nothing in metadata.yaml, a file that is cut off, one that is empty, and one that was just being compressed."""
    folder, storage = split
    (folder / "metadata.yaml").touch()
    last, empty, twin = (folder / name for name in _names(storage, "a_11", "a_12", "b_9"))
    last.write_bytes(last.read_bytes()[:-200])
    empty.touch()
    twin = Path(f"{twin}.zstd")
    twin.write_bytes(b"half")
    recording = find_recording(str(folder))
    assert [Path(file.path).name for file in recording.files] == _names(storage, "b_9", "b_10", "a_11")
    assert recording.warnings[1:] == (
        f"{empty}: empty; it is left out",
        f"{twin}: left out, since {twin.stem} is there",
    )


def test_metadata_that_is_wrong_may_be_removed(split: tuple[Path, str]) -> None:
    folder, _ = split
    (folder / "metadata.yaml").write_text("- text")
    with pytest.raises(BagError) as caught:
        find_recording(str(folder))
    assert str(caught.value) == (
        f"{folder}/metadata.yaml: the text: expected names and values; "
        "or remove it, and the files are read in the order of their messages"
    )


def test_a_file_that_is_listed_but_missing_is_an_error(split: tuple[Path, str]) -> None:
    folder, storage = split
    _describe(folder, "b_9.gone", storage=storage)
    with pytest.raises(BagError) as caught:
        find_recording(str(folder))
    assert str(caught.value) == (
        f"{folder}/metadata.yaml: names b_9.gone, which is missing; name a file that is there instead"
    )


def test_files_that_are_not_listed_are_left_out_and_said(split: tuple[Path, str]) -> None:
    folder, storage = split
    _describe(folder, *_names(storage, "b_9"), storage="sqlite3")
    recording = find_recording(str(folder))
    others = ", ".join(_names(storage, "a_11", "b_10"))
    expected = [f"{folder}: metadata.yaml does not name {others}, which is left out"]
    if storage == "mcap":
        expected.append(f"{folder}: metadata.yaml says sqlite3, but there is mcap")
    assert list(recording.warnings) == expected
    assert _read(folder) == list(ROWS[:10])


@pytest.mark.parametrize("name", ["bag.db3", "bag.mcap", "bag.bag", "a name"])
def test_a_single_file_is_recognized_by_what_it_is(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for make, storage in ((database, "sqlite3"), (_mcap, "mcap")):
        make(path)
        assert find_recording(str(path)).storage == storage
        assert _read(path) == list(ROWS)
        path.unlink()
    path.write_bytes(bag())
    assert find_recording(str(path)).storage == "rosbag_v2"
    assert _read(path) == list(ROS1_ROWS)


def test_a_single_file_takes_what_the_metadata_beside_it_says_of_it(tmp_path: Path) -> None:
    path = database(tmp_path / "a.db3", schema=1)
    topics = (
        TopicInformation(
            Topic("/a", "std_msgs/msg/String", "cdr", qos_profiles=NAMED_QOS, type_hash=STRING_HASH), 5
        ),
    )
    _describe(tmp_path, "a.db3", topics=topics)
    recording = find_recording(str(path))
    assert recording.warnings == ()
    with recording.open(0) as reader:
        assert (reader.topics[1].qos_profiles, reader.topics[1].type_hash) == (QOS, STRING_HASH)
        assert (reader.topics[2].qos_profiles, reader.topics[2].type_hash) == ("", "")
        assert reader.warnings == []
    _describe(tmp_path, "other.db3", topics=topics)
    assert find_recording(str(path)).metadata is None
    (tmp_path / "metadata.yaml").write_text("[")
    broken = find_recording(str(path))
    assert broken.metadata is None
    (warning,) = broken.warnings
    assert warning.endswith("(read without it)")


def test_the_file_counts_where_metadata_contradicts_it(tmp_path: Path) -> None:
    """As in bags of rosbag2's own tests, of which rosbags reads nothing."""
    from rosbags.rosbag2 import Reader

    path = database(tmp_path / "a.db3")
    topics = (
        TopicInformation(
            Topic("/a", "std_msgs/msg/String", "cdr", qos_profiles=QOS.replace("depth: 0", "depth: 1")), 27
        ),
        TopicInformation(Topic("/b", "p/msg/B", "protobuf", qos_profiles=QOS, type_hash="RIHS01_"), 13),
    )
    _describe(tmp_path, "a.db3", topics=topics, message_count=40)
    with find_recording(str(tmp_path)).open(0) as reader:
        assert rows_of(reader) == list(ROWS)
        assert reader.statistics.message_count == 40
        assert (reader.topics[2].type_name, reader.topics[2].serialization_format) == (
            "std_msgs/msg/String",
            "cdr",
        )
        assert reader.warnings == [
            f"{path}: /a: metadata.yaml says another QoS than the file, which is believed",
            f"{path}: /b: metadata.yaml says another type and serialization format and type hash than the file, "
            "which is believed",
        ]
    _describe(tmp_path, "a.db3", topics=topics[:1], message_count=40)
    with Reader(tmp_path) as oracle:
        assert list(oracle.messages()) == []


@pytest.mark.parametrize("listed", ["as it is", "decompressed"])
def test_compressed_files_are_read_from_temporary_ones(
    split: tuple[Path, str],
    listed: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder, storage = split
    temporary = tmp_path_factory.mktemp("temporary")
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    names = _names(storage, "b_9", "b_10", "a_11")
    for name in names:
        _compress(folder / name)
    suffix = ".zstd" if listed == "as it is" else ""
    mode = {"compression_mode": "FILE", "compression_format": "zstd"}
    _describe(folder, *(f"{name}{suffix}" for name in names), storage=storage, **mode)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    recording = find_recording(str(folder))
    assert recording.warnings == ()
    assert [(file.storage, file.compressed) for file in recording.files] == [(storage, True)] * 3
    with recording.open(0) as reader:
        assert reader.path == f"{folder / names[0]}.zstd"
        assert rows_of(reader) == list(ROWS[:10])
        assert len(list(temporary.iterdir())) == 1
    assert _read(folder) == list(ROWS)
    assert list(temporary.iterdir()) == []
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_file_that_rosbag2_has_decompressed_is_taken(split: tuple[Path, str]) -> None:
    folder, storage = split
    names = _names(storage, "b_9", "b_10", "a_11")
    _describe(folder, *(f"{name}.zstd" for name in names), storage=storage, compression_mode="FILE")
    assert _read(folder) == list(ROWS)


@pytest.mark.parametrize("kind", ["metadata.yaml", "in the file"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_compressed_messages_are_decompressed(tmp_path: Path, storage: str, kind: str) -> None:
    compressor = zstandard.ZstdCompressor()
    rows = [*ROWS, Row("/a", 9000, b""), *(Row("/b", 9001 + i, bytes(700_000)) for i in range(4))]
    stored = [row._replace(data=compressor.compress(row.data)) for row in rows]
    path = tmp_path / ("a.db3" if storage == "sqlite3" else "a.mcap")
    metadata = BagMetadata(storage, (path.name,), compression_mode="message", compression_format="zstd")
    if kind == "metadata.yaml":
        (database if storage == "sqlite3" else _mcap)(path, rows=stored)
        (tmp_path / "metadata.yaml").write_text(write_metadata(metadata))
    else:
        text = write_inner_metadata(metadata)
        if storage == "sqlite3":
            database(
                path,
                rows=stored,
                more=f"INSERT INTO metadata VALUES (1, 8, '{text.replace(chr(39), chr(34))}')",
            )
        else:
            messages = [Recorded(row.topic, 0, row.time, row.time, row.data) for row in stored]
            path.write_bytes(
                mcap_file(
                    messages,
                    more=lambda writer: writer.add_metadata("rosbag2", {"serialized_metadata": text}),
                )
            )
    with find_recording(str(path)).open(0) as reader:
        assert rows_of(reader) == rows
        assert sorted(rows_of(reader, in_time_order=True)) == sorted(rows)
        assert rows_of(reader, Selection(start_time=9000, end_time=9002)) == rows[40:42]
        assert max(chunk.size for chunk in reader.chunks()) < 2_000_000


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"no zstd", "error when determining content size"),
        (
            b"\x28\xb5\x2f\xfd\xe0" + b"\xff" * 7 + b"\0" + bytes(4),
            "its size would be",
        ),
        (zstandard.ZstdCompressor().compress(b"text")[:-2], ""),
        (zstandard.ZstdCompressor().compress(b"text") + b"more", ""),
    ],
)
def test_messages_that_cannot_be_decompressed_are_said(tmp_path: Path, data: bytes, expected: str) -> None:
    path = database(
        tmp_path / "a.db3", rows=[Row("/a", 0, zstandard.ZstdCompressor().compress(b"")), Row("/a", 1, data)]
    )
    _describe(tmp_path, "a.db3", compression_mode="MESSAGE", compression_format="zstd")
    reason = f"{path}, table messages, rows 1 to 2: a message of /a, recorded at 1, cannot be decompressed: "
    with pytest.raises(
        BagError, match=f"^{re.escape(reason + expected)}.*; `bag convert .* reads the others$"
    ):
        _read(tmp_path)
    with find_recording(str(tmp_path)).open(0, salvage=True) as reader:
        assert not reader.is_damaged
        assert rows_of(reader) == [Row("/a", 0, b"")]
        assert reader.is_damaged and reader.warnings[0].startswith(reason + expected)


def test_other_compressions_of_messages_are_refused(tmp_path: Path) -> None:
    path = database(tmp_path / "a.db3")
    _describe(tmp_path, "a.db3", compression_mode="MESSAGE", compression_format="lzo")
    with pytest.raises(BagError) as caught:
        _read(tmp_path)
    assert str(caught.value) == f"{path}: its messages are compressed with 'lzo'; only zstd is known"


ZSTD = zstandard.ZstdCompressor().compress(bytes(100_000))
WRONG = {
    "empty": (b"", "empty"),
    "text": (
        b"hello, this is a text",
        "neither MCAP nor sqlite3 nor a ROS 1 bag: it begins with " + b"hello, this is a".hex(" "),
    ),
    "compressed text": (
        zstandard.ZstdCompressor().compress(b"hello"),
        "neither MCAP nor sqlite3 nor a ROS 1 bag: it begins with 68 65 6c 6c 6f",
    ),
    "damaged zstd": (ZSTD[:4] + b"\xff" * 20, "damaged zstd: "),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_recording_is_said(tmp_path: Path, name: str) -> None:
    content, expected = WRONG[name]
    path = tmp_path / "a.db3"
    path.write_bytes(content)
    with pytest.raises(BagError) as caught:
        find_recording(str(path))
    assert str(caught.value).startswith(f"{path}: {expected}")


def test_where_nothing_is_nothing_is_found(tmp_path: Path) -> None:
    for path, expected in (
        (tmp_path / "nothing", "no such file or folder"),
        (tmp_path, "no metadata.yaml that names files, and no .mcap or .db3 or .bag file in it"),
    ):
        with pytest.raises(BagError) as caught:
            find_recording(str(path))
        assert str(caught.value) == f"{path}: {expected}"


def test_metadata_is_no_bag(tmp_path: Path) -> None:
    path = tmp_path / "metadata.yaml"
    path.write_text("rosbag2_bagfile_information: {}")
    with pytest.raises(BagError) as caught:
        find_recording(str(path))
    assert str(caught.value) == f"{path}: describes a bag; name the folder that it is in"


def test_compressed_files_may_have_many_frames(tmp_path: Path) -> None:
    content = database(tmp_path / "a.db3").read_bytes()
    compressor = zstandard.ZstdCompressor()
    frames = [compressor.compress(content[start : start + 1000]) for start in range(0, len(content), 1000)]
    path = tmp_path / "b.db3.zstd"
    path.write_bytes(b"".join(frames))
    assert _read(path) == list(ROWS)


def test_damaged_compressed_files_are_said(tmp_path: Path) -> None:
    path = _compress(database(tmp_path / "a.db3", rows=[Row("/a", 0, random.Random(1).randbytes(300_000))]))
    content = path.read_bytes()
    for damaged, expected in (
        (content[:100], "cut off: nothing in it can be decompressed"),
        (content[:-1], f"cut off: its compressed data does not end at its last byte, {len(content) - 1}"),
        (content + b"more", f"damaged zstd before byte {len(content) + 4}: zstd decompressor error: "),
    ):
        path.write_bytes(damaged)
        with pytest.raises(BagError) as caught:
            _read(path)
        assert str(caught.value).startswith(f"{path}: {expected}")


def test_what_is_before_the_end_of_a_cut_off_file_is_salvaged(tmp_path: Path) -> None:
    rows = [Row("/a", i, random.Random(i).randbytes(50_000)) for i in range(20)]
    path = _compress(database(tmp_path / "a.db3", rows=rows))
    content = path.read_bytes()[:-300_000]
    path.write_bytes(content)
    with find_recording(str(path)).open(0, salvage=True) as reader:
        assert rows_of(reader) == rows[: len(rows_of(reader))]
        assert len(rows_of(reader)) > 5 and reader.is_damaged
        assert reader.warnings[0] == (
            f"{path}: cut off: its compressed data does not end at its last byte, {len(content)}"
        )


def test_what_is_no_file_is_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    os.mkfifo(path)
    with pytest.raises(BagError) as caught:
        find_recording(str(path))
    assert (
        str(caught.value) == f"{path}: neither a file nor a folder, but a pipe or a device; copy it to a file"
    )


def test_a_description_in_a_file_of_a_version_that_is_not_known_is_left_out(tmp_path: Path) -> None:
    path = database(tmp_path / "a.db3", more="INSERT INTO metadata VALUES (1, 10, 'version: 10')")
    with find_recording(str(path)).open(0) as reader:
        assert rows_of(reader) == list(ROWS)
        (warning,) = reader.warnings
    assert warning.startswith(f"{path}, the metadata in it: version: 10 is not known")


def test_a_disk_without_room_for_a_decompressed_file_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _compress(database(tmp_path / "a.db3"))
    monkeypatch.setattr("shutil.disk_usage", lambda path: SimpleNamespace(free=2**26 + 1000))
    with pytest.raises(BagError, match=r"too large to be decompressed in .*; set TMPDIR to a larger disk$"):
        _read(path)


def test_a_full_disk_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = database(tmp_path / "a.db3")
    Path(f"{path}-journal").write_bytes(b"something")

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("shutil.copyfile", full)
    with pytest.raises(BagError) as caught:
        _read(path)
    assert str(caught.value) == f"{path}: cannot be opened: [Errno 28] No space left on device"
