"""Bags converted by the tasks of a Ray cluster."""

from __future__ import annotations

import builtins
import os
import signal
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.message import Message

from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.many import BagsProgress, convert_bags, plan_bags
from rosidl_adapter_proto.bags.ray_workers import ray_workers
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.converters import (
    ConverterRegistry,
    SerializationFormatSerializer,
    SerializedBagMessage,
)
from rosidl_adapter_proto.errors import PlaceError, RequestError
from rosidl_adapter_proto.schema.registry import Schema
from tests.bags.recordings import START, Recorded, contents, mcap_bytes, strings


class Killing(SerializationFormatSerializer):
    """Takes the process with it."""

    serialization_format = "killing"

    def serialize(
        self, ros_message: Message, type_support: Schema, serialized_message: SerializedBagMessage
    ) -> None:
        os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture(autouse=True)
def in_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test has an empty folder, which is not that of the cluster, with two bags; the second has a bad message."""
    monkeypatch.setattr("rosidl_adapter_proto.bags.workers._FIRST_DELAY", 0)
    Path("a").mkdir()
    for i in range(3):
        Path(f"a/a_{i}.mcap").write_bytes(mcap_bytes(strings("/a", 5, first=5 * i)))
    bad = Recorded("/a", START + 10**12, b"\0\1\0\0bad")
    Path("b.mcap").write_bytes(mcap_bytes([*strings("/a", 12), bad]))


def test_many(cluster: Any) -> None:
    progress: list[BagsProgress] = []
    with ray_workers() as workers:
        outcomes = convert_bags(plan_bags(["a", "b.mcap"], "out"), workers=workers, progress=progress.append)
        again = convert_bags(plan_bags(["a"], "out"), workers=workers)
    done, failed = sorted(outcomes, key=lambda outcome: outcome.source)
    assert workers.count == 2 and cluster.is_initialized()
    assert done.result and done.result.total.converted == 15
    assert "message 13 of /a, recorded at 1700001000000000000" in failed.error
    assert progress[-1].bags_done == 2 and progress[-1].message_count == 15
    assert [outcome.was_there for outcome in again] == [True]
    convert_bag("a", "here")
    for i in range(3):
        assert contents(Path(f"out/a/a_{i}.mcap")) == contents(Path(f"here/a_{i}.mcap"))


def test_the_command(cluster: Any, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["bag", "convert", "a", "b.mcap", "out", "--on-error", "skip", "--ray"])
    assert ended.value.code == 1
    assert "2 bags: 1 converted, 1 incomplete; in " in capsys.readouterr().out


def test_a_machine_of_the_cluster_is_lost(cluster: Any) -> None:
    registry = ConverterRegistry()
    registry.load("tests.bags.peers.test_ray:Killing")
    with ray_workers(count=2, retries=1) as workers, pytest.raises(PlaceError) as error:
        convert_bag("b.mcap", "out.mcap", target_format="killing", registry=registry, workers=workers)
    assert str(error.value).startswith("b.mcap: Ray: ")
    assert not Path("out.mcap").exists()


@pytest.mark.usefixtures("cluster")
def test_ray_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def importing(name: str, *rest: Any, **options: Any) -> Any:
        if name == "ray":
            raise ImportError(name)
        return real(name, *rest, **options)

    monkeypatch.setattr(builtins, "__import__", importing)
    with pytest.raises(RequestError) as error, ray_workers():
        pass
    assert str(error.value) == "Ray is not installed; `pip install 'rosidl-adapter-proto[ray]'`"
