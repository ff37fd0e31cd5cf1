"""Series to draw, and plots of them."""

from __future__ import annotations

from typing import Any

import numpy

from benchmarks.bag_maker import START
from rosidl_adapter_proto.plotjuggler.plot import Plot, plot_of
from rosidl_adapter_proto.plotjuggler.series import BagSeries
from rosidl_adapter_proto.plotjuggler.series_model import Series

SECONDS = numpy.arange(1000) / 100


def one(topic: str, key: str, values: Any, rate: int = 100) -> Series:
    """Return a series of so many values a second, from the start of the bag."""
    array = numpy.asarray(values)
    values = values if array.dtype.kind == "U" else array
    return Series(topic, key, START + numpy.arange(len(values)) * (10**9 // rate), values)


def three() -> list[Series]:
    """Return a line with a gap, another, and one of bools with fewer values."""
    height = 9.81 + 0.3 * numpy.sin(3 * SECONDS)
    height[400:600] = numpy.nan
    return [
        one("/imu", "/linear_acceleration/z", height),
        one("/imu", "/linear_acceleration/x", 3 * numpy.cos(SECONDS)),
        one("/battery", "/charging", numpy.sin(SECONDS[::10]) > 0, rate=10),
    ]


def plot(*series: Series, title: str = "recording", **options: Any) -> Plot:
    """Return the plot of series that were named one by one."""
    fields = [each.name for each in series]
    return plot_of(BagSeries(series, ()), fields, title=title, start_time=START, **options)
