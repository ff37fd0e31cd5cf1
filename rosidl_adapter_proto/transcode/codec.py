"""What turns messages of one type from CDR to protobuf and back: bytes to bytes, and bytes to objects.

The work is done by methods of the native module, which `_core.pyi` describes; the classes here make their plans.
"""

from __future__ import annotations

import contextlib
import operator
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from google.protobuf.descriptor import Descriptor
from google.protobuf.message import EncodeError, Message

from rosidl_adapter_proto.errors import ConversionError, SchemaError, wrong_message
from rosidl_adapter_proto.interfaces.description import TypeDescription
from rosidl_adapter_proto.transcode import _core
from rosidl_adapter_proto.transcode.error import TranscodeError
from rosidl_adapter_proto.transcode.plan import Plan, build_plan

if TYPE_CHECKING:
    from typing_extensions import Buffer

MessageT = TypeVar("MessageT", bound=Message)

NOWHERE = 2**64 - 1
"""The place of a message that could not be transcoded: no buffer is so large."""

MAXIMUM_SIZE = 2**31 - 1
"""The largest protobuf message in bytes (https://protobuf.dev/programming-guides/encoding/#size-limit)."""


class Batch:
    """The results of a batch: a memoryview of each, or the error of each that could not be transcoded.

    `len(batch)` counts both, `batch[index]` and iterating give the results and raise the error of a message that
    failed, so that none is overlooked; `errors` tells before which ones failed. The memory belongs to whoever gave it:
    once it is used for another batch, the results of this one are gone.

    Attributes:
        buffer: The results, one after the other.
        ranges: Where in the buffer they are: the first byte and the one after the last of each, in one row of
            unsigned 64-bit numbers. A message that failed has `NOWHERE` twice. With the buffer they can be given to
            another batch, if none failed.
        errors: The error of each message that failed, by its index.
    """

    def __init__(self, buffer: memoryview, ranges: memoryview, errors: Mapping[int, TranscodeError]) -> None:
        self.buffer = buffer
        self.ranges = ranges
        self.errors = errors

    def __len__(self) -> int:
        return len(self.ranges) // 2

    def __getitem__(self, index: int) -> memoryview:
        index = range(len(self))[index]
        if index in self.errors:
            raise self.errors[index].with_traceback(None)
        return self.buffer[self.ranges[2 * index] : self.ranges[2 * index + 1]]

    def __iter__(self) -> Iterator[memoryview]:
        return map(self.__getitem__, range(len(self)))

    def __repr__(self) -> str:
        return f"<Batch of {len(self)} messages, {len(self.errors)} failed>"


@contextlib.contextmanager
def plan_errors(plan: Plan) -> Iterator[None]:
    """Raise a SchemaError for what the core says of a plan, such as that an array makes each message too large."""
    try:
        yield
    except ValueError as error:
        raise SchemaError(f"{plan.type_name}: {error}") from None


class Transcoder(_core.Transcoder):
    """Transcodes the messages of one type, from bytes to bytes.

    Its methods come from the native module. They take any contiguous buffer, raise `TranscodeError` for bytes that are
    not a valid message of the type, and may be called from many threads at once:

    - `cdr_to_proto(data)` reads plain CDR of either byte order and returns a serialized protobuf message.
    - `proto_to_cdr(data)` reads a protobuf message and returns little-endian plain CDR, as rclpy publishes it.
    - `ros1_to_proto(data)` reads a message as ROS 1 serializes it. The type is the one that ROS 2 would have, with
      `builtin_interfaces/msg/Time` and `Duration`; a time after 2038 and negative nanoseconds, which these do not have,
      are errors.
    - `cdr_to_proto_batch(messages)` and `proto_to_cdr_batch(messages)` do the same for many messages.

    Fields that are unknown to the type are skipped. An array that is absent in protobuf is an array of zeros.

    Args:
        type_description: The ROS type and everything that it refers to (REP-2011).
        descriptor: The protobuf message, with hashed or any other field numbers.
        size_limit: The largest result in bytes; a larger one is an error before memory is taken for it.
        omit_empty_messages: Leave out single nested messages that have no bytes; by default they are present.
        fields: Read only these from CDR, such as `header.stamp` or, of each point in a sequence, `points.x`; the rest
            is skipped. Such a transcoder does not write CDR.

    Raises:
        SchemaError: The description and the descriptor do not fit together, the type has no such field, or its messages
            are too large.
        TypeError: `fields` is one text.
    """

    def __init__(
        self,
        type_description: TypeDescription,
        descriptor: Descriptor,
        *,
        size_limit: int = MAXIMUM_SIZE,
        omit_empty_messages: bool = False,
        fields: Iterable[str] | None = None,
    ) -> None:
        plan = build_plan(
            type_description, descriptor, omit_empty_messages=omit_empty_messages, fields=fields
        )
        with plan_errors(plan):
            super().__init__(plan.pack(), plan.type_name, size_limit)

    def cdr_to_proto_batch(
        self,
        messages: Iterable[Buffer] | Buffer,
        threads: int = 1,
        *,
        ranges: Buffer | None = None,
        into: Buffer | None = None,
    ) -> Batch:
        """Do `cdr_to_proto` for each message, while other Python threads run.

        A batch is not only one call: into a buffer that is kept from batch to batch no memory has to be found and made
        ready for each message, which costs more than transcoding it.

        Args:
            messages: The messages; with `ranges`, the one buffer that they are in.
            threads: On how many threads.
            ranges: Where in the buffer each message is: unsigned 64-bit numbers, as `array("Q")` and numpy have them,
                for each message its first byte and the one after its last.
            into: Writable memory for all results, such as a `bytearray`; by default a new one of the exact size. It
                may not be memory of the messages. It cannot change its size as long as the batch or one of its
                results lives, and the next batch into it overwrites them.

        Returns:
            The results. Messages that are not valid do not fail the others.

        Raises:
            BufferTooSmallError: `into` is too small; the error says how many bytes are needed, and what `into` held
                is lost.
            ValueError: A range is not in the buffer, or `into` is memory of the messages.
        """
        return _batch(self._cdr_to_proto_batch, messages, threads, ranges, into)

    def proto_to_cdr_batch(
        self,
        messages: Iterable[Buffer] | Buffer,
        threads: int = 1,
        *,
        ranges: Buffer | None = None,
        into: Buffer | None = None,
    ) -> Batch:
        """Do `proto_to_cdr` for each message; the rest is as in `cdr_to_proto_batch`."""
        return _batch(self._proto_to_cdr_batch, messages, threads, ranges, into)


