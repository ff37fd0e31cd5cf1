"""Plots as PNG, drawn by matplotlib without a display.

Needs matplotlib: `pip install 'rosidl-adapter-proto[plot]'`.
"""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path

from rosidl_adapter_proto.plotjuggler.plot import Plot

try:
    from matplotlib.figure import Figure
    from PIL import Image  # which matplotlib needs itself
except ImportError as error:
    raise ImportError(
        f"plots as PNG need matplotlib ({error}); pip install 'rosidl-adapter-proto[plot]'", name="matplotlib"
    ) from error

WIDTH, HEIGHT = 1200, 600
"""The size of a picture in pixels; a long legend makes it higher."""

_DOTS_PER_INCH = 100
_LINE_OF_TEXT = 22  # pixels
_CHARACTER = 8  # pixels, and a legend has about six more for each name


def write_png(plot: Plot, path: Path) -> None:
    """Write a plot as PNG."""
    longest = max(len(line.name) for line in plot.lines)
    most_columns = max(1, min(4, WIDTH // ((longest + 6) * _CHARACTER)))
    rows = -(-len(plot.lines) // most_columns)
    columns = -(-len(plot.lines) // rows)
    added_lines = max(rows + len(plot.notes) - 3, 0)
    size = WIDTH / _DOTS_PER_INCH, (HEIGHT + _LINE_OF_TEXT * added_lines) / _DOTS_PER_INCH
    figure = Figure(size, _DOTS_PER_INCH, layout="constrained")
    axes = figure.add_subplot()
    for line in plot.lines:
        axes.plot(
            line.times,
            line.values,
            label=_literal(line.name),
            color=line.colour,
            drawstyle="steps-post" if line.is_stepped else "default",
            linewidth=1.5,
            marker="." if line.is_marked else None,
        )
    axes.set_title(_literal(plot.title))
    axes.set_xlabel("\n".join([plot.time_label, *map(_literal, plot.notes)]))
    axes.ticklabel_format(useOffset=False)
    axes.margins(x=0.01)
    axes.grid(color="#e5e5e5")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=columns, frameon=False)
    drawn = BytesIO()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)  # a box is drawn in its place
        figure.savefig(drawn, format="png")
    # So many colours are enough for lines on white, and take a third of the bytes.
    Image.open(drawn).convert("RGB").quantize(256).save(path, "png", optimize=True)


def _literal(text: str) -> str:
    """Return a text that matplotlib takes for no formula."""
    return text.replace("$", r"\$")
