"""Files of series, as pandas, pyarrow and NumPy read them."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import numpy
import pyarrow.csv
import pyarrow.feather
import pyarrow.parquet
import pytest

from rosidl_adapter_proto.errors import BagError, Error, RequestError
from rosidl_adapter_proto.plotjuggler import series_files
from rosidl_adapter_proto.plotjuggler.series import Series
from rosidl_adapter_proto.plotjuggler.series_files import series_names, write_series

TIMES = numpy.array([10, 20, 20, 30])


def series(topic: str, key: str, times: Any, values: Any, messages: Any = None) -> Series:
    return Series(topic, key, numpy.asarray(times, "i8"), values, messages)


SOME = (
    series("/a", "/x", TIMES, numpy.array([1.5, 2.5, numpy.nan, -0.0])),
    Series("/a", "/n", TIMES, numpy.array([1, 2, 2**63, 4], "u8")),
    series("/a", "/t", [20, 30], ["", 'a "b",\nä'], numpy.array([2, 3])),
    series("/b", "/ok", [20, 25], numpy.array([True, False])),
)
"""Series of two topics; one of them has two messages of the same time, of which the second has a text."""


def table(path: Path) -> Any:
    readers = {".parquet": pyarrow.parquet.read_table, ".csv": pyarrow.csv.read_csv}
    return readers.get(path.suffix, pyarrow.feather.read_table)(path)


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".feather"])
@pytest.mark.parametrize("cells", [1, 10, 2**22])
def test_a_table_has_a_row_for_each_message(
    suffix: str, cells: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(series_files, "_CELLS", cells)
    assert write_series(SOME, tmp_path / f"a{suffix}") == 5
    found = table(tmp_path / f"a{suffix}")
    types = {each.name: str(each.type) for each in found.schema}
    assert types == {
        "time": "timestamp[ns, tz=UTC]",
        "/a/x": "double",
        "/a/n": "uint64",
        "/a/t": "string",
        "/b/ok": "bool",
    }
    columns = {name: found[name].to_pylist() for name in types if name != "time"}
    assert found["time"].cast("int64").to_pylist() == [10, 20, 20, 25, 30]
    assert repr(columns) == repr(
        {
            "/a/x": [1.5, 2.5, numpy.nan, None, -0.0],
            "/a/n": [1, 2, 2**63, None, 4],
            "/a/t": [None, None, "", None, 'a "b",\nä'],
            "/b/ok": [None, True, None, False, None],
        }
    )
    assert [each.name for each in tmp_path.iterdir()] == [f"a{suffix}"]


def test_csv(tmp_path: Path) -> None:
    write_series(SOME, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text(encoding="utf-8") == (
        '"time","/a/x","/a/n","/a/t","/b/ok"\n'
        "1970-01-01 00:00:00.000000010Z,1.5,1,,\n"
        "1970-01-01 00:00:00.000000020Z,2.5,2,,true\n"
        '1970-01-01 00:00:00.000000020Z,nan,9223372036854775808,"",\n'
        "1970-01-01 00:00:00.000000025Z,,,,false\n"
        '1970-01-01 00:00:00.000000030Z,-0,4,"a ""b"",\nä",\n'
    )


def test_npz(tmp_path: Path) -> None:
    assert write_series(SOME, tmp_path / "a.npz") == 12
    with numpy.load(tmp_path / "a.npz", allow_pickle=False) as found:
        assert list(found) == [name for each in SOME for name in (each.name, f"{each.name} time")]
        for each in SOME:
            assert numpy.array_equal(found[f"{each.name} time"], each.times)
            assert found[each.name].tolist() == list(each.values) or each.name == "/a/x"
            assert found[each.name].dtype == numpy.asarray(each.values).dtype
        assert found["/a/x"].tobytes() == numpy.asarray(SOME[0].values).tobytes()


@pytest.mark.parametrize("name", ["a.parquet", "a.npz"])
def test_no_series(name: str, tmp_path: Path) -> None:
    assert write_series([], tmp_path / name) == 0


def test_names_that_are_the_same() -> None:
    nothing = numpy.array([])
    names = [("/a", "/b/c"), ("/a/b", "/c"), ("/a/b", "/c"), ("/a", "/b/c time"), ("ti", "me")]
    found = series_names([series(topic, key, [], nothing) for topic, key in names])
    assert found == ["/a/b/c", "/a/b/c (2)", "/a/b/c (3)", "/a/b/c time (2)", "time (2)"]


def test_an_npz_keeps_names_that_numpy_takes_itself(tmp_path: Path) -> None:
    write_series([series("file", "", [1], numpy.array([2]))], tmp_path / "a.npz")
    assert zipfile.ZipFile(tmp_path / "a.npz").namelist() == ["file.npy", "file time.npy"]


@pytest.mark.parametrize(
    ("name", "values", "error", "text"),
    [
        (
            "a.txt",
            numpy.array([1]),
            RequestError,
            "{}: the suffix says no format of series; name the file .csv, .parquet, .arrow, .feather, .npz",
        ),
        (
            "no/a.csv",
            numpy.array([1]),
            BagError,
            "cannot write {}: there is no folder {parent}; make it first",
        ),
        (
            "a.npz",
            ["a\0"],
            BagError,
            "/x/y has a text that ends with NUL, which NumPy would lose; write Parquet",
        ),
        (
            "a.npz",
            ["a" * 2**28, ""],
            BagError,
            "/x/y: an array of NumPy would give each of its 2 texts the 268435456 characters of the longest; write "
            "Parquet, or choose other series",
        ),
        (
            "a.csv",
            numpy.array([1, 2]),
            BagError,
            "/x/y has two values in one message, which is one row of a table; write .npz",
        ),
    ],
)
def test_what_cannot_be_written(
    name: str, values: Any, error: type[Error], text: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    expected = text.format(path, parent=path.parent)
    messages = numpy.zeros(len(values), "i8")
    with pytest.raises(error, match=f"^{re.escape(expected)}$"):
        write_series([series("/x", "/y", [1] * len(values), values, messages)], path)
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("mine")
    with pytest.raises(BagError, match="exists, and nothing is overwritten"):
        write_series(SOME, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text() == "mine"
