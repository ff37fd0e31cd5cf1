"""Plots in the terminal."""

from __future__ import annotations

import re
from textwrap import dedent
from typing import Any

import numpy
import pytest

from rosidl_adapter_proto.plotjuggler.plot_terminal import terminal_plot
from tests.plotjuggler.plots import SECONDS, one, plot, three

NAN, INFINITY = float("nan"), float("inf")


def drawn(*series: Any, is_coloured: bool = False, width: int = 60, height: int = 16, **options: Any) -> str:
    return terminal_plot(plot(*series, spans=width, **options), width, height, is_coloured=is_coloured)


def test_one_series() -> None:
    assert drawn(one("/a", "/b", numpy.sin(SECONDS))) == dedent("""\
                                  recording
            ┌──────────────────────────────────────────────────────┐
         1.0┤       ⢀⣀⣀                               ⣀⣀⡀          │
            │     ⡠⠚⠉  ⠉⠢⡄                         ⡠⠖⠉  ⠈⠑⢄        │
            │   ⢀⠎       ⠈⠢⡀                      ⡔⠁      ⠈⠢⡀      │
         0.5┤  ⡠⠃          ⠱⡀                   ⢀⠎          ⠘⢄     │
            │ ⡔⠁            ⠘⡄                 ⢠⠊             ⢇    │
         0.0┤⠰⠁              ⠘⢄               ⡠⠃              ⠈⢢   │
            │                 ⠈⢆             ⡰⠁                 ⠣⡀ │
        -0.5┤                   ⢣          ⢀⠜                    ⠑⡄│
            │                    ⠑⢄       ⢠⠊                       │
            │                     ⠈⠑⣄  ⢀⡠⠒⠁                        │
        -1.0┤                        ⠉⠉⠁                           │
            └┬──────────┬─────────┬──────────┬─────────┬───────────┘
             0          2         4          6         8
                  seconds since 2023-11-14 22:13:20.000 UTC
        ── /a/b
        series of more than 120 values: drawn are the smallest and the largest in each of 60 spans of time""")


def test_several_series_have_letters_and_gaps_stay_gaps() -> None:
    assert drawn(*three()) == dedent("""\
                                  recording
          ┌────────────────────────────────────────────────────────┐
        10┤ aaaaa       aaaaa                  aaaa        aaa     │
          │a    aaaaaaaa    aaaaaa          aaa    aaaaaaaa   aaaaa│
          │                                                        │
          │                                                        │
         5┤                                                        │
          │bb                               bbbb                   │
          │  bbbbb                      bbbb    bbbb               │
          │ cccccccccccccccccc        bb      cccccccccccccccccc   │
         0┤cc       bbb      cccccccccccccccccc        bbb     cccc│
          │            bbbb   bbbbb                       bbbb   bb│
          │                bbbb                              bbbb  │
          └┬──────────┬──────────┬──────────┬──────────┬───────────┘
           0          2          4          6          8
                  seconds since 2023-11-14 22:13:20.000 UTC
        a /imu/linear_acceleration/z
        b /imu/linear_acceleration/x
        c /battery/charging
        series of more than 120 values: drawn are the smallest and the largest in each of 60 spans of time""")


def test_in_colour() -> None:
    plain, coloured = drawn(*three()), drawn(*three(), is_coloured=True)

    assert "\x1b" not in plain
    for red_green_blue in ("31;119;180", "255;127;14", "44;160;44"):
        assert coloured.count(f"\x1b[38;2;{red_green_blue}m") >= 3
    without = re.sub("\x1b\\[[0-9;]*m", "", coloured).splitlines()
    assert [line for line in without if line.startswith("──")] == [
        "── /imu/linear_acceleration/z",
        "── /imu/linear_acceleration/x",
        "── /battery/charging",
    ]
    assert max(map(len, without[:16])) == 60


@pytest.mark.parametrize(
    "values, labels",
    [
        ([3.0], ["2.6", "2.8", "3.0", "3.2", "3.4"]),
        ([NAN, NAN], ["-0.4", "-0.2", "0.0", "0.2", "0.4"]),
        ([5e-324, 0.0], ["-0.4", "-0.2", "0.0", "0.2", "0.4"]),
        ([1e300, -1e300], ["-1.0e+300", "-5.0e+299", "0.0e+00", "5.0e+299", "1.0e+300"]),
        ([1e-9, 3e-9], ["1.0e-09", "1.5e-09", "2.0e-09", "2.5e-09", "3.0e-09"]),
        ([1.7e9, 1.7e9 + 4], ["1700000000", "1700000001", "1700000002", "1700000003", "1700000004"]),
        ([2.0**62, 2.0**62 + 4096], ["4.40e+18", "4.50e+18", "4.60e+18", "4.70e+18", "4.80e+18"]),
        ([INFINITY, 1.0], ["0.6", "0.8", "1.0", "1.2", "1.4"]),
    ],
)
def test_labels(values: list[float], labels: list[str]) -> None:
    lines = drawn(one("/a", "/b", values), height=24).splitlines()
    assert [line.partition("┤")[0].strip() for line in lines if "┤" in line][::-1] == labels


def test_twenty_series_and_a_narrow_terminal() -> None:
    many = [one("/joint_states", f"/position[{index}]", numpy.sin(SECONDS + index)) for index in range(20)]
    lines = drawn(*many, width=20).splitlines()

    assert lines[16] == "a /joint_states/position[0]"
    assert lines[35] == "t /joint_states/position[19]"
