"""The sqlite3 storage of rosbag2, reading: `.db3` files of schemas 1 to 4.

Schema 1 has the tables `topics` and `messages`; 2 adds QoS profiles, 3 the tables `schema` and `metadata`, 4 message
definitions and type hashes (`rosbag2_storage_sqlite3/sqlite_storage.cpp`). Which columns there are is looked up, since
files in the wild mix them. Protobuf bags have a table of our own, `protobuf_descriptors`.
"""

from __future__ import annotations

import sqlite3
from array import array
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from functools import cached_property
from typing import Any, TypeAlias

from rosidl_adapter_proto.bags.metadata import ROSBAG2, SERIALIZED_METADATA
from rosidl_adapter_proto.bags.model import (
    EVERYTHING,
    PROTOBUF,
    Attachment,
    RecordedDefinition,
    Selection,
    Statistics,
    StoredChunk,
    Topic,
)
from rosidl_adapter_proto.bags.qos import numbered_qos
from rosidl_adapter_proto.bags.sqlite3_database import open_database, reason_of
from rosidl_adapter_proto.bags.storage import CHUNK_SIZE, SALVAGE, SQLITE3
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import pack_records

_Row: TypeAlias = tuple[Any, ...]  # a row of messages: id, topic_id, timestamp and data, of whatever type

MAXIMUM_TOPIC_ID = 2**16 - 1
_ROW_SIZE = 64  # bytes of a row beside its message, about
_FIRST_ROW, _LAST_ROW = -(2**63), 2**63 - 1
_ERRORS = (sqlite3.Error, UnicodeDecodeError)  # the latter for names of columns
_DEFINITIONS = "message_definitions"
_DESCRIPTORS = "protobuf_descriptors"


