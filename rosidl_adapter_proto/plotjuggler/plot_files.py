"""Plots as files: PNG, or one HTML page."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rosidl_adapter_proto.bags.bag import Bag
from rosidl_adapter_proto.bags.output import check_new, written_aside
from rosidl_adapter_proto.bags.places import Place, find_place, written_locally
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.plotjuggler.plot import Plot, read_plot

if TYPE_CHECKING:
    from rosidl_adapter_proto.time import Time


def write_plot(
    bag: Bag,
    fields: Iterable[str],
    output: str | os.PathLike[str],
    *,
    title: str | None = None,
    start: Time | None = None,
    end: Time | None = None,
    progress: Callable[[int], None] | None = None,
) -> Plot:
    """Draw some series of a bag into a file, which appears when it is complete.

    Args:
        bag: As for `read_plot`.
        fields: As for `read_plot`.
        output: The file, by a path or a URL, whose suffix says what it is: `.png` or `.html`; nothing may be there.
        title: As for `read_plot`.
        start: As for `read_plot`.
        end: As for `read_plot`.
        progress: As for `read_plot`.

    Returns:
        What was drawn.

    Raises:
        BagError: As for `read_plot`, or the file exists or cannot be written.
        ImportError: What draws such files is not installed.
        PluginError: As for `read_plot`.
        RequestError: As for `read_plot`, or the suffix says nothing.
    """
    path = find_place(output)
    write = _writer(path)
    check_new(path)
    plot = read_plot(bag, fields, title=title, start=start, end=end, progress=progress)
    with written_aside(path, is_folder=False) as place, written_locally(place) as local:
        write(plot, local)
    return plot


def _writer(path: Place) -> Callable[[Plot, Path], None]:
    """Return what writes a file, by its suffix; only that is imported."""
    suffix = path.suffix.lower()
    if suffix == ".png":
        from rosidl_adapter_proto.plotjuggler.plot_png import write_png

        return write_png
    if suffix == ".html":
        from rosidl_adapter_proto.plotjuggler.plot_html import write_html

        return write_html
    raise RequestError(f"{path}: the suffix says no format of plots; name the file .png or .html")
