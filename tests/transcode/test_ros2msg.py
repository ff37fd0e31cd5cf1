"""Recorded texts that the native core reads: the plans that Python makes of them, byte for byte."""

from __future__ import annotations

import pytest

from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.interfaces.recorded import ROS2MSG, recorded_text
from rosidl_adapter_proto.interfaces.store import distributions, is_ros1
from rosidl_adapter_proto.schema.registry import TypeRegistry
from rosidl_adapter_proto.transcode import _core
from tests.transcode.recorded_plans import plan_of_text


@pytest.mark.parametrize("distribution", [each for each in distributions() if not is_ros1(each)])
def test_every_message_of_the_store(distribution: str) -> None:
    source = store_source(distribution)
    registry = TypeRegistry(Catalog((source,)))
    names = [str(name) for package in source.packages.values() for name in package]
    assert len(names) > 100
    for name in names:
        encoding, text = recorded_text(registry.definitions(name))
        assert encoding == ROS2MSG
        assert _core.read_ros2msg(text, name) == plan_of_text(text, name).pack(), name
