"""The plugins, built."""

from __future__ import annotations

from pathlib import Path

import pytest

FOLDER = Path("build/plugins").absolute()


@pytest.fixture(scope="session")
def plugin_files() -> dict[str, Path]:
    """Our plugins by their encodings."""
    return {path.stem: path for path in FOLDER.glob("*.wasm")}
