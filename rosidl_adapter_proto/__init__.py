"""Protobuf types and type adapters for ROS 2 interfaces.

The names here are imported when they are first asked for: generated packages import `rosidl_adapter_proto.adapter`
through this package, and that must stay cheap.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rosidl_adapter_proto.adapter.runtime import adapter_for
    from rosidl_adapter_proto.bags.bag import open_bag
    from rosidl_adapter_proto.bags.convert import convert_bag
    from rosidl_adapter_proto.errors import (
        BagError,
        ConversionError,
        ConverterError,
        DefinitionError,
        Error,
        GenerateError,
        PlaceError,
        RequestError,
        SchemaError,
    )
    from rosidl_adapter_proto.schema.numbering import compute_proto_field_number
    from rosidl_adapter_proto.schema.registry import Schema, TypeRegistry
    from rosidl_adapter_proto.schema.typemap import (
        MSG_TYPE_TO_PROTO,
        PROTO_ACTION_GET_RESULT_CALL_NAME,
        PROTO_ACTION_SEND_GOAL_CALL_NAME,
        PROTO_PACKAGE_POSTFIX,
        PROTO_SERVICE_CALL_NAME,
    )

__version__ = "0.1.0"  # pyproject.toml reads it here

__all__ = [
    "MSG_TYPE_TO_PROTO",
    "PROTO_ACTION_GET_RESULT_CALL_NAME",
    "PROTO_ACTION_SEND_GOAL_CALL_NAME",
    "PROTO_PACKAGE_POSTFIX",
    "PROTO_SERVICE_CALL_NAME",
    "BagError",
    "ConversionError",
    "ConverterError",
    "DefinitionError",
    "Error",
    "GenerateError",
    "PlaceError",
    "RequestError",
    "Schema",
    "SchemaError",
    "TypeRegistry",
    "adapter_for",
    "compute_proto_field_number",
    "convert_bag",
    "open_bag",
]


_MODULES = (
    "errors",
    "schema.typemap",
    "schema.numbering",
    "schema.registry",
    "adapter.runtime",
    "bags.bag",
    "bags.convert",
)


def __getattr__(name: str) -> Any:
    for module in _MODULES if name in __all__ else ():
        if hasattr(imported := importlib.import_module(f"{__name__}.{module}"), name):
            return getattr(imported, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
