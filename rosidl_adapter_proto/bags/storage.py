"""What every storage can do: one file of a recording is read by a reader, and written by a writer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from rosidl_adapter_proto.bags.model import EVERYTHING, Attachment, Selection, Statistics, StoredChunk, Topic

if TYPE_CHECKING:
    from typing_extensions import Buffer

MCAP = "mcap"
SQLITE3 = "sqlite3"
ROSBAG = "rosbag_v2"
"""The storages that are read, by their names in rosbag2; the last is ROS 1."""

SUFFIXES: Mapping[str, str] = {".mcap": MCAP, ".db3": SQLITE3, ".bag": ROSBAG}
"""The storages by what the names of their files end with."""

WRITTEN_SUFFIXES: Mapping[str, str] = {MCAP: ".mcap", SQLITE3: ".db3"}
"""What the names of files end with, by the storages that are written."""

SALVAGE = "`bag convert --on-error skip`, elsewhere `--salvage`, reads"
"""What errors advise where there is something left to read, for people."""

CHUNK_SIZE = 2**20
"""About how many bytes of messages make a chunk, where the storage has none."""

MAXIMUM_CHUNK_SIZE = 2**32 - 1
"""The largest chunk that is read, in bytes: what a file says is not believed before memory is taken for it."""


class StorageReader(Protocol):
    """One file of a recording, open for reading. It is a context manager that closes the file.

    Attributes:
        path: The file, for people.
        storage: The name of the storage in rosbag2, such as `mcap`.
        topics: The topics by the ids that messages in the chunks have.
        statistics: What the storage itself says of how much it has: for a file without a summary, counted.
        metadata: Whatever else the storage keeps, by name, such as what rosbag2 and a recorder wrote about the bag.
        warnings: What is odd about the file, for people, such as that it has no summary. Reading chunks may add to it.
        is_damaged: Whether `warnings` has something that could not be read. Reading chunks may find it.
    """

    @property
    def path(self) -> str: ...
    @property
    def storage(self) -> str: ...
    @property
    def topics(self) -> Mapping[int, Topic]: ...
    @property
    def statistics(self) -> Statistics: ...
    @property
    def metadata(self) -> Sequence[tuple[str, Mapping[str, str]]]: ...
    @property
    def warnings(self) -> Sequence[str]: ...
    @property
    def is_damaged(self) -> bool: ...

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files inside it, one at a time, since they may be large."""

    def chunks(
        self, selection: Selection = EVERYTHING, *, in_time_order: bool = False
    ) -> Iterator[StoredChunk]:
        """Yield the chunks that may have messages of a selection, in the order of the file.

        With `in_time_order` they come in the order of their start times, and may still overlap.

        A chunk may have other messages as well: `read_records` and `RecordConverter` leave them out. What is in it is
        checked when it is decompressed and walked, by `records_of` and them: of a damaged file that is salvaged, what
        is wrong with the inside of a chunk is for the caller to note.

        Raises:
            BagError: The file is damaged, and not to be salvaged; the message says where. The last that is checked is
                how many chunks and messages there were, when all have been yielded.
        """

    def __enter__(self) -> StorageReader: ...
    def __exit__(self, *exception: object) -> None: ...


class StorageWriter(Protocol):
    """One file of a recording, open for writing. It is a context manager that closes the file, finished or not.

    Attributes:
        path: The file, for people.
        storage: The name of the storage in rosbag2, such as `mcap`.
        statistics: What was written so far.
    """

    path: str
    storage: str

    @property
    def statistics(self) -> Statistics: ...

    def add_topic(self, topic: Topic, topic_id: int | None = None) -> int:
        """Add a topic, and return the id that its messages in the chunks must have: by default the next one."""

    def pack(self, records: Buffer) -> PackedChunk:
        """Return a chunk ready to be written: indexed and compressed. It may be called on any thread.

        Args:
            records: Messages, as `RecordConverter` or `pack_records` made them.
        """

    def write(self, chunk: PackedChunk) -> None:
        """Write a chunk, on the thread of the file."""

    def add_attachment(self, attachment: Attachment) -> None:
        """Write a file; a storage that has no room for them says so with a BagError."""

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write whatever else the storage keeps by name; a storage without room for it says so with a BagError."""

    def finish(self) -> None:
        """Write what belongs at the end of the file, and close it."""

    def __enter__(self) -> StorageWriter: ...
    def __exit__(self, *exception: object) -> None: ...


class PackedChunk(Protocol):
    """What `StorageWriter.pack` returns: only the writer that made it knows what it is."""

    @property
    def message_count(self) -> int:
        """How many messages it has."""
