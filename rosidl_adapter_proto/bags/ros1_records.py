"""The records of ROS 1 bags (http://wiki.ros.org/Bags/Format/2.0): each a header of named fields, and data."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from rosidl_adapter_proto.errors import BagError

_MAXIMUM_HEADER_SIZE = 2**20


class Operation(enum.IntEnum):
    """What a record is."""

    MESSAGE = 2
    BAG = 3
    INDEX = 4
    CHUNK = 5
    CHUNK_INFO = 6
    CONNECTION = 7


@dataclass(frozen=True)
class Source:
    """What records are read from: a file, or a chunk that is not compressed.

    Attributes:
        where: What it is, for people.
        size: Its size in bytes.
        read: Returns a piece of it, by its start and size, which are inside.
    """

    where: str
    size: int
    read: Callable[[int, int], memoryview] = field(repr=False)

    def records(self, start: int) -> Iterator[Record]:
        """Yield the records from a place on."""
        while start < self.size:
            record = self.record(start)
            yield record
            start = record.start + record.size

    def record(self, start: int) -> Record:
        """Return the record at a place."""
        header_size = self._size_at(start, start)
        if header_size > _MAXIMUM_HEADER_SIZE:
            raise BagError(
                f"{self.where} at byte {start}: damaged: the header of a record has {header_size} bytes"
            )
        data_start = start + 4 + header_size + 4
        size = self._size_at(data_start - 4, start)
        self._check(data_start + size, start)
        fields = read_fields(self.read(start + 4, header_size), f"{self.where} at byte {start}")
        operation = fields.get(b"op", b"")
        if len(operation) != 1:
            raise BagError(f"{self.where} at byte {start}: damaged: a record that does not say what it is")
        return Record(self, start, operation[0], fields, data_start, size)

    def _size_at(self, place: int, record: int) -> int:
        self._check(place + 4, record)
        return int.from_bytes(self.read(place, 4), "little")

    def _check(self, end: int, record: int) -> None:
        missing = end - self.size
        if missing > 0:
            raise BagError(
                f"{self.where} at byte {record}: cut off: at least {missing} bytes of a record are missing"
            )


@dataclass(frozen=True)
class Record:
    """A record.

    Attributes:
        source: What it is in.
        place: Where it begins.
        operation: What it is: an `Operation`, unless it is unknown.
        fields: The fields of its header.
        start: Where its data begins.
        size: The size of its data in bytes.
    """

    source: Source
    place: int
    operation: int
    fields: Mapping[bytes, bytes] = field(repr=False)
    start: int
    size: int

    @property
    def where(self) -> str:
        """Its place, for people."""
        return f"{self.source.where} at byte {self.place}"

    def data(self) -> memoryview:
        """Return its data."""
        return self.source.read(self.start, self.size)

    def number(self, name: bytes, size: int = 4) -> int:
        """Return a field that is a number of some bytes."""
        value = self.fields.get(name, b"")
        if len(value) != size:
            raise BagError(f"{self.where}: damaged: {name.decode()} has {len(value)} bytes instead of {size}")
        return int.from_bytes(value, "little")

    def time(self, name: bytes) -> int:
        """Return a field that is a time, in nanoseconds."""
        value = self.number(name, 8)
        return (value & 0xFFFFFFFF) * 1_000_000_000 + (value >> 32)


def read_fields(data: memoryview, where: str) -> dict[bytes, bytes]:
    """Return the named values of a header, or of what has the same form."""
    header = bytes(data)
    fields: dict[bytes, bytes] = {}
    start = 0
    while start < len(header):
        end = start + 4 + int.from_bytes(header[start : start + 4], "little")
        name, equals, value = header[start + 4 : end].partition(b"=")
        if end > len(header) or not equals:
            raise BagError(f"{where}: damaged: byte {start} of a header is no field")
        fields[name] = value
        start = end
    return fields
