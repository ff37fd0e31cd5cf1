"""Plots as PNG, read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.image
import numpy
import pytest

from rosidl_adapter_proto.plotjuggler.plot import COLOURS, Plot
from rosidl_adapter_proto.plotjuggler.plot_png import HEIGHT, WIDTH, write_png
from tests.plotjuggler.plots import SECONDS, one, plot, three

NAN = float("nan")


def picture(drawn: Plot, folder: Path) -> Any:
    """Return the pixels of a plot: rows of columns of red, green and blue, from 0 to 255."""
    write_png(drawn, folder / "x.png")
    return (matplotlib.image.imread(folder / "x.png")[..., :3] * 255).round().astype(int)


def pixels(seen: Any, colour: str) -> Any:
    """Return where a colour is: rows and columns, of pixels that are nearly of it."""
    wanted = numpy.array(list(bytes.fromhex(colour[1:])))
    return numpy.nonzero((numpy.abs(seen - wanted) <= 8).all(axis=2))


def test_each_series_has_its_colour(tmp_path: Path) -> None:
    seen = picture(plot(*three()), tmp_path)

    assert seen.shape == (HEIGHT, WIDTH, 3)
    for colour in COLOURS[:3]:
        assert len(pixels(seen, colour)[0]) > 300
    assert len(pixels(seen, COLOURS[3])[0]) == 0


def test_higher_values_are_drawn_higher(tmp_path: Path) -> None:
    high, low = one("/a", "/high", [2.0] * 100), one("/a", "/low", [1.0] * 100)
    seen = picture(plot(high, low), tmp_path)[: HEIGHT - 100]  # without the legend

    high_rows, low_rows = (set(pixels(seen, colour)[0].tolist()) for colour in COLOURS[:2])
    assert max(high_rows) < min(low_rows)


def test_gaps_stay_gaps(tmp_path: Path) -> None:
    values = numpy.ones(1000)
    values[400:600] = NAN
    columns = pixels(picture(plot(one("/a", "/b", values)), tmp_path)[: HEIGHT - 100], COLOURS[0])[1]

    between = numpy.diff(numpy.unique(columns))
    assert between.max() == pytest.approx(0.2 * WIDTH, rel=0.1)
    assert (between > 1).sum() == 1


def test_bools_are_steps(tmp_path: Path) -> None:
    values = numpy.array([False, True, False])
    seen = picture(plot(one("/a", "/b", values)), tmp_path)[: HEIGHT - 100]
    _, counts = numpy.unique(pixels(seen, COLOURS[0])[1], return_counts=True)

    assert (counts > HEIGHT / 2).sum() in (2, 3, 4)  # two edges, which are one or two pixels wide
    assert (counts[counts <= HEIGHT / 2] < 20).all()


def test_twenty_series_make_room_for_their_legend(tmp_path: Path) -> None:
    many = [one("/joint_states", f"/position[{index}]", numpy.sin(SECONDS + index)) for index in range(20)]
    seen = picture(plot(*many), tmp_path)

    assert seen.shape[0] > HEIGHT
    assert all(len(pixels(seen, colour)[0]) > 100 for colour in COLOURS)


@pytest.mark.parametrize(
    "values",
    [[3.0], [NAN, NAN], [5e-324, 0.0], [1e300, -1e300], [2.0**63, 2.0**63 - 2048]],
    ids=["one", "none", "small", "large", "close"],
)
def test_odd_values_are_drawn(values: list[float], tmp_path: Path) -> None:
    assert len(pixels(picture(plot(one("/a", "/b", values)), tmp_path), COLOURS[0])[0]) > 10


@pytest.mark.parametrize("name", ["/a$b$c", "/_", "/\\frac{", "/" + "k" * 500, "/温度\x1b", "/%s{}<b>"])
def test_names_are_no_formulas(name: str, tmp_path: Path) -> None:
    assert len(pixels(picture(plot(one("/a", name, [1.0]), title=name), tmp_path), COLOURS[0])[0]) > 10
