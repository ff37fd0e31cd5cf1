"""The native transcoder: CDR to protobuf and back."""

from collections.abc import Callable, Iterable
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

class Transcoder:
    def __init__(self, plan: bytes, type_name: str, size_limit: int) -> None: ...
    @property
    def type_name(self) -> str:
        """The ROS type, such as `sensor_msgs/msg/Imu`."""

    def cdr_to_proto(self, data: Buffer, /) -> bytes:
        """Turn a serialized ROS message into a serialized protobuf message."""

    def proto_to_cdr(self, data: Buffer, /) -> bytes:
        """Turn a serialized protobuf message into a serialized ROS message."""

    def _cdr_to_proto_batch(
        self, messages: Iterable[Buffer] | Buffer, ranges: Buffer | None, threads: int, into: Buffer | None, /
    ) -> tuple[Buffer, int, bytes, dict[int, TranscodeError]]:
        """Return the buffer with the results, how many bytes of it they take, their ranges, and the errors."""

    def _proto_to_cdr_batch(
        self, messages: Iterable[Buffer] | Buffer, ranges: Buffer | None, threads: int, into: Buffer | None, /
    ) -> tuple[Buffer, int, bytes, dict[int, TranscodeError]]:
        """Return the same for the other direction."""

class Codec(Generic[MessageT]):
    def __init__(self, transcoder: Transcoder, message_class: type[MessageT]) -> None: ...
    def to_cdr(self, message: MessageT, /) -> bytes:
        """Turn a protobuf message into a serialized ROS message."""

    def from_cdr(self, data: Buffer, /, fields: Iterable[str] | None = None) -> MessageT:
        """Turn a serialized ROS message, or only the chosen fields of it, into a protobuf message."""
