"""Generates `.proto` files, protobuf classes and adapters: `generate` is what every command and hook calls."""

from __future__ import annotations

from rosidl_adapter_proto.generate.request import Request
from rosidl_adapter_proto.generate.run import Result, check_definitions, generate, proto_text
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.generate.targets import Progress

__all__ = (
    "Options",
    "Progress",
    "Request",
    "Result",
    "check_definitions",
    "generate",
    "proto_text",
)