class SqliteReader:
    """A `.db3` file, open for reading; see `StorageReader`. The file is never changed.

    Args:
        file_path: The file.
        path: What to call it, for people, if that is another name.
        salvage: Read on after damaged pages, and say so in `warnings`, instead of raising an error.

    Raises:
        BagError: It is no sqlite3 database, or none of rosbag2.
    """

    storage = SQLITE3

    def __init__(self, file_path: str, path: str = "", *, salvage: bool = False) -> None:
        self.path = path = path or file_path
        self.warnings = WarningList()
        self._salvage = salvage
        with ExitStack() as stack:
            database = open_database(file_path, path, salvage, stack)
            self._connection = database.connection
            if database.warning:
                self.warnings.add(database.warning)
            self.is_damaged = database.is_cut_off
            self._columns = {table: self._column_names(table) for table in self._tables()}
            if not {"topics", "messages"} <= self._columns.keys():
                raise BagError(
                    f"{path}: a sqlite3 database, but no bag: it has no tables topics and messages"
                )
            self._topic_ids, self.topics = self._read_topics()
            self.metadata = self._read_metadata()
            self._stack = stack.pop_all()

    def __enter__(self) -> SqliteReader:
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()

    @cached_property
    def statistics(self) -> Statistics:
        """What is in the file, counted: a database does not keep it."""
        query = "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY topic_id"
        try:
            groups = self._query(query)
        except BagError:
            if not self._salvage:
                raise
            groups = [(row[1], 1, row[2], row[2]) for rows in self._batches(EVERYTHING) for row in rows]
        counts = dict.fromkeys(self.topics, 0)
        for topic, count, _, _ in groups:
            if topic in self._topic_ids:
                counts[self._topic_ids[topic]] += count
            else:
                reason = f"{self.path}: table messages: topic_id {topic!r} is not in the table topics"
                self._damaged(reason, f"{reason}; {count} rows are left out")
        times = [time for group in groups for time in group[2:] if isinstance(time, int) and time >= 0]
        return Statistics(counts, min(times, default=0), max(times, default=0))

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: a database has no room for them."""
        return iter(())

    def chunks(
        self, selection: Selection = EVERYTHING, *, in_time_order: bool = False
    ) -> Iterator[StoredChunk]:
        """Yield the messages of a selection as chunks of about `CHUNK_SIZE` bytes; see `StorageReader.chunks`.

        Raises:
            BagError: A row is not what it should be, or the database is damaged; the message says where.
        """
        done = 0
        salvaged = self._salvage and in_time_order
        for rows in self._sorted(selection) if salvaged else self._batches(selection, in_time_order):
            yield from self._chunk(rows, done)
            done += len(rows)

    def _query(self, query: str) -> list[tuple[Any, ...]]:
        try:
            return self._connection.execute(query).fetchall()
        except _ERRORS as error:
            advice = f"; {SALVAGE} what is whole" if "malformed" in str(error) else ""
            raise BagError(f"{self.path}: {reason_of(error)}{advice}") from None

    def _tables(self) -> list[str]:
        names = [name for (name,) in self._query("SELECT name FROM sqlite_master WHERE type = 'table'")]
        return [name.decode(errors="replace") for name in names if name and b'"' not in name]

    def _column_names(self, table: str) -> list[str]:
        return [row[1].decode(errors="replace") for row in self._query(f'PRAGMA table_info("{table}")')]

    def _texts(self, table: str, *columns: str) -> Iterator[tuple[Any, ...]]:
        """Yield the ids and some columns of a table; columns that this schema has not are empty."""
        present = self._columns.get(table, [])
        if not present:
            return
        chosen = ", ".join(name if name in present else "''" for name in columns)
        for row, *values in self._query(f"SELECT rowid, {chosen} FROM {table} ORDER BY rowid"):
            yield row, *(
                self._text(value, table, row, name) for name, value in zip(columns, values, strict=True)
            )

    def _text(self, value: object, table: str, row: int, column: str) -> str:
        where = f"{self.path}: table {table}, row {row}, {column}"
        if not isinstance(value, bytes):
            raise BagError(f"{where}: expected a text, not {value!r}")
        try:
            return value.decode()
        except UnicodeDecodeError as error:
            raise BagError(f"{where}: not UTF-8 at byte {error.start}") from None

    def _bytes(self, value: object, table: str, row: int) -> bytes:
        if not isinstance(value, bytes):
            raise BagError(f"{self.path}: table {table}, row {row}: expected bytes, not {value!r}")
        return value

    def _read_topics(self) -> tuple[dict[int, int], Mapping[int, Topic]]:
        columns = ("name", "type", "serialization_format", "offered_qos_profiles", "type_description_hash")
        rows = list(self._texts("topics", *columns))
        if len(rows) > MAXIMUM_TOPIC_ID:
            raise BagError(
                f"{self.path}: {len(rows)} topics; at most {MAXIMUM_TOPIC_ID} are possible in a file"
            )
        # A chunk has 16 bits for it; the table has 64.
        fitting = all(0 < row[0] <= MAXIMUM_TOPIC_ID for row in rows)
        topic_ids = {row[0]: row[0] if fitting else number for number, row in enumerate(rows, start=1)}
        definitions = self._definitions()
        descriptors = self._descriptors()
        return topic_ids, {topic_ids[row[0]]: _topic(row[1:], definitions, descriptors) for row in rows}

    def _definitions(self) -> dict[str, RecordedDefinition]:
        names = {
            row: (name, encoding)
            for row, name, encoding in self._texts(_DEFINITIONS, "topic_type", "encoding")
        }
        texts = self._query(f"SELECT rowid, encoded_message_definition FROM {_DEFINITIONS}") if names else ()
        return {
            names[row][0]: RecordedDefinition(names[row][1], self._bytes(text, _DEFINITIONS, row))
            for row, text in texts
            if names[row][1] not in ("", "unknown")  # rosbag2 did not find the definition
        }

    def _descriptors(self) -> dict[str, tuple[str, RecordedDefinition]]:
        names = {
            row: (name, full_name)
            for row, name, full_name in self._texts(_DESCRIPTORS, "topic_type", "full_name")
        }
        sets = self._query(f"SELECT rowid, descriptor_set FROM {_DESCRIPTORS}") if names else ()
        return {
            names[row][0]: (names[row][1], RecordedDefinition(PROTOBUF, self._bytes(data, _DESCRIPTORS, row)))
            for row, data in sets
        }

    def _read_metadata(self) -> list[tuple[str, Mapping[str, str]]]:
        """Return what rosbag2 wrote about the bag, the newest last, by the names that it has for that in MCAP."""
        return [(ROSBAG2, {SERIALIZED_METADATA: text}) for _, text in self._texts("metadata", "metadata")]

    def _selecting(self, selection: Selection, in_time_order: bool) -> tuple[str, list[int]]:
        """Return the query for the messages of a selection, and its values after the first, which is a row to begin at.

        A plus keeps sqlite from sorting whole messages by the index of times.
        """
        time = "timestamp" if in_time_order else "+timestamp"
        conditions = ["id >= ?"]
        values: list[int] = []
        if selection.topic_ids is not None:
            rows = [str(row) for row, topic_id in self._topic_ids.items() if topic_id in selection.topic_ids]
            conditions.append(f"topic_id IN ({', '.join(rows)})")
        if selection.start_time:
            conditions.append(f"{time} >= ?")
            values.append(min(selection.start_time, _LAST_ROW))
        if selection.end_time is not None:
            conditions.append(f"{time} < ?")
            values.append(min(selection.end_time, _LAST_ROW))
        order = "timestamp, id" if in_time_order else "id"
        where = " AND ".join(conditions)
        return f"SELECT id, topic_id, timestamp, data FROM messages WHERE {where} ORDER BY {order}", values

    def _sorted(self, selection: Selection) -> Iterator[list[_Row]]:
        """Yield the rows of a damaged file in the order of the times at which batches of them begin.

        What is whole is found in the order of the table, and then read again.
        """
        query, values = self._selecting(selection, in_time_order=False)
        batches = [
            (min((row[2] for row in rows if isinstance(row[2], int)), default=0), rows[0][0], len(rows))
            for rows in self._batches(selection)
        ]
        for _, first, count in sorted(batches):
            yield self._connection.execute(f"{query} LIMIT {count}", [first, *values]).fetchall()

    def _batches(self, selection: Selection, in_time_order: bool = False) -> Iterator[list[_Row]]:
        """Yield the rows of a selection; in the order of the table, damaged ones are left out to salvage a file."""
        query, values = self._selecting(selection, in_time_order)
        first = _FIRST_ROW
        done = 0
        while True:
            rows: list[_Row] = []
            size = 0
            try:
                for row in self._connection.execute(query, [first, *values]):
                    rows.append(row)
                    size += _ROW_SIZE + (len(row[3]) if isinstance(row[3], bytes) else 0)
                    if size >= CHUNK_SIZE:
                        yield rows
                        done += len(rows)
                        first = row[0] + 1
                        rows = []
                        size = 0
            except _ERRORS as error:
                reason = reason_of(error)
            else:
                reason = ""
            if rows:
                yield rows
                done += len(rows)
                first = rows[-1][0] + 1
            if not reason:
                return
            if not self._salvage:
                where = f"{self.path}: table messages, from row {first} on"
                raise BagError(
                    f"{where}: {reason}; {done} messages before it were read, and {SALVAGE} all that is whole"
                )
            row = self._first_row(query, first, values)
            if row:  # Python asks for the row after a good one before it gives that
                yield [row]
                done += 1
                first = row[0] + 1
                continue
            skipped = self._damaged_rows(query, first, values)
            last = f"to {first + skipped - 1}" if skipped else "on"
            self._note(f"{self.path}: table messages, rows {first} {last} are left out: {reason}")
            if not skipped:
                return
            first += skipped

    def _damaged_rows(self, query: str, first: int, values: list[int]) -> int:
        """Return how many row numbers from one on cannot be read; 0 for all."""
        step = 1
        while not self._first_row(query, first + step, values):
            step *= 2
            if first + step > _LAST_ROW:
                return 0
        unreadable = step // 2
        while step - unreadable > 1:
            middle = (step + unreadable) // 2
            if self._first_row(query, first + middle, values):
                step = middle
            else:
                unreadable = middle
        return step

    def _first_row(self, query: str, first: int, values: list[int]) -> _Row | None:
        """Return the first row from one on; None if it cannot be read, or there is none."""
        try:
            found: _Row | None = self._connection.execute(f"{query} LIMIT 1", [first, *values]).fetchone()
        except _ERRORS:
            return None
        return found

    def _chunk(self, rows: list[_Row], done: int) -> Iterator[StoredChunk]:
        """Yield a chunk of some rows, if there are any but wrong ones."""
        where = f"{self.path}, table messages, rows {rows[0][0]} to {rows[-1][0]}"
        try:
            chunk = self._packed(rows, where)
        except (TypeError, OverflowError, KeyError):
            wrong = {index: reason for index, row in enumerate(rows) if (reason := self._reason_against(row))}
            first, reason = next(iter(wrong.items()))
            reason = f"{self.path}: table messages, row {rows[first][0]}: {reason}"
            rest = "" if len(wrong) == 1 else f", and {len(wrong) - 1} that are wrong up to row {rows[-1][0]}"
            self._damaged(
                f"{reason}; {done + first} messages before it were read", f"{reason}; it is left out{rest}"
            )
            rows = [row for index, row in enumerate(rows) if index not in wrong]
            if not rows:
                return
            chunk = self._packed(rows, where)
        yield chunk

    def _packed(self, rows: list[_Row], where: str) -> StoredChunk:
        _, topics, times, messages = zip(*rows, strict=True)
        log_times = array("Q", times)
        topic_ids = array("H", [self._topic_ids[topic] for topic in topics])
        data = pack_records(topic_ids, array("I", bytes(4 * len(rows))), log_times, log_times, messages)
        return StoredChunk(where, data, "", len(data), 0, min(log_times), max(log_times), len(rows))

    def _reason_against(self, row: _Row) -> str:
        """Return what is wrong with a row; empty if nothing is."""
        _, topic, time, data = row
        if topic not in self._topic_ids:
            return f"topic_id {topic!r} is not in the table topics"
        if not isinstance(time, int) or time < 0:
            return f"timestamp {time!r} is not a time in nanoseconds since 1970"
        if not isinstance(data, bytes):
            return f"data is {'missing' if data is None else repr(data)}, not bytes"
        return ""

    def _damaged(self, reason: str, warning: str) -> None:
        """Raise an error, unless what can be read is to be read: then note it."""
        if not self._salvage:
            raise BagError(reason)
        self._note(warning)

    def _note(self, warning: str) -> None:
        self.is_damaged = True
        self.warnings.add(warning)


def definition_names(type_name: str) -> list[str]:
    """Return the names under which a definition may be: that of a service event is that of its service, by its name."""
    names = [type_name]
    if "/srv/" in type_name or "/action/" in type_name:
        while "_" in names[-1].rsplit("/", 1)[1]:
            names.append(names[-1].rsplit("_", 1)[0])
    return names


def _topic(
    values: tuple[str, ...],
    definitions: Mapping[str, RecordedDefinition],
    descriptors: Mapping[str, tuple[str, RecordedDefinition]],
) -> Topic:
    name, type_name, serialization_format, qos_profiles, type_hash = values
    names = [name for name in definition_names(type_name) if name in definitions]
    definition = definitions[names[0]] if names else RecordedDefinition()
    schema_name, descriptor = descriptors.get(type_name, ("", RecordedDefinition()))
    protobuf = serialization_format == PROTOBUF
    return Topic(
        name=name,
        type_name=type_name,
        serialization_format=serialization_format,
        definition=descriptor if protobuf else definition,
        ros_definition=definition if protobuf else RecordedDefinition(),
        schema_name=schema_name if protobuf else type_name,
        type_hash=type_hash,
        qos_profiles=numbered_qos(qos_profiles),
    )
