"""Distributions with plugins, as pip installs them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from tests.converters.plugins import install


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Install a distribution: `installed("my-package", json_converter="module:Class")`."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return partial(install, tmp_path)
