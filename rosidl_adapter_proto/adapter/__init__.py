"""What generated code stands on. `__all__` is all that generated modules may import; `contract` says how that changes.

Nothing but protobuf and the standard library is imported here, so that importing a generated package is cheap. ROS
classes, numpy and the transcoder are imported when they are first needed.
"""

from rosidl_adapter_proto.adapter.arrays import array_of, elements, fill_array, numbers, packed, packed_fields
from rosidl_adapter_proto.adapter.base import ActionAdapter, FieldInfo, ServiceAdapter, TypeAdapter
from rosidl_adapter_proto.adapter.base import CustomT as CustomT
from rosidl_adapter_proto.adapter.base import FeedbackT as FeedbackT
from rosidl_adapter_proto.adapter.base import GoalT as GoalT
from rosidl_adapter_proto.adapter.base import RequestT as RequestT
from rosidl_adapter_proto.adapter.base import ResponseT as ResponseT
from rosidl_adapter_proto.adapter.base import ResultT as ResultT
from rosidl_adapter_proto.adapter.contract import require_contract
from rosidl_adapter_proto.adapter.lazy import RosNotFoundError as RosNotFoundError
from rosidl_adapter_proto.adapter.loading import add_descriptor_file, lazy_exports
from rosidl_adapter_proto.adapter.messages import (
    check_custom,
    fill_each,
    finish_custom,
    finish_ros_message,
    ros_message_array,
    ros_messages,
)
from rosidl_adapter_proto.adapter.values import (
    CONVERSION_ERRORS,
    absent_or_exactly,
    at_most,
    boolean,
    character,
    characters,
    conversion_error,
    each,
    exactly,
    float32,
    in_range,
    octet,
    octets,
    ros_character,
    ros_characters,
    ros_octet,
    ros_octets,
    ros_string,
    ros_wide,
    sequence,
    string,
    text,
    wide,
)

__all__ = [
    "CONVERSION_ERRORS",
    "ActionAdapter",
    "FieldInfo",
    "ServiceAdapter",
    "TypeAdapter",
    "absent_or_exactly",
    "add_descriptor_file",
    "array_of",
    "at_most",
    "boolean",
    "character",
    "characters",
    "check_custom",
    "conversion_error",
    "each",
    "elements",
    "exactly",
    "fill_array",
    "fill_each",
    "finish_custom",
    "finish_ros_message",
    "float32",
    "in_range",
    "lazy_exports",
    "numbers",
    "octet",
    "octets",
    "packed",
    "packed_fields",
    "require_contract",
    "ros_character",
    "ros_characters",
    "ros_message_array",
    "ros_messages",
    "ros_octet",
    "ros_octets",
    "ros_string",
    "ros_wide",
    "sequence",
    "string",
    "text",
    "wide",
]
