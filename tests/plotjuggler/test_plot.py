"""What a plot shows."""

from __future__ import annotations

import re
from typing import Any

import numpy
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.bag_maker import START
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.plotjuggler.plot import COLOURS, MAXIMUM_LINES, Line, plot_of
from rosidl_adapter_proto.plotjuggler.series import BagSeries
from rosidl_adapter_proto.plotjuggler.series_model import Series
from tests.plotjuggler.plots import one, plot, three

NAN, INFINITY = float("nan"), float("inf")


def line(values: Any, **options: Any) -> Line:
    (only,) = plot(one("/a", "/b", values), **options).lines
    return only


def test_lines_have_names_colours_and_a_common_time() -> None:
    drawn = plot(*three())

    assert [each.name for each in drawn.lines] == [
        "/imu/linear_acceleration/z",
        "/imu/linear_acceleration/x",
        "/battery/charging",
    ]
    assert [each.colour for each in drawn.lines] == ["#1f77b4", "#ff7f0e", "#2ca02c"]
    assert [each.is_stepped for each in drawn.lines] == [False, False, True]
    assert drawn.time_label == "seconds since 2023-11-14 22:13:20.000 UTC"
    assert drawn.lines[0].times[:3].tolist() == [0.0, 0.01, 0.02]
    assert drawn.lines[2].times[:3].tolist() == [0.0, 0.1, 0.2]
    assert (drawn.title, drawn.notes, drawn.value_count) == ("recording", (), 2100)


def test_lines_have_the_order_in_which_they_were_named() -> None:
    found = [one("/a", f"/{key}", [1.0]) for key in ("x", "y[0]", "y[1]", "z/w")]
    drawn = plot_of(BagSeries(tuple(found), ()), ["/a/z", "/a/y", "/a/?"], title="x", start_time=START)

    assert [each.name for each in drawn.lines] == ["/a/z/w", "/a/y[0]", "/a/y[1]", "/a/x"]


def test_every_line_has_a_colour_of_its_own() -> None:
    assert len(set(COLOURS)) == len(COLOURS) == MAXIMUM_LINES


@pytest.mark.parametrize(
    "values, drawn",
    [
        (numpy.array([1, -2], "i1"), [1, -2]),
        (numpy.array([2**63], "u8"), [2.0**63]),
        (numpy.array([0.5], "f4"), [0.5]),
        (numpy.array([True, False]), [1, 0]),
        (numpy.array([5e-324, 1e-300]), [0, 1e-300]),
    ],
)
def test_all_numbers_are_drawn(values: Any, drawn: list[float]) -> None:
    assert line(values).values.tolist() == drawn


def test_what_is_no_number_is_a_gap() -> None:
    drawn = plot(one("/a", "/b", [1.0, NAN, INFINITY, -INFINITY, 1.7e308, 1e300]))

    numpy.testing.assert_equal(drawn.lines[0].values, [1, NAN, NAN, NAN, NAN, 1e300])
    assert drawn.notes == ("/a/b: 3 values that are infinite or beyond 1e+300 are gaps",)


def test_points_are_marked_where_no_line_would_show_them() -> None:
    many = [1.0] * 100
    assert line([1.0, 2.0]).is_marked
    assert not line(many).is_marked
    assert line([*many, NAN, 1.0, NAN, *many]).is_marked
    assert line([1.0, NAN, *many]).is_marked
    assert not line([*many, NAN, *many]).is_marked


NUMBERS = st.one_of(
    st.integers(-3, 3).map(float), st.just(NAN), st.floats(1e-300, 1e300), st.floats(-1e300, -1e-300)
)


