"""CDR bytes to protobuf bytes and back, without a message object in between."""

from __future__ import annotations

from rosidl_adapter_proto.transcode.codec import MAXIMUM_SIZE, Codec, Transcoder
from rosidl_adapter_proto.transcode.error import TranscodeError

__all__ = ["MAXIMUM_SIZE", "Codec", "TranscodeError", "Transcoder"]
