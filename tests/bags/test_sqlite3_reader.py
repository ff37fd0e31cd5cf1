"""Databases of bags: every schema, what is odd, and what is damaged."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto.bags.model import RecordedDefinition, Selection, Topic
from rosidl_adapter_proto.bags.sqlite3_reader import SqliteReader
from rosidl_adapter_proto.bags.storage import CHUNK_SIZE
from rosidl_adapter_proto.errors import BagError
from tests.bags.databases import QOS, ROWS, STRING_HASH, Row, database, rows_of


@pytest.mark.parametrize("schema", [1, 2, 3, 4])
def test_every_schema_is_read(tmp_path: Path, schema: int) -> None:
    with SqliteReader(str(database(tmp_path / "a.db3", schema))) as reader:
        assert reader.topics[1] == Topic(
            "/a",
            "std_msgs/msg/String",
            "cdr",
            definition=(
                RecordedDefinition("ros2msg", b"string data\n") if schema == 4 else RecordedDefinition()
            ),
            schema_name="std_msgs/msg/String",
            type_hash=STRING_HASH if schema == 4 else "",
            qos_profiles=QOS if schema > 1 else "",
        )
        assert reader.statistics.message_counts == {1: 27, 2: 13}
        assert (reader.statistics.start_time, reader.statistics.end_time) == (
            min(row.time for row in ROWS),
            max(row.time for row in ROWS),
        )
        assert rows_of(reader) == list(ROWS)
        assert reader.warnings == []
        assert list(reader.attachments()) == []
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        reader._connection.execute("SELECT 1")


@pytest.mark.parametrize(
    "selection",
    [
        Selection(topic_ids=frozenset({2})),
        Selection(topic_ids=frozenset()),
        Selection(topic_ids=frozenset({1, 7})),
        Selection(start_time=1100),
        Selection(start_time=1100, end_time=1200),
        Selection(topic_ids=frozenset({1}), end_time=1200),
        Selection(start_time=2**64 - 1),
    ],
    ids=str,
)
def test_a_selection_is_read_alone(tmp_path: Path, selection: Selection) -> None:
    with SqliteReader(str(database(tmp_path / "a.db3"))) as reader:
        expected = [
            row
            for row in ROWS
            if (selection.topic_ids is None or {"/a": 1, "/b": 2}[row.topic] in selection.topic_ids)
            and selection.start_time <= row.time < (selection.end_time or 2**64)
        ]
        assert rows_of(reader, selection) == expected
        assert sum(chunk.message_count or 0 for chunk in reader.chunks(selection)) == len(expected)


def test_messages_are_read_in_the_order_of_time(tmp_path: Path) -> None:
    with SqliteReader(str(database(tmp_path / "a.db3"))) as reader:
        in_order = sorted(ROWS, key=lambda row: row.time)
        assert rows_of(reader, in_time_order=True) == in_order
        selection = Selection(frozenset({1}), 1100, 1200)
        expected = [row for row in in_order if row.topic == "/a" and 1100 <= row.time < 1200]
        assert rows_of(reader, selection, in_time_order=True) == expected


def test_chunks_are_bounded_and_say_where_they_are(tmp_path: Path) -> None:
    rows = [Row("/a", i, bytes(CHUNK_SIZE // 4)) for i in range(10)] + [Row("/b", 10, bytes(3 * CHUNK_SIZE))]
    path = database(tmp_path / "a.db3", rows=rows)
    with SqliteReader(str(path)) as reader:
        chunks = list(reader.chunks())
    assert [(chunk.message_count, chunk.start_time, chunk.end_time) for chunk in chunks] == [
        (4, 0, 3),
        (4, 4, 7),
        (3, 8, 10),
    ]
    assert chunks[1].where == f"{path}, table messages, rows 5 to 8"


def test_topic_ids_that_no_chunk_can_hold_become_others(tmp_path: Path) -> None:
    more = "UPDATE topics SET id = -5 WHERE id = 1; UPDATE topics SET id = 5000000000 WHERE id = 2;"
    more += "UPDATE messages SET topic_id = -5 WHERE topic_id = 1;"
    more += "UPDATE messages SET topic_id = 5000000000 WHERE topic_id = 2;"
    with SqliteReader(str(database(tmp_path / "a.db3", more=more))) as reader:
        assert [topic.name for topic in reader.topics.values()] == ["/a", "/b"]
        assert rows_of(reader) == list(ROWS)
        assert rows_of(reader, Selection(frozenset({2}))) == [row for row in ROWS if row.topic == "/b"]
        assert reader.statistics.message_counts == {1: 27, 2: 13}


def test_definitions_are_found_and_kept_as_they_are(tmp_path: Path) -> None:
    more = """
    INSERT INTO topics VALUES (3, '/s/_service_event', 'p/srv/S_Event', 'cdr', '', '');
    INSERT INTO topics VALUES (4, '/f/_action/feedback', 'p/action/F_FeedbackMessage', 'cdr', '', '');
    INSERT INTO topics VALUES (5, '/u', 'p/msg/U', 'cdr', '', '');
    INSERT INTO topics VALUES (6, '/l', 'p/msg/L', 'cdr', '', '');
    INSERT INTO message_definitions VALUES (2, 'p/srv/S', 'ros2msg', 'bool a' || char(10) || '---', '');
    INSERT INTO message_definitions VALUES (3, 'p/action/F', 'ros2idl', 'idl', '');
    INSERT INTO message_definitions VALUES (4, 'p/msg/U', 'unknown', '', '');
    INSERT INTO message_definitions VALUES (5, 'p/msg/L', 'ros2msg', CAST(x'2320b0' AS TEXT), '');
    """
    with SqliteReader(str(database(tmp_path / "a.db3", more=more))) as reader:
        assert [reader.topics[topic_id].definition for topic_id in (3, 4, 5, 6)] == [
            RecordedDefinition("ros2msg", b"bool a\n---"),
            RecordedDefinition("ros2idl", b"idl"),
            RecordedDefinition(),
            RecordedDefinition("ros2msg", b"# \xb0"),
        ]


def test_names_of_qos_policies_become_numbers(tmp_path: Path) -> None:
    more = "UPDATE topics SET offered_qos_profiles = '- history: keep_last\n  depth: 7\n  reliability: best_effort'"
    with SqliteReader(str(database(tmp_path / "a.db3", more=more))) as reader:
        assert reader.topics[1].qos_profiles == "- history: 1\n  depth: 7\n  reliability: 2"


def test_what_rosbag2_says_of_the_bag_is_kept_with_the_newest_last(tmp_path: Path) -> None:
    more = "INSERT INTO metadata VALUES (1, 8, 'old'); INSERT INTO metadata VALUES (2, 8, 'new');"
    with SqliteReader(str(database(tmp_path / "a.db3", more=more))) as reader:
        assert reader.metadata == [
            ("rosbag2", {"serialized_metadata": "old"}),
            ("rosbag2", {"serialized_metadata": "new"}),
        ]


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("mode", ["delete", "wal"])
def test_nothing_is_written_beside_a_database(tmp_path: Path, mode: str) -> None:
    path = database(tmp_path / "a b%20?#.db3", more=f"PRAGMA journal_mode = {mode};")
    before = _files(tmp_path)
    with SqliteReader(str(path)) as reader:
        assert rows_of(reader) == list(ROWS)
        assert _files(tmp_path) == before
    assert _files(tmp_path) == before


def _killed(folder: Path, mode: str) -> Path:
    """Return a database whose recorder was killed, with what it left beside it."""
    writing = database(folder / "writing.db3", rows=ROWS[:20])
    connection = sqlite3.connect(writing, isolation_level=None)
    connection.executescript(
        f"PRAGMA journal_mode = {mode}; PRAGMA cache_size = 1; PRAGMA wal_autocheckpoint = 0;"
    )
    connection.execute("BEGIN")
    connection.executemany(
        "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)",
        [
            (("/a", "/b").index(row.topic) + 1, row.time, row.data)
            for row in ROWS[20:] * (1 if mode == "wal" else 500)
        ],
    )
    if mode == "wal":
        connection.execute("COMMIT")
    (folder / "killed").mkdir()
    for suffix in ("", "-wal", "-journal"):
        if Path(f"{writing}{suffix}").exists():
            shutil.copyfile(f"{writing}{suffix}", folder / "killed" / f"a.db3{suffix}")
    connection.close()
    return folder / "killed" / "a.db3"


@pytest.mark.parametrize(
    ("mode", "beside", "rows"), [("wal", "a.db3-wal", ROWS), ("delete", "a.db3-journal", ROWS[:20])]
)
def test_what_a_killed_recorder_left_beside_its_database_is_honoured(
    tmp_path: Path, mode: str, beside: str, rows: tuple[Row, ...]
) -> None:
    path = _killed(tmp_path, mode)
    before = _files(path.parent)
    with SqliteReader(str(path)) as reader:
        assert rows_of(reader) == list(rows)
        assert reader.warnings == [
            f"{path}: its recorder did not finish; {beside} beside it was read too, from a copy"
        ]
    assert _files(path.parent) == before


def test_a_link_to_a_database_leads_to_what_lies_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "link.db3"
    path.symlink_to(_killed(tmp_path, "wal"))
    with SqliteReader(str(path)) as reader:
        assert rows_of(reader) == list(ROWS)


WRONG = {
    "data missing": (
        "UPDATE messages SET data = NULL WHERE id = 7",
        "table messages, row 7: data is missing, not bytes; 6 messages before it were read",
    ),
    "data a number": (
        "UPDATE messages SET data = 1.5 WHERE id = 7",
        "table messages, row 7: data is 1.5, not bytes; 6 messages before it were read",
    ),
    "time a text": (
        "UPDATE messages SET timestamp = 'noon' WHERE id = 1",
        "table messages, row 1: timestamp b'noon' is not a time in nanoseconds since 1970; "
        "0 messages before it were read",
    ),
    "time negative": (
        "UPDATE messages SET timestamp = -1 WHERE id = 40",
        "table messages, row 40: timestamp -1 is not a time in nanoseconds since 1970; 39 messages before it were read",
    ),
    "topic not listed": (
        "UPDATE messages SET topic_id = 9 WHERE id = 2",
        "table messages, row 2: topic_id 9 is not in the table topics; 1 messages before it were read",
    ),
    "name not UTF-8": (
        "UPDATE topics SET name = CAST(x'2f61ff' AS TEXT) WHERE id = 2",
        "table topics, row 2, name: not UTF-8 at byte 2",
    ),
    "name missing": (
        "UPDATE topics SET name = NULL WHERE id = 1",
        "table topics, row 1, name: expected a text, not None",
    ),
    "no definition": (
        "UPDATE message_definitions SET encoded_message_definition = NULL",
        "table message_definitions, row 1: expected bytes, not None",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_row(tmp_path: Path, name: str) -> None:
    statement, expected = WRONG[name]
    path = database(tmp_path / "a.db3")
    with sqlite3.connect(path) as connection:  # as no recorder would have made it
        connection.executescript(
            "PRAGMA writable_schema = 1; UPDATE sqlite_master SET sql = replace(sql, ' NOT NULL', '')"
        )
    connection.close()
    with sqlite3.connect(path) as connection:
        connection.execute(statement)
    connection.close()
    with pytest.raises(BagError) as caught, SqliteReader(str(path)) as reader:
        rows_of(reader)
    assert str(caught.value) == f"{path}: {expected}"


def test_rows_that_are_wrong_are_left_out_to_salvage_a_database(tmp_path: Path) -> None:
    wrong = (
        "UPDATE messages SET timestamp = -1 WHERE id IN (3, 5); UPDATE messages SET topic_id = 9 WHERE id = 7"
    )
    path = database(tmp_path / "a.db3", more=wrong)
    with SqliteReader(str(path), salvage=True) as reader:
        assert not reader.is_damaged
        assert rows_of(reader) == [row for number, row in enumerate(ROWS, 1) if number not in (3, 5, 7)]
        assert reader.statistics.message_count == len(ROWS) - 1
        assert reader.is_damaged
        assert reader.warnings == [
            f"{path}: table messages, row 3: timestamp -1 is not a time in nanoseconds since 1970; it is left out, "
            f"and 2 that are wrong up to row {len(ROWS)}",
            f"{path}: table messages: topic_id 9 is not in the table topics; 1 rows are left out",
        ]


def test_messages_of_topics_that_are_not_listed_are_not_counted_silently(tmp_path: Path) -> None:
    path = database(tmp_path / "a.db3", more="DELETE FROM topics WHERE id = 2")
    with SqliteReader(str(path)) as reader, pytest.raises(BagError) as caught:
        reader.statistics  # noqa: B018
    assert str(caught.value) == f"{path}: table messages: topic_id 2 is not in the table topics"


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no such file"),
        (b"SQLite format 3\0" + bytes(100), "no sqlite3 database"),
        (b"something else, and long enough to be looked at" * 20, "no sqlite3 database"),
    ],
)
def test_what_is_no_database_is_refused(tmp_path: Path, content: bytes | None, expected: str) -> None:
    path = tmp_path / "a.db3"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BagError) as caught:
        SqliteReader(str(path))
    assert str(caught.value) == f"{path}: {expected}"


def test_other_databases_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY)")
    connection.close()
    with pytest.raises(BagError) as caught:
        SqliteReader(str(path))
    assert (
        str(caught.value) == f"{path}: a sqlite3 database, but no bag: it has no tables topics and messages"
    )


LARGE_ROWS = tuple(Row("/a", row, f"message {row} ".encode().ljust(500)) for row in range(1, 2001))


def _damaged(path: Path) -> tuple[Path, list[int]]:
    """Return a database with two pages of messages overwritten, and the rows that were there."""
    content = bytearray(database(path, rows=LARGE_ROWS).read_bytes())
    lost: list[int] = []
    for page in (100, 180):
        place = slice(4096 * page, 4096 * page + 4096)
        lost += [row for row in range(1, 2001) if f"message {row} ".encode() in content[place]]
        content[place] = b"\xff" * 4096
    path.write_bytes(content)
    return path, lost


def test_damaged_pages_are_an_error_that_says_how_far_it_got(tmp_path: Path) -> None:
    path, lost = _damaged(tmp_path / "a.db3")
    with SqliteReader(str(path)) as reader, pytest.raises(BagError) as caught:
        rows_of(reader)
    first = lost[0] - 1  # sqlite3 of Python looks ahead
    reason = (
        f"sqlite3 says: database disk image is malformed; {first - 1} messages before it were read, and `bag convert "
        "--on-error skip`, elsewhere `--salvage`, reads all that is whole"
    )
    assert str(caught.value) == f"{path}: table messages, from row {first} on: {reason}"


def test_a_damaged_database_is_salvaged(tmp_path: Path) -> None:
    path, lost = _damaged(tmp_path / "a.db3")
    with SqliteReader(str(path), salvage=True) as reader:
        assert rows_of(reader) == [row for row in LARGE_ROWS if row.time not in lost]
        assert len(lost) == 14
        assert reader.warnings == [
            f"{path}: table messages, rows {first} to {first + 6} are left out: "
            "sqlite3 says: database disk image is malformed"
            for first in (lost[0], lost[7])
        ]
        assert reader.statistics.message_count == 1986


def test_a_database_that_lost_its_end_is_salvaged(tmp_path: Path) -> None:
    path = database(tmp_path / "a.db3", rows=LARGE_ROWS)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2 + 100])
    with pytest.raises(BagError) as caught:
        SqliteReader(str(path))
    assert str(caught.value) == (
        f"{path}: sqlite3 says: database disk image is malformed; `bag convert --on-error skip`, "
        "elsewhere `--salvage`, reads what is whole"
    )
    with SqliteReader(str(path), salvage=True) as reader:
        rows = rows_of(reader)
        assert len(rows) > 500 and rows == list(LARGE_ROWS[: len(rows)]) and reader.is_damaged
        assert reader.statistics.message_count == len(rows)
        assert reader.warnings == [
            f"{path}: cut off in the page of 4096 bytes that is its last; it is left out",
            f"{path}: table messages, rows {len(rows) + 1} on are left out: "
            "sqlite3 says: database disk image is malformed",
        ]


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return database(tmp_path_factory.mktemp("sample") / "a.db3", rows=ROWS[:8])


@given(
    changes=st.lists(st.tuples(st.integers(0, 28671), st.integers(0, 255)), min_size=1, max_size=12),
    cut=st.integers(0, 28672) | st.none(),
    salvage=st.booleans(),
)
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_databases_raise_nothing_else(
    sample: Path, tmp_path: Path, changes: list[tuple[int, int]], cut: int | None, salvage: bool
) -> None:
    content = bytearray(sample.read_bytes())
    for place, value in changes:
        content[place % len(content)] = value
    path = tmp_path / "a.db3"
    path.write_bytes(content[:cut])
    try:
        with SqliteReader(str(path), salvage=salvage) as reader:
            assert len(rows_of(reader)) <= 8
            assert reader.statistics.message_count >= 0
    except BagError:
        pass
