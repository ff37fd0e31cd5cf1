"""What a conversion of a bag is told, and what it tells: plain data, which can be sent to other processes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

from rosidl_adapter_proto.bags.model import CDR, PROTOBUF, message_place
from rosidl_adapter_proto.converters import ConverterRegistry
from rosidl_adapter_proto.transcode.records import KEPT_FAILURES

DEFAULT_FORMATS = {PROTOBUF: CDR}
"""What a serialization format is converted to if nobody says; that of others is protobuf."""

SHOWN_FAILURES = KEPT_FAILURES
"""How many failures are kept word for word."""


class OnError(Enum):
    """What becomes of messages that cannot be converted, and of files that are damaged.

    Attributes:
        STOP: The first one ends the conversion.
        SKIP: They are left out and counted.
        COPY: They are copied as they are, to a channel of the same topic that has their serialization format. What
            cannot be read of a damaged file is left out and counted.
    """

    STOP = "stop"
    SKIP = "skip"
    COPY = "copy"


@dataclass(frozen=True)
class Settings:
    """How to convert.

    Attributes:
        source_format: How the messages are serialized, whatever the bag says; None for what it says.
        target_format: What to convert to; None for what `DEFAULT_FORMATS` says.
        storage: The storage of the result, `mcap` or `sqlite3`; None for that of the source, and `mcap` where that is
            ROS 1.
        compression: How the result is compressed, `none`, `zstd` or `lz4`; None for as the source is.
        topics: Which topics to convert: names, or patterns with `*`, `?` and `[...]`; all if there are none.
        excluded_topics: Which of them to leave out, likewise.
        start_time: The first time of recording to convert, in nanoseconds since 1970.
        end_time: The first time of recording not to convert any more; None for no end.
        on_error: What becomes of messages that cannot be converted.
        include: Folders with definitions that the bag does not have.
        distro: The ROS distribution of the embedded store, for definitions that are nowhere else.
        registry: Where converter plugins come from; None for those that are installed.
        threads: On how many threads to convert; None for one on each processor.
    """

    source_format: str | None = None
    target_format: str | None = None
    storage: str | None = None
    compression: str | None = None
    topics: tuple[str, ...] = ()
    excluded_topics: tuple[str, ...] = ()
    start_time: int = 0
    end_time: int | None = None
    on_error: OnError = OnError.STOP
    include: tuple[Path, ...] = ()
    distro: str | None = None
    registry: ConverterRegistry | None = None
    threads: int | None = None


@dataclass
class Counts:
    """What became of messages, by number. Together they are as many as the storage says that there are.

    Attributes:
        converted: Converted to the other format.
        copied: Copied as they are: they have the format already, or cannot be converted and were to be copied.
        skipped: Left out, since they cannot be converted.
        not_selected: Left out, since nobody asked for their topic or their time.
        lost: Left out, since the file is damaged.
    """

    converted: int = 0
    copied: int = 0
    skipped: int = 0
    not_selected: int = 0
    lost: int = 0

    @property
    def total(self) -> int:
        """All messages that there are."""
        return self.converted + self.copied + self.skipped + self.not_selected + self.lost

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            *(mine + its for mine, its in zip(vars(self).values(), vars(other).values(), strict=True))
        )


@dataclass(frozen=True)
class FailedMessage:
    """A message that cannot be converted.

    Attributes:
        file: The file that it is in.
        topic: Its topic.
        number: Which of the converted messages of the topic in that file it is; the first one is 1.
        log_time: When it was recorded, in nanoseconds since 1970.
        reason: What is wrong: the type, the field, the byte of the message.
    """

    file: str
    topic: str
    number: int
    log_time: int
    reason: str

    def __str__(self) -> str:
        return f"{message_place(self.file, self.number, self.topic, self.log_time)}: {self.reason}"


@dataclass(frozen=True)
class ConversionResult:
    """What was done.

    Attributes:
        counts: What became of the messages of each topic, by its name.
        failures: The first messages that cannot be converted, up to `SHOWN_FAILURES`.
        warnings: What the user should know, such as what is odd about the source.
        failed_count: How many messages cannot be converted; `failures` has the first of them.
        source_size: The size of the source in bytes.
        size: The size of the result in bytes.
        is_damaged: Whether something of the source could not be read, as `warnings` say. What that would have been
            need not be known: then no count has it.
    """

    counts: Mapping[str, Counts] = field(default_factory=dict)
    failures: Sequence[FailedMessage] = ()
    failed_count: int = 0
    warnings: Sequence[str] = ()
    source_size: int = 0
    size: int = 0
    is_damaged: bool = False

    @property
    def total(self) -> Counts:
        """What became of all messages."""
        return sum(self.counts.values(), Counts())

    @property
    def is_complete(self) -> bool:
        """Whether every message that was selected was read, and has the serialization format that was asked for."""
        return not (self.failed_count or self.total.skipped or self.total.lost or self.is_damaged)

    def __add__(self, other: ConversionResult) -> ConversionResult:
        names = {**self.counts, **other.counts}
        none = Counts()
        return ConversionResult(
            {name: self.counts.get(name, none) + other.counts.get(name, none) for name in names},
            (*self.failures, *other.failures)[:SHOWN_FAILURES],
            self.failed_count + other.failed_count,
            tuple(dict.fromkeys((*self.warnings, *other.warnings))),
            self.source_size + other.source_size,
            self.size + other.size,
            self.is_damaged or other.is_damaged,
        )


@dataclass(frozen=True)
class Progress:
    """How far a conversion is.

    Attributes:
        done: How many bytes of the source are done.
        total: How many there are.
        message_count: How many messages were written.
    """

    done: int
    total: int
    message_count: int
