"""Tables of topics: what pyarrow reads of them is what rosbags finds in the messages."""

from __future__ import annotations

import contextlib
import csv
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from reference_cdr import write_cdr
from ros_types import Types, struct_type

from benchmarks.bag_maker import (
    IMU,
    JOINT_STATES,
    SCAN,
    SMALL_IMAGE,
    START,
    TF,
    Recorded,
    record,
    typestore,
    write_folder,
    write_mcap,
)
from rosidl_adapter_proto import BagError, SchemaError, open_bag
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.table import record_batches, table_reader, write_table
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.errors import Error, RequestError
from tests.columns import rows_of

STREAMS = (IMU, JOINT_STATES, SCAN, SMALL_IMAGE, TF)
READERS = {
    "t.parquet": pyarrow.parquet.read_table,
    "t.arrow": pyarrow.feather.read_table,
    "t.feather": pyarrow.feather.read_table,
}


@pytest.fixture(scope="module")
def recorded() -> list[Recorded]:
    return list(record(STREAMS, 1))


@pytest.fixture(scope="module")
def path(recorded: list[Recorded], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bag of CDR messages."""
    path = tmp_path_factory.mktemp("bag") / "bag.mcap"
    write_mcap(path, recorded, compression="zstd", chunk_size=10_000)
    return path


def plain(value: Any) -> Any:
    """Return a value of rosbags as rows of tables have it."""
    if getattr(value, "__msgtype__", "") == "builtin_interfaces/msg/Time":
        return value.sec * 10**9 + value.nanosec
    if hasattr(value, "__msgtype__"):
        return {name: plain(each) for name, each in vars(value).items() if name != "__msgtype__"}
    if isinstance(value, numpy.ndarray):
        return value.tobytes() if value.dtype == numpy.uint8 else value.tolist()
    return list(map(plain, value)) if isinstance(value, list) else value


def expected_rows(recorded: list[Recorded], topic: str) -> list[dict[str, Any]]:
    return [
        {
            "log_time": each.log_time,
            "publish_time": each.log_time - 1000,
            **plain(typestore().deserialize_cdr(each.data, each.stream.type_name)),
        }
        for each in recorded
        if each.stream.topic == topic
    ]


def rows(table: pa.Table) -> list[dict[str, Any]]:
    return [row for batch in table.to_batches() for row in rows_of(batch)]


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.topic)
def test_rows_are_messages(path: Path, recorded: list[Recorded], stream: Any) -> None:
    assert rows(table_reader(path, stream.topic).read_all()) == expected_rows(recorded, stream.topic)


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.topic)
@pytest.mark.parametrize("name", READERS)
def test_files(path: Path, stream: Any, name: str, tmp_path: Path) -> None:
    reader = table_reader(path, stream.topic)
    table = reader.read_all()
    assert write_table(path, stream.topic, tmp_path / name) == table.num_rows
    found = READERS[name](tmp_path / name)
    assert found.schema.equals(table.schema)
    assert found.equals(table)
    assert [each.name for each in tmp_path.iterdir()] == [name]


def test_protobuf_bags(path: Path, recorded: list[Recorded], tmp_path: Path) -> None:
    convert_bag(path, tmp_path / "protobuf", target_format="protobuf")
    for stream in STREAMS:
        table = table_reader(tmp_path / "protobuf", stream.topic).read_all()
        assert rows(table) == expected_rows(recorded, stream.topic)


def test_sqlite3_bags(recorded: list[Recorded], tmp_path: Path) -> None:
    write_folder(tmp_path / "bag", recorded)
    found = rows(table_reader(tmp_path / "bag", "/tf").read_all())
    expected = expected_rows(recorded, "/tf")
    for row in expected:
        row["publish_time"] = row["log_time"]  # this recorder did not know
    assert found == expected


def test_chosen_fields_and_times(path: Path, recorded: list[Recorded]) -> None:
    table = table_reader(
        path,
        "/imu",
        fields=["header.stamp", "linear_acceleration"],
        start=START + 10**8,
        end=START + 2 * 10**8,
    ).read_all()
    assert rows(table) == [
        {
            "log_time": row["log_time"],
            "publish_time": row["publish_time"],
            "header": {"stamp": row["header"]["stamp"]},
            "linear_acceleration": row["linear_acceleration"],
        }
        for row in expected_rows(recorded, "/imu")
        if START + 10**8 <= row["log_time"] < START + 2 * 10**8
    ]


def test_record_batches_have_bounded_size(path: Path) -> None:
    assert [each.num_rows for each in record_batches(path, "/imu", maximum_rows=80)] == [80, 80, 40]
    batches = list(record_batches(path, "/scan", maximum_bytes=12_000))
    assert [each.num_rows for each in batches] == [3] * 6 + [2]


# Types that are made here: messages of rosbags' store have no such fields -------------------------------------------


def write_one(path: Path, definition: str, *messages: bytes, times: list[int] | None = None) -> Path:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema("test_msgs/msg/T", "ros2msg", definition.encode())
        channel = writer.register_channel("/t", "cdr", schema)
        for index, each in enumerate(messages):
            time = times[index] if times else index
            writer.add_message(channel, time, each, time)
        writer.finish()
    return path


def test_columns_of_messages_keep_their_names(tmp_path: Path) -> None:
    path = write_one(tmp_path / "b.mcap", "int8 log_time\nint8 x\n", b"\0\1\0\0\7\1")
    (row,) = rows(table_reader(path, "/t").read_all())
    assert row == {"_log_time": 0, "publish_time": 0, "log_time": 7, "x": 1}


def test_rows_come_in_the_order_of_time(tmp_path: Path) -> None:
    messages = [b"\0\1\0\0" + bytes([each]) for each in range(4)]
    path = write_one(tmp_path / "b.mcap", "uint8 x\n", *messages, times=[3, 1, 2, 0])
    assert [row["x"] for row in rows(table_reader(path, "/t").read_all())] == [3, 1, 2, 0]


def test_messages_without_fields(tmp_path: Path) -> None:
    path = write_one(tmp_path / "b.mcap", "", b"\0\1\0\0\0", b"\0\1\0\0\0")
    assert rows(table_reader(path, "/t").read_all()) == [
        {"log_time": 0, "publish_time": 0},
        {"log_time": 1, "publish_time": 1},
    ]


CSV_DEFINITION = """\
bool flag
uint8[] blob
float32[2] pair
string[] names
string name
builtin_interfaces/Time stamp
x/Inner[] inner
x/Inner one
"""
CSV_PARTS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec\n",
    "x/Inner": "builtin_interfaces/Time at\nuint8[3] key\nint64 n\nfloat64 d\nbuiltin_interfaces/Duration took\n",
}
CSV_TYPES: Types = {
    **struct_type("builtin_interfaces/msg/Time", sec="int32", nanosec="uint32"),
    **struct_type("builtin_interfaces/msg/Duration", sec="int32", nanosec="uint32"),
    **struct_type(
        "x/msg/Inner",
        at="builtin_interfaces/msg/Time",
        key="uint8[3]",
        n="int64",
        d="double",
        took="builtin_interfaces/msg/Duration",
    ),
    **struct_type(
        "test_msgs/msg/T",
        flag="boolean",
        blob="uint8[]",
        pair="float[2]",
        names="string[]",
        name="string",
        stamp="builtin_interfaces/msg/Time",
        inner="x/msg/Inner[]",
        one="x/msg/Inner",
    ),
}


def test_csv(tmp_path: Path) -> None:
    inner = {
        "at": {"sec": 1, "nanosec": 2},
        "key": b"\1\2\3",
        "n": 2**60,
        "d": float("nan"),
        "took": {"sec": -1, "nanosec": 5},
    }
    value = {
        "flag": True,
        "blob": b"\xfe\xff",
        "pair": [0.1, float("inf")],
        "names": ['a"b', "c,\n\u00e9"],
        "name": 'a"b,\nc',
        "stamp": {"sec": 1_700_000_000, "nanosec": 5},
        "inner": [inner, inner],
        "one": inner,
    }
    parts = (f"{'=' * 80}\nMSG: {name}\n{text}" for name, text in CSV_PARTS.items())
    message = write_cdr(CSV_TYPES, "test_msgs/msg/T", value)
    path = write_one(tmp_path / "b.mcap", CSV_DEFINITION + "".join(parts), message)
    assert write_table(path, "/t", tmp_path / "t.csv") == 1
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    json_inner = (
        '{"at":"1970-01-01 00:00:01.000000002","key":"AQID","n":1152921504606846976,"d":"NaN",'
        '"took":-999999995}'
    )
    assert row == {
        "log_time": "1970-01-01 00:00:00.000000000Z",
        "publish_time": "1970-01-01 00:00:00.000000000Z",
        "flag": "true",
        "blob": "/v8=",
        "pair": '[0.1,"Infinity"]',
        "names": '["a\\"b","c,\\n\u00e9"]',
        "name": 'a"b,\nc',
        "stamp": "2023-11-14 22:13:20.000000005",
        "inner": f"[{json_inner},{json_inner}]",
        "one.at": "1970-01-01 00:00:01.000000002",
        "one.key": "AQID",
        "one.n": "1152921504606846976",
        "one.d": "nan",
        "one.took": "-999999995",
    }
    assert json.loads(row["inner"])[0]["n"] == 2**60


# What goes wrong -----------------------------------------------------------------------------------------------------


def error(kind: type[Exception], call: Callable[[], object]) -> str:
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value)


def test_what_is_asked_for_is_not_there(path: Path, tmp_path: Path) -> None:
    assert (
        error(RequestError, lambda: table_reader(path, "/im"))
        == f"{path}: there is no topic /im; did you mean /imu?"
    )
    assert error(SchemaError, lambda: table_reader(path, "/imu", fields=["heade.stamp"])) == (
        "sensor_msgs/msg/Imu has no field 'heade'; did you mean 'header'?"
    )
    assert error(TypeError, lambda: table_reader(path, "/imu", fields="header")) == (
        "fields must be a list of names, such as ['header'], not a text"
    )
    output = tmp_path / "t.txt"
    assert error(RequestError, lambda: write_table(path, "/imu", output)) == (
        f"{output}: the suffix says no format of tables; name the file .parquet, .arrow, .feather, .csv, or give a "
        "format"
    )
    assert error(RequestError, lambda: write_table(path, "/imu", output, file_format="json")) == (
        "there is no format 'json' of tables; there are parquet, arrow, csv"
    )
    output.write_text("mine")
    assert error(BagError, lambda: write_table(path, "/imu", output, file_format="csv")) == (
        f"{output} exists, and nothing is overwritten; choose another name, or remove it"
    )
    assert output.read_text() == "mine"


def test_a_message_that_is_not_valid(tmp_path: Path) -> None:
    path = write_one(tmp_path / "b.mcap", "bool x\n", b"\0\1\0\0\1", b"\0\1\0\0\1", b"\0\1\0\0\2")
    text = (
        f"{path}: message 3 of /t, recorded at 2: test_msgs/msg/T.x at byte 4: a boolean is 0 or 1 and this one "
        "is 2; the data is damaged or of another type"
    )
    assert error(BagError, lambda: table_reader(path, "/t").read_all()) == text
    assert error(BagError, lambda: list(record_batches(path, "/t", maximum_rows=1))) == text
    assert error(BagError, lambda: write_table(path, "/t", tmp_path / "t.parquet")) == text
    assert [each.name for each in tmp_path.iterdir()] == ["b.mcap"]


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(data=st.data())
def test_damaged_files(recorded: list[Recorded], tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "b.mcap"
    messages = [each for each in recorded if each.stream in (JOINT_STATES, TF)][:20]
    write_mcap(path, messages, compression=data.draw(st.sampled_from(["", "zstd"])), chunk_size=3000)
    damaged = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 5))):
        place = data.draw(st.integers(0, len(damaged) - 1))
        damaged[place] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    with contextlib.suppress(Error):
        for batch in record_batches(path, "/tf"):
            batch.validate(full=True)


def test_a_time_that_no_timestamp_has(tmp_path: Path) -> None:
    path = write_one(tmp_path / "b.mcap", "bool x\n", b"\0\1\0\0\1", times=[2**63])
    assert error(BagError, lambda: table_reader(path, "/t").read_all()) == (
        "a message of /t has the time 9223372036854775808, and no timestamp goes beyond 9223372036854775807 (the year "
        "2262)"
    )


def write_two(path: Path, first: str, second: str) -> Path:
    """Write a topic that changes its type."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="ros2", library="test")
        for time, definition in enumerate((first, second, first)):
            schema = writer.register_schema(f"test_msgs/msg/T{time % 2}", "ros2msg", definition.encode())
            channel = writer.register_channel("/t", "cdr", schema)
            writer.add_message(channel, time, b"\0\1\0\0" + bytes([time, 7])[: definition.count("\n")], time)
        writer.finish()
    return path


def test_a_topic_of_several_types(tmp_path: Path) -> None:
    path = write_two(tmp_path / "b.mcap", "uint8 x\n", "uint8 x\nuint8 y\n")
    assert error(BagError, lambda: table_reader(path, "/t")).startswith(
        f"{path}: /t has messages of several types, whose columns are not the same: test_msgs/msg/T0 (RIHS01_"
    )
    batches = list(record_batches(path, "/t", fields=["x"]))
    assert [row["x"] for batch in batches for row in rows_of(batch)] == [0, 1, 2]


def test_other_serialization_formats(tmp_path: Path) -> None:
    from mcap.writer import Writer

    path = tmp_path / "b.mcap"
    with path.open("wb") as file:
        writer: Any = Writer(file)
        writer.start()
        schema = writer.register_schema("test_msgs/msg/T", "ros2msg", b"bool x\n")
        writer.add_message(writer.register_channel("/t", "cbor", schema), 0, b"", 0)
        writer.finish()
    assert error(BagError, lambda: table_reader(path, "/t")) == (
        "topic /t: its messages are cbor, which cannot be read as a table; cdr, protobuf, ros1 can"
    )


# The command ---------------------------------------------------------------------------------------------------------


def test_command(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "t.parquet"
    arguments = [
        "bag",
        "table",
        str(path),
        "/imu",
        "--output",
        str(output),
        "--fields",
        "header.stamp, orientation.w",
    ]
    with pytest.raises(SystemExit) as caught:
        main([*arguments, "--start", str(START + 10**8), "--end", "2023-11-14T22:13:20.2Z"])
    assert (caught.value.code, capsys.readouterr().out) == (0, f"{output}: 20 rows\n")
    table = pyarrow.parquet.read_table(output)
    assert table.column_names == ["log_time", "publish_time", "header", "orientation"]
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert (caught.value.code, capsys.readouterr().err) == (
        3,
        f"Error: {output} exists, and nothing is overwritten; choose another name, or remove it\n",
    )


def test_a_bag_that_was_cut_off(path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole = path.read_bytes()
    cut, output = tmp_path / "cut.mcap", tmp_path / "t.parquet"
    cut.write_bytes(whole[: len(whole) // 2])
    arguments = ["bag", "table", str(cut), "/imu", "--output", str(output)]
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert (caught.value.code, output.exists()) == (3, False)
    capsys.readouterr()

    with pytest.raises(SystemExit) as caught:
        main([*arguments, "--salvage"])

    out, err = capsys.readouterr()
    rows = len(pyarrow.parquet.read_table(output))
    assert (caught.value.code, out) == (1, f"{output}: {rows} rows\n")
    assert rows == len(list(open_bag(cut, salvage=True).messages("/imu"))) > 0
    assert f"Warning: {cut} at byte " in err


def test_no_table_to_the_standard_output(
    path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(path.parent)
    with pytest.raises(SystemExit) as caught:
        main(["bag", "table", str(path), "/imu", "--output", "-", "--format", "csv"])
    assert (caught.value.code, capsys.readouterr()) == (
        2,
        ("", "Error: a table cannot go to the standard output; name a file\n"),
    )
    assert not Path("-").exists()


def test_without_pyarrow(path: Path) -> None:
    program = (
        "import sys; sys.modules['pyarrow'] = None\n"
        "from rosidl_adapter_proto.cli import main\n"
        f"main(['bag', 'table', {str(path)!r}, '/imu', '--output', 'x.parquet'])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (
        2,
        "Error: tables need pyarrow (import of pyarrow halted; None in sys.modules); pip install "
        "'rosidl-adapter-proto[tables]'\n",
    )
