"""Chunks, compressed and decompressed."""

from __future__ import annotations

import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import lz4.frame
import pytest
import zstandard

from rosidl_adapter_proto.bags.compression import COMPRESSIONS, compress, records_of
from rosidl_adapter_proto.bags.model import StoredChunk
from rosidl_adapter_proto.errors import BagError

DATA = bytes(range(256)) * 100


def stored(compression: str = "", data: bytes | None = None) -> StoredChunk:
    """Return a chunk as a file has it."""
    data = bytes(compress(DATA, compression)) if data is None else data
    return StoredChunk("a.mcap at byte 7", data, compression, len(DATA), zlib.crc32(DATA), 0, 0)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_what_is_compressed_is_decompressed(compression: str) -> None:
    assert bytes(records_of(stored(compression))) == DATA
    assert bytes(records_of(replace(stored(compression), crc=0))) == DATA


@pytest.mark.parametrize(
    ("compression", "data"),
    [
        ("zstd", zstandard.ZstdCompressor(write_content_size=False).compress(DATA)),
        ("zstd", zstandard.ZstdCompressor(level=19, write_checksum=True).compress(DATA)),
        ("lz4", lz4.frame.compress(DATA, store_size=False)),
        ("lz4", lz4.frame.compress(DATA, compression_level=9, block_linked=False, content_checksum=True)),
    ],
)
def test_whatever_other_writers_make_is_decompressed(compression: str, data: bytes) -> None:
    assert bytes(records_of(stored(compression, data))) == DATA


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_a_chunk_may_be_empty(compression: str) -> None:
    chunk = StoredChunk("a.mcap at byte 7", compress(b"", compression), compression, 0, 0, 0, 0)
    assert bytes(records_of(chunk)) == b""


def test_many_threads_compress_at_once() -> None:
    with ThreadPoolExecutor(8) as pool:
        chunks = list(pool.map(lambda _: stored("zstd"), range(64)))
        assert all(bytes(records) == DATA for records in pool.map(records_of, chunks))


ZSTD = bytes(compress(DATA, "zstd"))
LZ4 = bytes(compress(DATA, "lz4"))
# More bytes than any file has behind it: only reading the size may be tried.
BOMB = zstandard.ZstdCompressor(write_content_size=False).compress(bytes(1 << 20))


@pytest.mark.parametrize(
    ("chunk", "reason"),
    [
        (
            replace(stored(), compression="snappy"),
            "its compression `snappy` is unknown; these are known: zstd, lz4",
        ),
        (replace(stored(), crc=5), f"its checksum is {zlib.crc32(DATA):#010x} and should be 0x00000005"),
        (
            replace(stored("zstd"), crc=5),
            f"its checksum is {zlib.crc32(DATA):#010x} and should be 0x00000005",
        ),
        (replace(stored(), size=1), "it has 25600 bytes and says 1"),
        (replace(stored(), size=25601), "it says that its 25600 bytes become 25601, which is impossible"),
        (replace(stored("zstd"), size=25599), "it has 25600 bytes and says 25599"),
        (replace(stored("zstd"), size=25601), "it has 25600 bytes and says 25601"),
        (
            replace(stored("zstd"), size=2**60),
            f"it says that its {len(ZSTD)} bytes become {2**60}, which is impossible",
        ),
        (
            replace(stored("lz4"), size=2**24),
            f"it says that its {len(LZ4)} bytes become {2**24}, which is impossible",
        ),
        (
            replace(stored("zstd", bytes(2**18)), size=2**32),
            "it says that it has 4294967296 bytes; up to 4294967295 are read",
        ),
        (
            stored("zstd", BOMB),
            "it cannot be decompressed: decompression error: did not decompress full frame",
        ),
        (
            stored("zstd", ZSTD[:-1]),
            "it cannot be decompressed: decompression error: did not decompress full frame",
        ),
        (
            stored("zstd", ZSTD + b"xx"),
            "it cannot be decompressed: compressed input contains 2 bytes of unused data, which is disallowed",
        ),
        (stored("zstd", b"garbage"), "it cannot be decompressed: error when determining content size"),
        (replace(stored("lz4"), size=25599), "it cannot be decompressed: it is not one frame of 25599 bytes"),
        (replace(stored("lz4"), size=25601), "it has 25600 bytes and says 25601"),
        (stored("lz4", LZ4[:-1]), "it cannot be decompressed: it is not one frame of 25600 bytes"),
        (stored("lz4", LZ4 + b"xx"), "it cannot be decompressed: it is not one frame of 25600 bytes"),
        (
            stored("lz4", b"garbage"),
            "it cannot be decompressed: LZ4F_decompress failed with code: ERROR_frameType_unknown",
        ),
    ],
)
def test_a_damaged_chunk_is_refused(chunk: StoredChunk, reason: str) -> None:
    with pytest.raises(BagError) as caught:
        records_of(chunk)
    assert str(caught.value) == f"a.mcap at byte 7: the chunk is damaged: {reason}"
