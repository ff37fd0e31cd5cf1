"""Plots in a terminal, drawn by plotext with characters.

Needs plotext: `pip install 'rosidl-adapter-proto[plot]'`.
"""

from __future__ import annotations

import math
from string import ascii_lowercase
from typing import TYPE_CHECKING

import numpy

from rosidl_adapter_proto.plotjuggler.plot import Line, Plot

try:
    import plotext
except ImportError as error:
    raise ImportError(
        f"plots in the terminal need plotext ({error}); pip install 'rosidl-adapter-proto[plot]'",
        name="plotext",
    ) from error

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

_COLUMNS_OF_TICK = 10
_LINES_OF_TICK = 3


def terminal_plot(plot: Plot, width: int, height: int, *, is_coloured: bool) -> str:
    """Return a plot as lines of characters.

    Args:
        plot: What to draw.
        width: Its columns; plotext draws no more than the terminal has.
        height: Its lines, without the legend below it.
        is_coloured: Whether colours tell its lines apart; otherwise letters do.
    """
    figure = plotext.figure
    figure.clear.all()
    figure.plot_size(width, height)
    figure.theme("colorless")
    figure.title(plot.title)
    figure.label(plot.time_label)
    legend = []
    for line, letter in zip(plot.lines, ascii_lowercase, strict=False):
        has_letter = len(plot.lines) > 1 and not is_coloured
        colour = tuple(bytes.fromhex(line.colour[1:]))
        marker = plotext.marker(letter if has_letter else "braille", colour)
        for times, values in _parts(line):
            figure.draw(figure.signal(times, values, marker=marker).lines())
        sample = plotext.colorize("──", colour).string() if is_coloured else letter if has_letter else "──"
        legend.append(f"{sample} {line.name}")
    _set_axis(
        figure.ruler("x"), _limits([line.times for line in plot.lines], margin=0), width // _COLUMNS_OF_TICK
    )
    _set_axis(
        figure.ruler("y"),
        _limits([line.values for line in plot.lines], margin=0.04),
        height // _LINES_OF_TICK,
    )
    drawn = figure.build().string(colorless=not is_coloured).splitlines()
    return "\n".join(each.rstrip() for each in (*drawn, *legend, *plot.notes))


def _parts(line: Line) -> Iterator[tuple[NDArray[numpy.float64], NDArray[numpy.float64]]]:
    """Yield the times and values of a line from gap to gap: plotext ends the program when it sees NaN."""
    times, values = line.times, line.values
    if line.is_stepped:
        times, values = numpy.repeat(times, 2)[1:], numpy.repeat(values, 2)[:-1]
    is_gap = numpy.isnan(values)
    edges = numpy.flatnonzero(numpy.diff(is_gap)) + 1
    for part_times, part_values in zip(numpy.split(times, edges), numpy.split(values, edges), strict=True):
        if len(part_values) and not math.isnan(part_values[0]):
            yield part_times, part_values


def _limits(arrays: list[NDArray[numpy.float64]], margin: float) -> tuple[float, float]:
    """Return the least and the greatest number, with a margin, which is a part of what lies between."""
    numbers = numpy.concatenate(arrays)
    numbers = numbers[~numpy.isnan(numbers)]
    low, high = (float(numbers.min()), float(numbers.max())) if len(numbers) else (0.0, 0.0)
    size = max(abs(low), abs(high))
    is_flat = high - low <= size * 1e-14 + 1e-300
    extra = max(size / 20, 0.5) if is_flat else (high - low) * margin
    return low - extra, high + extra


def _set_axis(ruler: plotext.ruler, limits: tuple[float, float], most_ticks: int) -> None:
    """Set where an axis begins and ends, and label it at round numbers: at 1, 2 or 5 times a power of ten."""
    low, high = limits
    least_step = (high - low) / max(most_ticks, 1)
    power = 10.0 ** math.floor(math.log10(least_step))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least_step)
    ticks = [number * step for number in range(math.ceil(low / step), math.floor(high / step) + 1)]
    decimals = max(0, -math.floor(math.log10(step * 1.001)))
    largest = max(abs(low), abs(high))
    if largest < 1e10 and decimals <= 6:
        labels = [f"{tick:.{decimals}f}" for tick in ticks]
    else:
        labels = [f"{tick:.{math.ceil(math.log10(largest / step))}e}" for tick in ticks]
    ruler.lim(low, high).ticks(ticks, labels)
