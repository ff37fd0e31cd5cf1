"""What the tests with rclpy share: generated packages, a ROS domain of their own, a node, and a peer process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source
from tests.ros.support import Peer, Spinning, reserve_domain

PACKAGES = (
    "geometry_msgs",
    "sensor_msgs",
    "std_msgs",
    "std_srvs",
    "test_msgs",
    "trajectory_msgs",
    "visualization_msgs",
)


@pytest.fixture(scope="session")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with the generated packages, which can be imported."""
    pytest.importorskip("rclpy", reason="needs rclpy: pip install '.[ros]', or source a ROS 2 installation")
    output = tmp_path_factory.mktemp("generated")
    catalog = Catalog((*prefix_sources(), store_source()))
    # With the same options as in tests/generate, since one process can hold only one version of a .proto file.
    generate(Request(PACKAGES), catalog, output, Options(events=True))
    folder = output / "python"
    sys.path.insert(0, str(folder))
    yield folder
    sys.path.remove(str(folder))


@pytest.fixture(scope="session")
def ros(generated: Path) -> Iterator[None]:
    """An initialized rclpy, in a ROS domain that no other process uses."""
    import rclpy

    with reserve_domain() as domain:
        os.environ.update(ROS_DOMAIN_ID=str(domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        rclpy.init(args=[])
        yield
        rclpy.shutdown()


@pytest.fixture
def spin(ros: None) -> Iterator[Callable[..., Any]]:
    """Adds a node to an executor that spins in a thread; both are gone after the test."""
    spinning: list[Spinning] = []

    def start(node: Any, executor: Any = None) -> Any:
        spinning.append(Spinning(node, executor))
        return node

    yield start
    for each in reversed(spinning):
        each.stop()


@pytest.fixture
def node(ros: None, spin: Callable[..., Any]) -> Any:
    """A node of ours, spinning."""
    from rosidl_adapter_proto.ros import Node

    return spin(Node("tested"))


@pytest.fixture
def native_node(ros: None, spin: Callable[..., Any]) -> Any:
    """A node of rclpy, spinning."""
    import rclpy.node

    return spin(rclpy.node.Node("native"))


@pytest.fixture(scope="session")
def peer(ros: None, generated: Path) -> Iterator[Peer]:
    """Another process, in the same ROS domain."""
    with Peer(generated) as other:
        yield other