def _batch(
    transcode: Callable[..., tuple[Buffer, int, bytes, dict[int, TranscodeError]]],
    messages: Iterable[Buffer] | Buffer,
    threads: int,
    ranges: Buffer | None,
    into: Buffer | None,
) -> Batch:
    """Call a native method, and wrap what it returns."""
    threads = operator.index(threads)
    if threads < 1:
        raise ValueError("threads must be 1 or more")
    buffer, size, places, errors = transcode(messages, ranges, min(threads, sys.maxsize), into)
    return Batch(memoryview(buffer).cast("B")[:size], memoryview(places).cast("Q"), errors)


class Codec(_core.Codec[MessageT]):
    """Turns protobuf messages of one type into serialized ROS messages and back.

    Its methods come from the native module and may be called from many threads at once:

    - `to_cdr(message)` returns a protobuf message as ROS sends it: little-endian CDR with its encapsulation header.
    - `from_cdr(data)` returns the protobuf message of a serialized ROS message: plain CDR of either byte order.
      `from_cdr(data, fields=["header.stamp", "width"])` reads only these fields, and what is not needed to find them
      is not looked at: one small field of a large message costs the same as one of a small message.

    Both raise `ConversionError` for what is not a valid message of the type; mostly it is a `TranscodeError`, which has
    the place in the bytes as well.

    Attributes:
        transcoder: Does the same from bytes to bytes.
        message_class: The class of the protobuf messages.

    Args:
        type_description: The ROS type and everything that it refers to (REP-2011).
        message_class: The class of the protobuf messages.

    Raises:
        SchemaError: The description and the class do not fit together.
    """

    def __init__(self, type_description: TypeDescription, message_class: type[MessageT]) -> None:
        descriptor: Any = message_class.DESCRIPTOR
        self.transcoder = Transcoder(type_description, descriptor)
        self.message_class = message_class
        self._type_description = type_description
        super().__init__(self.transcoder, message_class)

    def __reduce__(self) -> tuple[type[Codec[MessageT]], tuple[TypeDescription, type[MessageT]]]:
        return type(self), (self._type_description, self.message_class)

    def _transcoder_of(self, fields: Iterable[str]) -> Transcoder:
        """Return what transcodes only some fields; asked once for each choice."""
        descriptor: Any = self.message_class.DESCRIPTOR
        return Transcoder(self._type_description, descriptor, fields=fields)

    def _refuse(self, message: object) -> NoReturn:
        """Refuse a message of another class."""
        raise wrong_message(self.transcoder.type_name, self.message_class.DESCRIPTOR.full_name, message)

    def _refuse_to_serialize(self, error: Exception) -> NoReturn:
        """Say in our terms that protobuf does not serialize a message."""
        if not isinstance(error, EncodeError):
            raise error
        reason = (
            f"protobuf does not serialize it ({error}); a message has {MAXIMUM_SIZE} bytes at most, split it"
        )
        raise ConversionError(self.transcoder.type_name, "", reason) from error
