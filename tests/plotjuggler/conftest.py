"""Our plugins, built once."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from tests.plotjuggler.topics import ENCODINGS


@pytest.fixture(params=ENCODINGS)
def encoding(request: pytest.FixtureRequest) -> str:
    """The encoding of each of our plugins, for tests that are of all of them."""
    return str(request.param)


@pytest.fixture
def plugin(encoding: str) -> Path:
    """The plugin for the messages of an encoding."""
    return plugin_path(encoding)


@pytest.fixture(scope="session")
def plugin_files() -> dict[str, Path]:
    """All of them, by their encodings."""
    return {encoding: plugin_path(encoding) for encoding in ENCODINGS}
