"""Options and fixtures for all tests."""

from __future__ import annotations

import importlib
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.programs import run
from tests.things import generate_things


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


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder; definitions are found in it and in the embedded store alone."""
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "no ROS here"))
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work"


@pytest.fixture(scope="session")
def generated_things(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimpleNamespace]:
    """The package `things`, generated and imported."""
    folder = generate_things(tmp_path_factory.mktemp("things_root"))
    sys.path.insert(0, str(folder / "python"))
    modules = {
        name: importlib.import_module(f"things_root.things.{name}") for name in ("msg", "srv", "action")
    }
    yield SimpleNamespace(folder=folder, **modules)
    sys.path.remove(str(folder / "python"))


@pytest.fixture
def things(generated_things: SimpleNamespace) -> SimpleNamespace:
    """The package `things`, as it is tested: generated and imported, unless a test has something else in its place."""
    return generated_things


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this project."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    root = Path(__file__).parent.parent
    run(*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", folder, root, folder=folder)
    (file,) = folder.glob("*.whl")
    return file


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let Ctrl-C interrupt this program, and those that it starts: the shell has jobs in the background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
