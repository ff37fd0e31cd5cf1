"""Files of tables: Parquet, Arrow and CSV."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Protocol

from rosidl_adapter_proto.bags.places import Place
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.transcode.arrow import pa

_FORMATS = {".parquet": "parquet", ".arrow": "arrow", ".feather": "arrow", ".csv": "csv"}


class TableFile(Protocol):
    """A file of a table, open for writing. It is a context manager that finishes the file."""

    def write(self, batch: pa.RecordBatch) -> None:
        """Write the next rows."""

    def __enter__(self) -> TableFile: ...
    def __exit__(self, *exception: object) -> None: ...


def format_of(path: Place, file_format: str | None) -> str:
    """Return the format of a file: `parquet`, `arrow` or `csv`.

    Args:
        path: The file, whose suffix says it.
        file_format: What somebody asked for instead.

    Raises:
        RequestError: The suffix says nothing, or there is no such format.
    """
    found = _FORMATS.get(path.suffix.lower()) if file_format is None else file_format
    if found is None:
        raise RequestError(
            f"{path}: the suffix says no format of tables; name the file {', '.join(_FORMATS)}, or give a format"
        )
    if found not in _OPENERS:
        raise RequestError(f"there is no format {found!r} of tables; there are {', '.join(_OPENERS)}")
    return found


def open_table(path: Path, file_format: str, schema: pa.Schema) -> TableFile:
    """Return a new file for record batches of a schema."""
    return _OPENERS[file_format](path, schema)


def _open_parquet(path: Path, schema: pa.Schema) -> TableFile:
    from pyarrow.parquet import ParquetWriter

    # Numbers of sensors hardly repeat: looking for a dictionary of them takes four times as long as all the rest.
    texts = list(_text_paths(schema))
    writer: TableFile = ParquetWriter(path, schema, compression="zstd", use_dictionary=texts)
    return writer


def _text_paths(fields: Iterable[pa.Field], path: str = "") -> Iterator[str]:
    """Yield what Parquet calls the columns of texts."""
    for field in fields:
        if pa.types.is_struct(field.type):
            yield from _text_paths(field.type, f"{path}{field.name}.")
        elif _is_list(field.type):
            yield from _text_paths([field.type.value_field.with_name("element")], f"{path}{field.name}.list.")
        elif pa.types.is_string(field.type):
            yield path + field.name


def _open_arrow(path: Path, schema: pa.Schema) -> TableFile:
    writer: TableFile = pa.ipc.new_file(path, schema)
    return writer


class _CsvFile:
    """A CSV file. It has a column for each field of a nested message; lists are JSON, and bytes are base64."""

    def __init__(self, path: Path, schema: pa.Schema) -> None:
        from pyarrow.csv import CSVWriter

        nothing = [pa.array([], each.type) for each in schema]
        self._writer = CSVWriter(path, _flat(pa.RecordBatch.from_arrays(nothing, schema=schema)).schema)

    def write(self, batch: pa.RecordBatch) -> None:
        self._writer.write_batch(_flat(batch))

    def __enter__(self) -> _CsvFile:
        return self

    def __exit__(self, *exception: object) -> None:
        self._writer.close()


_OPENERS: dict[str, Callable[[Path, pa.Schema], TableFile]] = {
    "parquet": _open_parquet,
    "arrow": _open_arrow,
    "csv": _CsvFile,
}


def _flat(batch: pa.RecordBatch) -> pa.RecordBatch:
    """Return a record batch without nested columns: `a.b` for the field `b` of `a`."""
    columns = dict(_flat_columns(zip(batch.schema.names, batch.columns, strict=True)))
    return pa.RecordBatch.from_arrays(list(columns.values()), names=list(columns))


def _flat_columns(columns: Iterable[tuple[str, pa.Array]]) -> Iterator[tuple[str, pa.Array]]:
    for name, column in columns:
        if pa.types.is_struct(column.type):
            inner = (f"{name}.{each.name}" for each in column.type)
            yield from _flat_columns(zip(inner, column.flatten(), strict=True))
        elif _is_list(column.type):
            yield name, pa.array(_json(column), pa.string())
        elif _is_bytes(column.type):
            yield name, pa.array(_base64(column), pa.string())
        else:
            yield name, column


def _is_list(data_type: pa.DataType) -> bool:
    return bool(pa.types.is_list(data_type) or pa.types.is_fixed_size_list(data_type))


def _is_bytes(data_type: pa.DataType) -> bool:
    return bool(pa.types.is_binary(data_type) or pa.types.is_fixed_size_binary(data_type))


def _base64(column: pa.Array) -> list[str]:
    return [base64.b64encode(each).decode() for each in column.to_pylist()]


_NO_NUMBERS = {"nan": '"NaN"', "-nan": '"NaN"', "inf": '"Infinity"', "-inf": '"-Infinity"'}


def _json(column: pa.Array) -> list[str]:
    """Return each row of a column as JSON.

    What is no number is text, as in the JSON of protobuf (https://protobuf.dev/programming-guides/json/).
    """
    data_type = column.type
    if _is_list(data_type):
        items = _json(column.flatten())
        if pa.types.is_list(data_type):
            offsets = column.offsets.to_pylist()
        else:
            offsets = list(range(0, len(items) + 1, data_type.list_size))
        return [f"[{','.join(items[first:last])}]" for first, last in pairwise(offsets)]
    if pa.types.is_struct(data_type):
        names = [json.dumps(each.name) for each in data_type]
        rows = zip(*map(_json, column.flatten()), strict=True)
        return [f"{{{','.join(map('{}:{}'.format, names, row))}}}" for row in rows]
    if _is_bytes(data_type):
        return [f'"{each}"' for each in _base64(column)]
    if pa.types.is_duration(data_type):
        column = column.cast(pa.int64())
    texts: list[str] = column.cast(pa.string()).to_pylist()
    if pa.types.is_floating(data_type):
        return [_NO_NUMBERS.get(each, each) for each in texts]
    if pa.types.is_string(data_type) or pa.types.is_timestamp(data_type):
        return [json.dumps(each, ensure_ascii=False) for each in texts]
    return texts
