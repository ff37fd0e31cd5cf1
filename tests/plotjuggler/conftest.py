"""The plugins, built once for each version of their sources."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosidl_adapter_proto.plotjuggler.build import build_plugins, source_digest

BUILT = Path(__file__).parent.parent.parent / "build" / "plugins"


@pytest.fixture(scope="session")
def plugin_files() -> dict[str, Path]:
    """Our plugins by their encodings."""
    folder = BUILT / source_digest()
    paths = sorted(folder.glob("*.wasm")) or build_plugins(folder)
    return {path.stem: path for path in paths}
