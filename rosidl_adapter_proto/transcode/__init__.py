"""CDR bytes to protobuf bytes and back, without a message object in between."""

from __future__ import annotations

from pathlib import Path

try:
    from rosidl_adapter_proto.transcode import _core  # noqa: F401
except ImportError as error:
    raise ImportError(
        f"{Path(__file__).parent} has no native module ({error}); install the project with pip, "
        "and if this is its source folder, run Python elsewhere",
        name=f"{__name__}._core",
    ) from error

from rosidl_adapter_proto.transcode.codec import MAXIMUM_SIZE, Batch, Codec, Transcoder
from rosidl_adapter_proto.transcode.error import BufferTooSmallError, RecordsError, TranscodeError

__all__ = [
    "MAXIMUM_SIZE",
    "Batch",
    "BufferTooSmallError",
    "Codec",
    "RecordsError",
    "TranscodeError",
    "Transcoder",
]
