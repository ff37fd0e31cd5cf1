"""Our plugins, built once."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosidl_adapter_proto.plotjuggler.plugins import plugin_path


@pytest.fixture
def plugin(encoding: str) -> Path:
    """The plugin for the messages of an encoding, which the test has as a parameter."""
    return plugin_path(encoding)
