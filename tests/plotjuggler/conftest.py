"""Our plugins, built once."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosidl_adapter_proto.plotjuggler.plugins import plugin_path


@pytest.fixture
def plugin(encoding: str) -> Path:
    """The plugin for the messages of an encoding, which the test has as a parameter."""
    return plugin_path(encoding)


@pytest.fixture(scope="session")
def plugin_files() -> dict[str, Path]:
    """All of them, by their encodings."""
    return {encoding: plugin_path(encoding) for encoding in ("protobuf", "ros2msg")}
