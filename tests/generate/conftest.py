"""Everything that the ROS installation of this Python has, generated once for all tests of a session."""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

# Make the setters of ROS messages check what they are given (Kilted and later; older ones always do).
os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")

from rosidl_adapter_proto.adapter import TypeAdapter
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.generate.settings import OPTIONS, Kind
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.strategies import RosMessages, message_names

EVERY_FLAG: dict[str, Any] = {each.attribute: True for each in OPTIONS if each.kind is Kind.FLAG}
"""Options with which everything is made that is optional."""


@dataclass(frozen=True)
class Generated:
    """A generated folder whose Python packages can be imported."""

    folder: Path
    catalog: Catalog
    interfaces: tuple[TypeName, ...]

    def adapter(self, name: TypeName) -> Any:
        """Import an adapter."""
        package = importlib.import_module(f"rosidl_proto.{name.package}.{name.namespace}")
        return getattr(package, f"{name.name}Adapter")

    def messages(self) -> list[TypeName]:
        """Return every message, those of services and actions included."""
        return message_names(self.catalog, list(self.interfaces))


@pytest.fixture(scope="session")
def ros_install(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Generated]:
    """All packages of the ROS installation that have Python classes."""
    pytest.importorskip("rclpy", reason="needs a ROS installation: pip install '.[ros]'")
    catalog = Catalog((*prefix_sources(), store_source()))
    packages = [
        name
        for source in catalog.sources
        if source.origin.startswith("ROS prefix")
        for name in source.packages
        if (spec := importlib.util.find_spec(name)) and spec.origin
    ]
    folder = tmp_path_factory.mktemp("ros_install")
    result = generate(Request(tuple(packages)), catalog, folder, Options(events=True))
    sys.path.insert(0, str(folder / "python"))
    yield Generated(folder, catalog, result.interfaces)
    sys.path.remove(str(folder / "python"))


@pytest.fixture(scope="session")
def ros_messages(ros_install: Generated) -> RosMessages:
    """Strategies for every message of the ROS installation."""
    adapters: dict[TypeName, type[TypeAdapter[Any, Any]]] = {
        name: ros_install.adapter(name) for name in ros_install.messages()
    }
    return RosMessages(ros_install.catalog, adapters)
