"""Every type of the running ROS environment, against rclpy, protobuf and a reference writer of CDR."""

from __future__ import annotations

import random

import pytest
from reference_cdr import CdrWriter, write_cdr
from ros_types import (
    installed_messages,
    installed_types,
    protobuf_message,
    random_value,
    ros_class,
    ros_object,
    same_message,
    transcoder,
)

serialization = pytest.importorskip("rclpy.serialization")

TYPES = installed_types() if serialization else {}
VALUES = 8


@pytest.mark.parametrize("hashed", [True, False], ids=["hash", "sequential"])
@pytest.mark.parametrize("name", installed_messages())
def test_type(name: str, hashed: bool) -> None:
    transcode, message_class = transcoder(TYPES, name, hashed=hashed)
    rng = random.Random(name)
    for _ in range(VALUES):
        value = random_value(TYPES, name, rng)
        ros = ros_object(TYPES, name, value)
        from_rclpy = serialization.serialize_message(ros)
        expected = protobuf_message(TYPES, name, value, message_class())

        assert same_message(message_class.FromString(transcode.cdr_to_proto(from_rclpy)), expected)
        big_endian = write_cdr(TYPES, name, value, big_endian=True, padding_byte=0xAA)
        assert transcode.cdr_to_proto(big_endian) == transcode.cdr_to_proto(from_rclpy)

        cdr = transcode.proto_to_cdr(expected.SerializeToString())
        writer = CdrWriter(TYPES).message(name, value)
        assert cdr == writer.bytes()
        # rclpy leaves padding as it was, and gives more bytes than it wrote.
        native = bytearray(from_rclpy[: len(cdr)])
        for place in writer.padding:
            native[place] = 0
        assert cdr == native
        assert serialization.deserialize_message(cdr, ros_class(name)) == ros
        assert transcode.proto_to_cdr(transcode.cdr_to_proto(cdr)) == cdr
