"""Damaged input through the Python API: an error or a valid result, and nothing else."""

from __future__ import annotations

import random

import pytest
from reference_cdr import write_cdr
from ros_types import (
    Types,
    installed_messages,
    installed_types,
    nasty_types,
    protobuf_message,
    random_value,
    transcoder,
)

from rosidl_adapter_proto.transcode import TranscodeError

TYPES: Types = {**installed_types(), **nasty_types()}
NAMES = [*installed_messages(), *nasty_types()]
MUTATIONS = 100_000 // len(NAMES) // 2 + 1
INTERESTING = (0x00, 0x01, 0x7F, 0x80, 0xFF, 0xC0, 0xD8)


def mutate(data: bytes, rng: random.Random) -> bytes:
    result = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(result) + 1)
        choice = rng.randrange(5)
        if choice == 0 and place < len(result):
            result[place] ^= 1 << rng.randrange(8)
        elif choice == 1 and place < len(result):
            result[place] = rng.choice(INTERESTING)
        elif choice == 2:
            del result[place : place + rng.randrange(9)]
        elif choice == 3:
            result[place:place] = rng.randbytes(rng.randrange(9))
        else:
            result[place:place] = result[rng.randrange(len(result) + 1) :][:40]
    return bytes(result)


@pytest.mark.parametrize("name", NAMES)
def test_damage(name: str) -> None:
    transcode, message_class = transcoder(TYPES, name)
    rng = random.Random(name)

    def from_cdr(data: bytes) -> None:
        try:
            proto = transcode.cdr_to_proto(data)
        except TranscodeError as error:
            assert error.byte_offset <= len(data)
            return
        message_class.FromString(proto)

    def from_proto(data: bytes) -> None:
        try:
            cdr = transcode.proto_to_cdr(data)
        except TranscodeError as error:
            assert error.byte_offset <= len(data)
            return
        # What protobuf reads is what was written. It may refuse text that another one of the same field replaces.
        again = transcode.cdr_to_proto(cdr)
        assert transcode.proto_to_cdr(again) == cdr
        message_class.FromString(again)

    value = random_value(TYPES, name, rng)
    cdr = write_cdr(TYPES, name, value)
    proto = protobuf_message(TYPES, name, value, message_class()).SerializeToString()
    for size in range(len(cdr)):
        with pytest.raises(TranscodeError):
            transcode.cdr_to_proto(cdr[:size])
    for size in range(len(proto)):
        from_proto(proto[:size])
    for _ in range(MUTATIONS):
        from_cdr(mutate(cdr, rng))
        from_proto(mutate(proto, rng))