@given(st.lists(st.tuples(st.integers(0, 1000), NUMBERS), min_size=1), st.integers(1, 10))
def test_of_many_values_peaks_and_gaps_stay(points: list[tuple[int, float]], spans: int) -> None:
    seconds, values = map(numpy.array, zip(*sorted(points, key=lambda point: point[0]), strict=True))
    series = Series("/a", "/b", START + seconds * 10**9, values)
    (drawn,) = plot(series, spans=spans).lines

    assert len(drawn.values) <= max(3 * spans + 2, 0) or len(values) <= 2 * spans
    everything = set(zip(seconds.tolist(), map(repr, values.tolist()), strict=True))
    assert set(zip(drawn.times.tolist(), map(repr, drawn.values.tolist()), strict=True)) <= everything
    if len(values) <= 2 * spans:
        assert len(drawn.values) == len(values)
        return
    width = max(seconds[-1] - seconds[0], 1) / spans
    for span in range(spans):
        first, last = seconds[0] + span * width, seconds[0] + (span + 1) * width
        inside = values[(seconds > first + 1e-6) & (seconds < last - 1e-6)]
        kept = drawn.values[(drawn.times > first - 1e-6) & (drawn.times < last + 1e-6)]
        numbers = inside[~numpy.isnan(inside)]
        if len(numbers):
            assert numpy.nanmin(kept) <= numbers.min()
            assert numpy.nanmax(kept) >= numbers.max()
        if numpy.isnan(inside).any():
            assert numpy.isnan(kept).any()


def test_one_peak_of_a_million_values_stays() -> None:
    values = numpy.zeros(10**6, "f4")
    values[123_456], values[654_321] = 7, -7
    drawn = plot(one("/a", "/b", values))

    assert len(drawn.lines[0].values) < 10_100
    peaks = {1234.56: 7.0, 6543.21: -7.0}
    assert dict(zip(drawn.lines[0].times, drawn.lines[0].values, strict=True)).items() >= peaks.items()
    assert drawn.notes == (
        "series of more than 10,000 values: drawn are the smallest and the largest in each of 5,000 spans of time",
    )
    assert drawn.value_count == 10**6


def test_text_is_refused() -> None:
    with pytest.raises(RequestError) as caught:
        plot(one("/imu", "/header/frame_id", ["a", "b"]))
    assert str(caught.value) == (
        "/imu/header/frame_id is text, which has no line; `plotjuggler series` writes it to a file"
    )


def test_text_below_what_was_named_is_left_out() -> None:
    found = BagSeries(
        (one("/imu", "/header/stamp/sec", [1]), one("/imu", "/header/frame_id", ["a"])), ("odd",)
    )
    drawn = plot_of(found, ["/imu/header"], title="x", start_time=START)

    assert [each.name for each in drawn.lines] == ["/imu/header/stamp/sec"]
    assert drawn.notes == ("/imu/header/frame_id: left out, since it is text",)
    assert drawn.warnings == ("odd",)


def test_too_many_series_are_refused() -> None:
    found = BagSeries(tuple(one("/scan", f"/ranges[{index}]", [1.0]) for index in range(21)), ())
    with pytest.raises(RequestError) as caught:
        plot_of(found, ["/scan/ranges"], title="x", start_time=START)
    assert str(caught.value) == (
        "/scan/ranges: these are 21 series, and a plot has 20 at most; name those that matter, such as "
        "--field '/scan/ranges[0]' --field '/scan/ranges[1]' --field '/scan/ranges[2]'"
    )


def test_series_without_values_are_refused() -> None:
    with pytest.raises(RequestError) as caught:
        plot(one("/a", "/b", []), one("/a", "/c", numpy.array([])))
    assert str(caught.value) == "there are no values of /a/b, /a/c in these times"


@pytest.mark.parametrize(
    "key, shown",
    [
        ("/\x1b[2Jx\n", "/a/\ufffd[2Jx\ufffd"),
        ("/温度", "/a/温度"),
        ("/" + "k" * 10**6, "/a/" + "k" * 46 + "…" + "k" * 50),
    ],
    ids=["control characters", "others", "long"],
)
def test_names_can_be_shown(key: str, shown: str) -> None:
    drawn = plot(one("/a", key, [1.0, INFINITY]), title=f"/a{key}")
    assert drawn.lines[0].name == drawn.title == shown
    assert re.fullmatch("(.*): 1 values .*", drawn.notes[0])[1] == shown  # type: ignore[index]
