"""The native transcoder: CDR to protobuf and back."""

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Generic, TypeVar

from google.protobuf.message import Message
from typing_extensions import Buffer

from rosidl_adapter_proto.transcode.error import TranscodeError

MessageT = TypeVar("MessageT", bound=Message)

def packed_fields(
    serialize: Callable[[Message], bytes], message: Message, *numbers: int
) -> tuple[bytes, ...]:
    """Return the bytes of packed repeated fields of a message, by their numbers.

    Args:
        serialize: Serializes the message as protobuf runtimes do: each field once, in packed form, and no groups.
        message: The message.
        numbers: The numbers of the fields; one that is absent has no bytes.

    Raises:
        ValueError: The serialized message is not of this form.
    """

def read_records(
    data: Buffer, topic_ids: Collection[int] | None, start_time: int, end_time: int | None, /
) -> tuple[bytes, bytes, bytes, bytes, bytes, list[tuple[int, int, int]]]:
    """Return the columns of the messages of a chunk, as in `records.Records`, and of each record that is no message
    the opcode, the first byte of its content and the one after the last."""

def pack_records(
    topic_ids: Buffer,
    sequences: Buffer,
    log_times: Buffer,
    publish_times: Buffer,
    messages: Sequence[Buffer],
) -> bytearray:
    """Return message records, one after the other, as they stand in a chunk.

    Args:
        topic_ids: The topic id of each message: unsigned numbers of 16 bits, as `array("H")` and numpy have them.
        sequences: The sequence number of each, of 32 bits.
        log_times: When each was recorded, in nanoseconds: numbers of 64 bits.
        publish_times: When each was published, in nanoseconds: numbers of 64 bits.
        messages: Their data.

    Raises:
        RecordsError: The chunk would be larger than 2^32 - 1 bytes.
        ValueError: There are not as many numbers as messages.
        TypeError: Numbers do not have the size that they should have.
    """

def index_records(data: Buffer, /) -> tuple[bytes, dict[int, int], dict[int, int], int, int]:
    """Return what `records.RecordIndex` has."""

KEPT_FAILURES: int
"""Of how many messages of a chunk that fail it is told which they are."""

def read_ros2msg(text: bytes, type_name: str) -> bytes:
    """Return the packed plan of a type with hashed field numbers, as `Plan.pack` does, without Python.

    Args:
        text: Its definition and those of the types in it, as recordings have them with the encoding `ros2msg`.
        type_name: The type that it is recorded for.

    Raises:
        ValueError: The text is not valid, or not one of messages.
    """

_FlatNote = tuple[tuple[tuple[int, str], ...], bool, bool]
"""The attributes of `protobuf_plan.FlatNote`."""

def read_file_descriptor_set(data: bytes, type_name: str) -> tuple[bytes, list[_FlatNote]]:
    """Return the packed plan of a message and its notes, as `protobuf_plan` makes them, without Python.

    Args:
        data: A serialized `FileDescriptorSet`.
        type_name: The full name of the message; a dot may stand before it.

    Raises:
        ValueError: The set is damaged or too large, or does not have the message.
    """

class Memory(Buffer):
    """Memory of the native module, as a buffer that cannot be written to."""

class PooledMemory(Memory):
    """Memory that is used again once nobody looks at it any more."""

class RecordConverter:
    def __init__(self, routes: Sequence[tuple[int, str, int, Transcoder | None, int | None]]) -> None:
        """Take the routes: the topic id in the chunk, what to do, the topic id in the result, the transcoder, and the
        topic id of messages that cannot be transcoded."""

    def _convert(
        self, data: Buffer, start_time: int, end_time: int | None, /
    ) -> tuple[PooledMemory, int, dict[int, int], list[tuple[int, int, int, int, TranscodeError]]]:
        """Return the new chunk, how many messages it has, how many of each topic failed, and of the first of those
        topic id, log time, sequence number, index and error."""

class Transcoder:
    def __init__(self, plan: bytes, type_name: str, size_limit: int) -> None: ...
    @property
    def type_name(self) -> str:
        """The ROS type, such as `sensor_msgs/msg/Imu`."""

    def cdr_to_proto(self, data: Buffer, /) -> bytes:
        """Turn a serialized ROS message into a serialized protobuf message."""

    def proto_to_cdr(self, data: Buffer, /) -> bytes:
        """Turn a serialized protobuf message into a serialized ROS message."""

    def ros1_to_proto(self, data: Buffer, /) -> bytes:
        """Turn a message serialized by ROS 1 into a serialized protobuf message."""

    def _cdr_to_proto_batch(
        self, messages: Iterable[Buffer] | Buffer, ranges: Buffer | None, threads: int, into: Buffer | None, /
    ) -> tuple[Buffer, int, bytes, dict[int, TranscodeError]]:
        """Return the buffer with the results, how many bytes of it they take, their ranges, and the errors."""

    def _proto_to_cdr_batch(
        self, messages: Iterable[Buffer] | Buffer, ranges: Buffer | None, threads: int, into: Buffer | None, /
    ) -> tuple[Buffer, int, bytes, dict[int, TranscodeError]]:
        """Return the same for the other direction."""

class ColumnFiller:
    def __init__(self, transcoder: Transcoder, layout: bytes, serialization: int) -> None:
        """Take a type, its columns as `columns.pack_layout` packs them, and the place in `columns.SERIALIZATIONS`."""

    @property
    def rows(self) -> int:
        """How many messages the columns have."""

    def append(
        self,
        messages: Sequence[Buffer] | Buffer,
        ranges: Buffer | None,
        first: int,
        maximum_rows: int,
        maximum_bytes: int,
    ) -> int:
        """Append messages from `first` on until there are so many rows or bytes; return the index of the next one."""

    def take(self) -> tuple[int, list[tuple[int, Memory | None, Memory]]]:
        """Hand the columns over and begin anew: how many rows they have, and of each how many rows it has itself, its
        offsets and its values."""

class Codec(Generic[MessageT]):
    def __init__(self, transcoder: Transcoder, message_class: type[MessageT]) -> None: ...
    def to_cdr(self, message: MessageT, /) -> bytes:
        """Turn a protobuf message into a serialized ROS message."""

    def from_cdr(self, data: Buffer, /, fields: Iterable[str] | None = None) -> MessageT:
        """Turn a serialized ROS message, or only the chosen fields of it, into a protobuf message."""
