"""Files of time series: CSV, Parquet and Arrow have a column for each series, and NumPy's npz two arrays.

A row of a table is a time, and has what was recorded then; where a series has nothing, the cell is empty. So the series
of one topic have their values side by side, and several topics take turns.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy

from rosidl_adapter_proto.bags.output import check_new, written_aside
from rosidl_adapter_proto.bags.places import Place, find_place, written_locally
from rosidl_adapter_proto.errors import BagError, RequestError
from rosidl_adapter_proto.plotjuggler.series_model import Series

if TYPE_CHECKING:
    import pyarrow as pa
    from numpy.typing import NDArray

TIME = "time"
NPZ = ".npz"
SUFFIXES = (".csv", ".parquet", ".arrow", ".feather", NPZ)
TIMES_OF = "{} time"
_NO_MESSAGE = 2**63 - 1
_CELLS = 2**22
"""So many cells are in memory at a time while a table is written."""
_LARGEST_TEXTS = 2**30
"""The most bytes that an array of texts may take, since NumPy gives each the length of the longest."""


def check_file(output: str | os.PathLike[str]) -> Place:
    """Return where series are to be written; nothing may be there.

    Raises:
        RequestError: Its suffix is none of `SUFFIXES`, or what writes such files is not installed.
        BagError: Something is there, or the folder is not.
    """
    path = find_place(output)
    if path.suffix.lower() not in SUFFIXES:
        raise RequestError(
            f"{path}: the suffix says no format of series; name the file {', '.join(SUFFIXES)}"
        )
    if path.suffix.lower() != NPZ:
        try:
            import rosidl_adapter_proto.transcode.arrow  # noqa: F401
        except ImportError as error:
            raise RequestError(str(error)) from None
    check_new(path)
    return path


def write_series(series: Iterable[Series], output: str | os.PathLike[str]) -> int:
    """Write series to a file, which appears when it is complete.

    Args:
        series: The series.
        output: The file, by a path or a URL; its suffix says what is written.

    Returns:
        How many rows a table has, or how many values all arrays together.

    Raises:
        RequestError: As for `check_file`.
        BagError: As for `check_file`, or the file cannot be written, or cannot hold a text.
    """
    path = check_file(output)
    named = dict(zip(series_names(found := list(series)), found, strict=True))
    with written_aside(path, is_folder=False) as place, written_locally(place) as local:
        if path.suffix.lower() == NPZ:
            return _write_npz(local, named)
        return _write_table(local, named)


def series_names(series: Sequence[Series]) -> list[str]:
    """Return names for columns: topic and key, and behind that a number for series that would have the same."""
    names: list[str] = []
    taken = {TIME}
    for each in series:
        name, number = each.name, 1
        while name in taken or TIMES_OF.format(name) in taken:
            number += 1
            name = f"{each.name} ({number})"
        taken |= {name, TIMES_OF.format(name)}
        names.append(name)
    return names


def _write_npz(path: Path, series: dict[str, Series]) -> int:
    # numpy.savez takes names as keyword arguments, of which it has some of its own.
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, each in series.items():
            for member, array in ((name, _array(name, each)), (TIMES_OF.format(name), each.times)):
                with archive.open(f"{member}.npy", "w", force_zip64=True) as file:
                    numpy.lib.format.write_array(file, array, allow_pickle=False)
    return sum(len(each) for each in series.values())


def _array(name: str, series: Series) -> NDArray[Any]:
    if not isinstance(series.values, list):
        return series.values
    longest = max(map(len, series.values), default=0)
    if 4 * longest * len(series.values) > _LARGEST_TEXTS:
        raise BagError(
            f"{name}: an array of NumPy would give each of its {len(series.values)} texts the {longest} characters of "
            "the longest; write Parquet, or choose other series"
        )
    if any(each.endswith("\0") for each in series.values):
        raise BagError(f"{name} has a text that ends with NUL, which NumPy would lose; write Parquet")
    return numpy.array(series.values, dtype=f"U{max(longest, 1)}")


def _write_table(path: Path, series: dict[str, Series]) -> int:
    from rosidl_adapter_proto.bags.table_files import format_of, open_table
    from rosidl_adapter_proto.transcode.arrow import pa

    times, rows = _rows(list(series.values()))
    for name, places in zip(series, rows, strict=True):
        if not numpy.all(places[:-1] < places[1:]):
            raise BagError(f"{name} has two values in one message, which is one row of a table; write {NPZ}")
    schema = pa.schema(
        [
            pa.field(TIME, pa.timestamp("ns", "UTC"), nullable=False),
            *(pa.field(name, _arrow_type(each, pa)) for name, each in series.items()),
        ]
    )
    with open_table(path, format_of(path, None), schema) as table:
        for batch in _record_batches(times, rows, list(series.values()), schema, pa):
            table.write(batch)
    return len(times)


def _rows(series: Sequence[Series]) -> tuple[NDArray[numpy.int64], list[NDArray[numpy.int64]]]:
    """Return the time of each row, and for each series the rows that its values are in.

    A time has as many rows as one topic has messages of it: what is of one message stands in one row.
    """
    distinct = {id(each.times): each for each in series}  # most series of a topic share their times
    if not distinct:
        return numpy.empty(0, numpy.int64), []
    known = numpy.unique(numpy.concatenate([each.times for each in distinct.values()]))
    places = {key: numpy.searchsorted(known, each.times) for key, each in distinct.items()}
    messages = {key: _messages(each) for key, each in distinct.items()}
    first_messages: dict[str, NDArray[numpy.int64]] = {}
    for key, each in distinct.items():
        first = first_messages.setdefault(each.topic, numpy.full(len(known), _NO_MESSAGE))
        numpy.minimum.at(first, places[key], messages[key])
    counts = numpy.ones(len(known), numpy.int64)
    for key, each in distinct.items():
        messages[key] = messages[key] - first_messages[each.topic][places[key]]
        numpy.maximum.at(counts, places[key], messages[key] + 1)
    first_rows = numpy.cumsum(counts) - counts
    rows = {key: first_rows[each] + messages[key] for key, each in places.items()}
    return numpy.repeat(known, counts), [rows[id(each.times)] for each in series]


def _messages(series: Series) -> NDArray[numpy.int64]:
    return numpy.arange(len(series)) if series.messages is None else series.messages


def _arrow_type(series: Series, pa: Any) -> pa.DataType:
    return pa.string() if isinstance(series.values, list) else pa.from_numpy_dtype(series.values.dtype)


def _record_batches(
    times: NDArray[numpy.int64],
    rows: Sequence[NDArray[numpy.int64]],
    series: Sequence[Series],
    schema: pa.Schema,
    pa: Any,
) -> Iterator[pa.RecordBatch]:
    step = max(_CELLS // len(schema), 1)
    for start in range(0, len(times), step):
        stop = min(start + step, len(times))
        columns = [pa.array(times[start:stop], pa.int64()).cast(schema.field(0).type)]
        for each, places, field in zip(series, rows, list(schema)[1:], strict=True):
            first, last = numpy.searchsorted(places, [start, stop])
            columns.append(
                _column(each.values[first:last], places[first:last] - start, stop - start, field.type, pa)
            )
        yield pa.RecordBatch.from_arrays(columns, schema=schema)


def _column(values: Any, places: NDArray[numpy.int64], length: int, arrow_type: Any, pa: Any) -> pa.Array:
    """Return a column of some rows, empty in those that a series has no value for."""
    if len(values) == length:
        return pa.array(values, arrow_type)
    if isinstance(values, list):
        texts: list[str | None] = [None] * length
        for place, value in zip(places.tolist(), values, strict=True):
            texts[place] = value
        return pa.array(texts, arrow_type)
    numbers = numpy.zeros(length, values.dtype)
    is_empty = numpy.ones(length, numpy.bool_)
    numbers[places], is_empty[places] = values, False
    return pa.array(numbers, arrow_type, mask=is_empty)
