"""Tables as polars and pandas read them, and beside those that ptars makes of the same messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas
import polars
import ptars
import pyarrow as pa
import pytest

from benchmarks.bag_maker import IMU, JOINT_STATES, SCAN, SMALL_IMAGE, TF, Recorded, record, write_mcap
from rosidl_adapter_proto import TypeRegistry
from rosidl_adapter_proto.bags.table import table_reader, write_table
from rosidl_adapter_proto.transcode import Transcoder
from rosidl_adapter_proto.transcode.arrow import ColumnReader
from tests.columns import rows_of

STREAMS = (IMU, JOINT_STATES, SCAN, SMALL_IMAGE, TF)
POLARS: dict[str, Any] = {"parquet": polars.read_parquet, "arrow": polars.read_ipc}
PANDAS: dict[str, Any] = {"parquet": pandas.read_parquet, "arrow": pandas.read_feather}


@pytest.fixture(scope="module")
def recorded() -> list[Recorded]:
    return list(record(STREAMS, 1))


@pytest.fixture(scope="module")
def path(recorded: list[Recorded], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bag") / "bag.mcap"
    write_mcap(path, recorded, compression="zstd")
    return path


@pytest.mark.parametrize("suffix", POLARS)
@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.topic)
def test_polars(path: Path, stream: Any, suffix: str, tmp_path: Path) -> None:
    write_table(path, stream.topic, tmp_path / f"t.{suffix}")
    frame = POLARS[suffix](tmp_path / f"t.{suffix}")
    table = table_reader(path, stream.topic).read_all()
    assert frame.equals(polars.from_arrow(table))
    assert frame.schema["log_time"] == polars.Datetime("ns", "UTC")


@pytest.mark.parametrize("suffix", PANDAS)
@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.topic)
def test_pandas(path: Path, stream: Any, suffix: str, tmp_path: Path) -> None:
    write_table(path, stream.topic, tmp_path / f"t.{suffix}")
    frame = PANDAS[suffix](tmp_path / f"t.{suffix}")
    pandas.testing.assert_frame_equal(frame, table_reader(path, stream.topic).read_pandas())
    assert str(frame.dtypes["log_time"]) == "datetime64[ns, UTC]"


def test_csv(path: Path, tmp_path: Path) -> None:
    write_table(path, "/imu", tmp_path / "t.csv")
    table = table_reader(path, "/imu").read_all().flatten()
    expected = table["linear_acceleration.x"].to_pylist()
    assert polars.read_csv(tmp_path / "t.csv")["linear_acceleration.x"].to_list() == expected
    frame = pandas.read_csv(tmp_path / "t.csv", parse_dates=["log_time"])
    assert frame["log_time"].astype("int64").to_list() == table["log_time"].cast(pa.int64()).to_pylist()


def with_times(value: Any) -> Any:
    """Return a value of ptars, which knows no times, with times in nanoseconds."""
    if isinstance(value, list):
        return list(map(with_times, value))
    if not isinstance(value, dict):
        return value
    if value.keys() == {"sec", "nanosec"}:
        return value["sec"] * 10**9 + value["nanosec"]
    return {name: with_times(each) for name, each in value.items()}


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.topic)
def test_ptars_makes_the_same_of_protobuf(recorded: list[Recorded], stream: Any) -> None:
    schema = TypeRegistry()[stream.type_name]
    cdr = [each.data for each in recorded if each.stream == stream]
    transcoder = Transcoder(schema.type_description, schema.descriptor)
    handler: Any = ptars.HandlerPool([schema.descriptor.file]).get_for_message(schema.descriptor)
    theirs = handler.list_to_record_batch(list(map(transcoder.cdr_to_proto, cdr)))
    (ours,) = ColumnReader(schema).record_batches(cdr)
    assert rows_of(ours) == list(map(with_times, theirs.to_pylist()))
