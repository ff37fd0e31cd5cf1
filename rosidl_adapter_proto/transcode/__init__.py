"""CDR bytes to protobuf bytes and back, without a message object in between."""

from __future__ import annotations

from rosidl_adapter_proto.transcode.codec import MAXIMUM_SIZE, Batch, Codec, Transcoder
from rosidl_adapter_proto.transcode.error import BufferTooSmallError, TranscodeError

__all__ = ["MAXIMUM_SIZE", "Batch", "BufferTooSmallError", "Codec", "TranscodeError", "Transcoder"]
