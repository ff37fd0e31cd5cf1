"""Chunks, compressed and not. Everything here may be called on any thread, and works with the interpreter unlocked."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import lz4.frame
import zstandard
from isal.isal_zlib import crc32  # ten times as fast as that of zlib

from rosidl_adapter_proto.bags.model import EVERYTHING, Selection, StoredChunk
from rosidl_adapter_proto.bags.storage import MAXIMUM_CHUNK_SIZE
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import Records, read_records

if TYPE_CHECKING:
    from typing_extensions import Buffer

NONE = ""
ZSTD = "zstd"
LZ4 = "lz4"
COMPRESSIONS = (NONE, ZSTD, LZ4)

# The level that the C++ writer of MCAP has by default, and with it rosbag2.
_ZSTD_LEVEL = 1

# How many bytes come out of one, at most. zstd repeats a byte 128 KiB with a block of 4 bytes (RFC 8878, 3.1.1.2); a
# match in lz4 grows by 255 with each byte.
_LARGEST_RATIOS = {ZSTD: 128 * 1024 // 4, LZ4: 255}
_SMALLEST_LIMIT = 128 * 1024

# What zstandard works with is for one thread at a time.
_contexts = threading.local()


def records_of(chunk: StoredChunk) -> Buffer:
    """Return the records of a chunk: what is stored, decompressed and compared with its size and checksum.

    Raises:
        BagError: They are not what the chunk says.
    """
    size = memoryview(chunk.data).nbytes
    if chunk.compression not in COMPRESSIONS:
        raise _damaged(chunk, f"its compression `{chunk.compression}` is unknown; these are known: zstd, lz4")
    largest = size * _LARGEST_RATIOS[chunk.compression] + _SMALLEST_LIMIT if chunk.compression else size
    if chunk.size > largest:
        raise _damaged(chunk, f"it says that its {size} bytes become {chunk.size}, which is impossible")
    if chunk.size > MAXIMUM_CHUNK_SIZE:
        raise _damaged(chunk, f"it says that it has {chunk.size} bytes; up to {MAXIMUM_CHUNK_SIZE} are read")
    records = _DECOMPRESSORS[chunk.compression](chunk)
    if memoryview(records).nbytes != chunk.size:
        raise _damaged(chunk, f"it has {memoryview(records).nbytes} bytes and says {chunk.size}")
    if chunk.crc and crc32(records) != chunk.crc:
        raise _damaged(chunk, f"its checksum is {crc32(records):#010x} and should be {chunk.crc:#010x}")
    return records


def read_chunk(chunk: StoredChunk, selection: Selection = EVERYTHING) -> Records:
    """Return those messages of a chunk that a selection has, and whatever else is in it.

    Raises:
        BagError: The chunk is damaged.
    """
    data = records_of(chunk)
    try:
        return read_records(data, selection.topic_ids, selection.start_time, selection.end_time)
    except RecordsError as error:
        raise BagError(f"{chunk.where}: {error}") from error


def compress(data: Buffer, compression: str) -> Buffer:
    """Return bytes compressed, as fast as rosbag2 does.

    Args:
        data: What to compress.
        compression: One of `COMPRESSIONS`; bytes without compression are returned as they are.
    """
    if compression == NONE:
        return data
    compressed: bytes
    if compression == LZ4:
        compressed = lz4.frame.compress(data)
        return compressed
    if not hasattr(_contexts, "compressor"):
        _contexts.compressor = zstandard.ZstdCompressor(level=_ZSTD_LEVEL)
    compressed = _contexts.compressor.compress(memoryview(data))
    return compressed


def _stored(chunk: StoredChunk) -> Buffer:
    return chunk.data


def _zstd(chunk: StoredChunk) -> bytes:
    if not hasattr(_contexts, "decompressor"):
        _contexts.decompressor = zstandard.ZstdDecompressor()
    try:
        # The library believes the size in the frame before it looks at max_output_size.
        size = zstandard.frame_content_size(memoryview(chunk.data))
        if size not in (-1, chunk.size):
            raise _damaged(chunk, f"it has {size} bytes and says {chunk.size}")
        records: bytes = _contexts.decompressor.decompress(
            memoryview(chunk.data), max_output_size=chunk.size or 1, allow_extra_data=False
        )
    except zstandard.ZstdError as error:
        raise _damaged(chunk, f"it cannot be decompressed: {error}") from error
    return records


def _lz4(chunk: StoredChunk) -> bytes:
    try:
        context = lz4.frame.create_decompression_context()
        records, read, complete = lz4.frame.decompress_chunk(context, chunk.data, max_length=chunk.size or 1)
    except RuntimeError as error:
        raise _damaged(chunk, f"it cannot be decompressed: {error}") from error
    if not complete or read != memoryview(chunk.data).nbytes:
        raise _damaged(chunk, f"it cannot be decompressed: it is not one frame of {chunk.size} bytes")
    return bytes(records)


_DECOMPRESSORS = {NONE: _stored, ZSTD: _zstd, LZ4: _lz4}


def _damaged(chunk: StoredChunk, reason: str) -> BagError:
    return BagError(f"{chunk.where}: the chunk is damaged: {reason}")
