"""Running the command line in an empty folder, away from any ROS installation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from rosidl_adapter_proto.cli import main
from tests.folders import write_package


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


@pytest.fixture(autouse=True)
def in_folder(folder: Path) -> None:
    """Every command runs in an empty folder."""


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs the command line."""

    def run(*arguments: str) -> Outcome:
        with pytest.raises(SystemExit) as ended:
            main(list(arguments))
        captured = capsys.readouterr()
        assert isinstance(ended.value.code, int)
        return Outcome(ended.value.code, captured.out, captured.err)

    return run


@pytest.fixture
def my_msgs(folder: Path) -> Path:
    """A package in `src/my_msgs`."""
    return write_package(folder / "src" / "my_msgs", {"msg/A.msg": "bool a\n"})
