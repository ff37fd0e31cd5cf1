"""Bags whose bytes were changed: only errors of this package come out, and what comes out is bounded."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks import bag_maker
from benchmarks.bag_maker import IMU, TF, record
from rosidl_adapter_proto import Error, open_bag

Change = tuple[float, bytes]
"""Where in the file, as a part of it, and what stands there instead."""

CHANGES = st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=9)), min_size=1, max_size=4)


@pytest.fixture(scope="module", params=["", "lz4", "zstd", "sqlite3"])
def original(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a bag."""
    folder = tmp_path_factory.mktemp("original")
    messages = record([IMU, TF], 0.3)
    if request.param == "sqlite3":
        bag_maker.write_folder(folder / "bag", messages)
        (path,) = (folder / "bag").glob("*.db3")
        return path
    bag_maker.write_mcap(folder / "bag.mcap", messages, compression=request.param, chunk_size=5_000)
    return folder / "bag.mcap"


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=CHANGES, kept=st.sampled_from([1.0, 1.0, 0.5, 0.9]), salvage=st.booleans())
def test_only_our_errors_come_out(
    original: Path, tmp_path: Path, changes: list[Change], kept: float, salvage: bool
) -> None:
    data = bytearray(original.read_bytes())
    for place, replacement in changes:
        at = int(place * len(data))
        data[at : at + len(replacement)] = replacement
    path = tmp_path / original.name
    path.write_bytes(data[: int(kept * len(data))])

    with contextlib.suppress(Error), open_bag(path, salvage=salvage) as bag:
        for count, recorded in enumerate(bag.messages()):
            assert count < len(data)
            with contextlib.suppress(Error):
                recorded.message  # noqa: B018
