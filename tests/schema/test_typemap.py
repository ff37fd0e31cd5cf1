from __future__ import annotations

import pytest

from rosidl_adapter_proto.interfaces.model import (
    ArrayType,
    BasicType,
    SequenceType,
    StringType,
    TypeName,
    ValueType,
)
from rosidl_adapter_proto.interfaces.scalars import SCALARS
from rosidl_adapter_proto.schema.typemap import (
    MSG_TYPE_TO_PROTO,
    PROTO_ACTION_GET_RESULT_CALL_NAME,
    PROTO_ACTION_SEND_GOAL_CALL_NAME,
    PROTO_PACKAGE_POSTFIX,
    PROTO_SERVICE_CALL_NAME,
    is_repeated,
    proto_full_name,
    proto_package,
    proto_path,
    proto_type,
    type_of_proto_name,
)

IMU = TypeName("sensor_msgs", "msg", "Imu")

# Each row: a type, its protobuf type, and that of an array or sequence of it
TYPES: list[tuple[ValueType, str, str]] = [
    (BasicType("boolean"), "bool", "repeated bool"),
    (BasicType("octet"), "uint32", "bytes"),
    (BasicType("char"), "uint32", "string"),
    (BasicType("wchar"), "uint32", "string"),
    (BasicType("uint8"), "uint32", "bytes"),
    (BasicType("int8"), "int32", "bytes"),
    (BasicType("int16"), "int32", "repeated int32"),
    (BasicType("uint16"), "uint32", "repeated uint32"),
    (BasicType("int32"), "sfixed32", "repeated sfixed32"),
    (BasicType("uint32"), "fixed32", "repeated fixed32"),
    (BasicType("int64"), "sfixed64", "repeated sfixed64"),
    (BasicType("uint64"), "fixed64", "repeated fixed64"),
    (BasicType("float"), "float", "repeated float"),
    (BasicType("double"), "double", "repeated double"),
    (BasicType("long double"), "double", "repeated double"),
    (StringType(), "string", "repeated string"),
    (StringType(bound=3), "string", "repeated string"),
    (StringType(wide=True), "bytes", "repeated bytes"),
    (StringType(True, 3), "bytes", "repeated bytes"),
    (IMU, ".sensor_msgs.msg.pb.Imu", "repeated .sensor_msgs.msg.pb.Imu"),
]


@pytest.mark.parametrize(("value_type", "single", "several"), TYPES, ids=[str(row[0]) for row in TYPES])
def test_types(value_type: ValueType, single: str, several: str) -> None:
    assert (is_repeated(value_type), proto_type(value_type)) == (False, single)
    for each in (ArrayType(value_type, 3), SequenceType(value_type), SequenceType(value_type, 3)):
        assert "repeated " * is_repeated(each) + proto_type(each) == several


def test_every_type_is_mapped() -> None:
    tested = {row[0].name for row in TYPES if isinstance(row[0], BasicType)}
    assert {*tested, "string", "wstring"} == SCALARS.keys() == MSG_TYPE_TO_PROTO.keys()


def test_names() -> None:
    assert proto_package(IMU) == "sensor_msgs.msg.pb"
    assert proto_full_name(IMU) == "sensor_msgs.msg.pb.Imu"
    assert type_of_proto_name("sensor_msgs.msg.pb.Imu") == IMU
    for other in (
        "sensor_msgs.Imu",
        "sensor_msgs.msg.pb.Imu.Part",
        "foxglove.pb.msg.Imu",
        "sensor_msgs.msg.pb.Ï",
    ):
        assert type_of_proto_name(other) is None
    assert proto_path(TypeName("std_srvs", "srv", "SetBool")) == "std_srvs/srv/SetBool.proto"


def test_names_that_the_reference_has_as_well() -> None:
    assert PROTO_PACKAGE_POSTFIX == "pb"
    assert PROTO_SERVICE_CALL_NAME == "Call"
    assert PROTO_ACTION_SEND_GOAL_CALL_NAME == "SendGoal"
    assert PROTO_ACTION_GET_RESULT_CALL_NAME == "GetResult"
