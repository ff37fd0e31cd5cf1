"""Options and fixtures for all tests."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what `make golden` uses."""
    parser.addoption("--update-golden", action="store_true", help="write the golden files anew")


@pytest.fixture(scope="session")
def ros_prefix() -> Path:
    """The ROS installation in the environment of this Python; without it, the test is skipped."""
    prefix = Path(sys.prefix)
    if not (prefix / "share" / "std_msgs" / "msg" / "String.json").is_file():
        pytest.skip("needs the ROS wheels: pip install '.[ros]'")
    return prefix
