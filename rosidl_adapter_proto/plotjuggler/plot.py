"""What a plot of a bag shows, decided once for all that draw it: lines, their points, and what stands beside them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.plotjuggler.series import BagSeries, read_series
from rosidl_adapter_proto.plotjuggler.series_model import Series
from rosidl_adapter_proto.plotjuggler.series_names import SeriesNames

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosidl_adapter_proto.bags.bag import Bag
    from rosidl_adapter_proto.time import Time

MAXIMUM_LINES = 20
"""A plot has so many lines at most, and each of them a colour of its own."""

SPANS = 5000
"""So many spans of time are told apart in a plot that somebody may zoom into, unless somebody asks for others."""

# Ten colours that also those tell apart who see few, and then the same ones lighter: Tableau 20.
_TABLEAU_20 = (
    "1f77b4 ff7f0e 2ca02c d62728 9467bd 8c564b e377c2 7f7f7f bcbd22 17becf "
    "aec7e8 ffbb78 98df8a ff9896 c5b0d5 c49c94 f7b6d2 c7c7c7 dbdb8d 9edae5"
)
COLOURS = tuple(f"#{each}" for each in _TABLEAU_20.split())

# Axes are made of differences of values: those of larger ones need not be numbers, of smaller ones have few digits.
_LARGEST_VALUE = 1e300
_SMALLEST_VALUE = 1e-300
_FEW_POINTS = 60
_LONGEST_NAME = 100


@dataclass(frozen=True, eq=False)
class Line:
    """A time series, as it is drawn.

    Attributes:
        name: What it is called: topic and key in one.
        colour: Its colour, such as `#1f77b4`.
        times: Where its points are, in seconds since the first message of the bag (float64).
        values: How high they are (float64); NaN is a gap.
        is_stepped: Whether a value holds until the next one, as that of a bool.
        is_marked: Whether each point is marked, since they are few, or some have no neighbour that a line could go to.
    """

    name: str
    colour: str
    times: NDArray[numpy.float64] = field(repr=False)
    values: NDArray[numpy.float64] = field(repr=False)
    is_stepped: bool
    is_marked: bool


@dataclass(frozen=True)
class Plot:
    """Lines over a common axis of time.

    Attributes:
        title: What stands above it.
        time_label: What stands at the axis of time, with its unit.
        lines: The lines, as many as `MAXIMUM_LINES` at most.
        notes: What is not drawn as it is, for people.
        value_count: The number of values that were recorded; there may be fewer points.
        warnings: What is odd about the bag, for people.
    """

    title: str
    time_label: str
    lines: tuple[Line, ...]
    notes: tuple[str, ...]
    value_count: int
    warnings: tuple[str, ...] = ()


def read_plot(
    bag: Bag,
    fields: Iterable[str],
    *,
    title: str | None = None,
    start: Time | None = None,
    end: Time | None = None,
    spans: int = SPANS,
    progress: Callable[[int], None] | None = None,
) -> Plot:
    """Return the plot of some series of a bag.

    Args:
        bag: The bag.
        fields: The series: names such as `/imu/linear_acceleration/x`, or what stands above several, such as
            `/imu/linear_acceleration`.
        title: What stands above the plot; by default the name of the bag.
        start: Only what was recorded at this time or later.
        end: Only what was recorded before this time.
        spans: A series of more than twice as many points is drawn by the smallest and the largest value of each of so
            many spans of time.
        progress: Called with a number of messages once they are read.

    Raises:
        BagError: The bag is damaged.
        PluginError: What parses the messages failed.
        RequestError: There is no such series, it is text, or there are too many.
    """
    fields = tuple(fields)
    found = read_series(bag, fields=fields, start=start, end=end, progress=progress)
    return plot_of(
        found,
        fields,
        title=PurePath(bag.path).name if title is None else title,
        start_time=bag.start_time,
        spans=spans,
    )


def plot_of(
    found: BagSeries, fields: Sequence[str], *, title: str, start_time: int, spans: int = SPANS
) -> Plot:
    """Return the plot of series.

    Args:
        found: The series.
        fields: The names that they were found by.
        title: What stands above the plot.
        start_time: Where its axis of time begins, in nanoseconds since 1970.
        spans: As for `read_plot`.

    Raises:
        RequestError: A series of such a name is text, there are too many, or they have no values.
    """
    chosen, notes = _drawable(found.series, fields)
    names = [SeriesNames([each]) for each in fields]
    chosen.sort(
        key=lambda series: [not each.is_chosen(series.name) for each in names]
    )  # as they were asked for
    lines = []
    for each, colour in zip(chosen, COLOURS, strict=False):
        line, line_notes = _line(each, colour, start_time, spans)
        lines.append(line)
        notes += line_notes
    if any(len(each) > 2 * spans for each in chosen):
        notes.append(
            f"series of more than {2 * spans:,} values: drawn are the smallest and the largest in each of {spans:,} "
            "spans of time"
        )
    return Plot(
        title=_printable(title),
        time_label=f"seconds since {_date(start_time)} UTC",
        lines=tuple(lines),
        notes=tuple(notes),
        value_count=sum(map(len, chosen)),
        warnings=found.warnings,
    )


def _drawable(series: Sequence[Series], fields: Sequence[str]) -> tuple[list[Series], list[str]]:
    """Return the series that are drawn, and what to say of others."""
    texts = [each for each in series if isinstance(each.values, list)]
    numbers = [each for each in series if not isinstance(each.values, list)]
    for each in texts:
        if each.name in fields or not numbers:
            raise RequestError(
                f"{_printable(each.name)} is text, which has no line; `plotjuggler series` writes it to a file"
            )
    if not any(map(len, numbers)):
        raise RequestError(f"there are no values of {', '.join(fields)} in these times")
    if len(numbers) > MAXIMUM_LINES:
        names = " ".join(f"--field '{_printable(each.name)}'" for each in numbers[:3])
        raise RequestError(
            f"{', '.join(fields)}: these are {len(numbers)} series, and a plot has {MAXIMUM_LINES} at most; "
            f"name those that matter, such as {names}"
        )
    return numbers, [f"{_printable(each.name)}: left out, since it is text" for each in texts]


def _line(series: Series, colour: str, start_time: int, spans: int) -> tuple[Line, list[str]]:
    """Return how a series is drawn, and what to say of it."""
    name = _printable(series.name)
    notes = []
    times = (series.times - start_time) / 1e9
    values = numpy.asarray(series.values, numpy.float64)
    infinite = numpy.abs(values) > _LARGEST_VALUE  # is False for NaN
    if infinite.any():
        notes.append(
            f"{name}: {infinite.sum():,} values that are infinite or beyond {_LARGEST_VALUE:g} are gaps"
        )
        values = numpy.where(infinite, numpy.nan, values)
    values = numpy.where(numpy.abs(values) < _SMALLEST_VALUE, 0.0, values)
    if len(values) > 2 * spans:
        kept = _peaks(times, values, spans)
        times, values = times[kept], values[kept]
    is_marked = len(values) <= _FEW_POINTS or _has_lonely_points(values)
    return Line(name, colour, times, values, series.type_name == "bool", is_marked), notes


def _peaks(times: NDArray[numpy.float64], values: NDArray[numpy.float64], spans: int) -> NDArray[numpy.int64]:
    """Return which values stand for all: the smallest, the largest and a gap of each span of time, and the ends."""
    first_time, last_time = times.min(), times.max()
    places = (times - first_time) * (spans / max(last_time - first_time, 1e-9))
    starts = numpy.flatnonzero(numpy.diff(places.astype(numpy.int64).clip(max=spans - 1), prepend=-1))
    number = numpy.repeat(numpy.arange(len(starts)), numpy.diff(starts, append=len(values)))
    kept = [numpy.array([0, len(values) - 1])]
    for wanted in (
        values == numpy.fmin.reduceat(values, starts)[number],
        values == numpy.fmax.reduceat(values, starts)[number],
        numpy.isnan(values),
    ):
        indexes = numpy.flatnonzero(wanted)
        kept.append(indexes[numpy.unique(number[indexes], return_index=True)[1]])
    return numpy.unique(numpy.concatenate(kept))


def _has_lonely_points(values: NDArray[numpy.float64]) -> bool:
    """Tell whether a value has gaps, or ends, on both sides."""
    is_gap = numpy.concatenate([[True], numpy.isnan(values), [True]])
    return bool((is_gap[:-2] & ~is_gap[1:-1] & is_gap[2:]).any())


def _printable(text: str) -> str:
    """Return a text from a bag as it may be shown anywhere: short, of one line, with nothing that terminals obey."""
    shown = "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in text)
    if len(shown) <= _LONGEST_NAME:
        return shown
    half = _LONGEST_NAME // 2
    return f"{shown[:half - 1]}\N{HORIZONTAL ELLIPSIS}{shown[-half:]}"


def _date(nanoseconds: int) -> str:
    """Return a time as people read it, to a millisecond; it is UTC."""
    date = datetime(1970, 1, 1) + timedelta(microseconds=nanoseconds // 1000)
    return date.isoformat(" ", "milliseconds")
