"""The exceptions of the transcoder."""

from __future__ import annotations

from rosidl_adapter_proto.errors import ConversionError, Error


class TranscodeError(ConversionError):
    """Serialized bytes cannot be turned into the other format.

    Attributes:
        type_name: The type that was being transcoded, such as `sensor_msgs/msg/Imu`.
        field_path: Where in it, such as `header.frame_id` or `points[3].x`; empty for the message itself.
        byte_offset: Where in the input, counted from its first byte. For a field that is not in the input, the place
            of the message that should contain it.
        reason: What is wrong there, and what to do.
        batch_index: Which message of a batch it was; None outside of batches.
    """

    def __init__(
        self,
        type_name: str,
        field_path: str,
        byte_offset: int,
        reason: str,
        batch_index: int | None = None,
    ) -> None:
        super().__init__(type_name, field_path, reason)
        self.byte_offset = byte_offset
        self.batch_index = batch_index

    def __str__(self) -> str:
        message = "" if self.batch_index is None else f" of message {self.batch_index}"
        return f"{self.where} at byte {self.byte_offset}{message}: {self.reason}"

    def __reduce__(self) -> tuple[type[TranscodeError], tuple[str, str, int, str, int | None]]:
        arguments = (self.type_name, self.field_path, self.byte_offset, self.reason, self.batch_index)
        return type(self), arguments


class BufferTooSmallError(Error, ValueError):
    """The results of a batch do not fit into the memory that was given for them, which then holds nothing of use.

    Attributes:
        needed: How many bytes the results of this batch take.
        size: How many bytes there are.
    """

    def __init__(self, needed: int, size: int) -> None:
        super().__init__(needed, size)
        self.needed = needed
        self.size = size

    def __str__(self) -> str:
        return (
            f"the results take {self.needed} bytes and `into` has {self.size};"
            f" give a buffer of at least {self.needed} bytes"
        )


class RecordsError(Error):
    """A chunk of a recording is damaged, or cannot be converted.

    Attributes:
        byte_offset: Where in the chunk the record is that is wrong.
        reason: What is wrong there, and what to do.
    """

    def __init__(self, byte_offset: int, reason: str) -> None:
        super().__init__(byte_offset, reason)
        self.byte_offset = byte_offset
        self.reason = reason

    def __str__(self) -> str:
        return f"byte {self.byte_offset} of the chunk: {self.reason}"
