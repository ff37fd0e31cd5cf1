"""Sizes and durations as people read them."""

from __future__ import annotations

import pytest

from rosidl_adapter_proto.cli.texts import size_text, time_text


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (0, "0 B"),
        (999, "999 B"),
        (1000, "1.0 kB"),
        (123_456, "123 kB"),
        (99_960, "100 kB"),
        (999_499, "999 kB"),
        (999_960, "1.0 MB"),
        (2.5e12, "2.5 TB"),
        (5e16, "50.0 PB"),
        (10**18, "1000 PB"),
    ],
)
def test_sizes(size: float, text: str) -> None:
    assert size_text(size) == text


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.04, "0.0 s"), (59.9, "59.9 s"), (59.96, "1:00"), (61, "1:01"), (3661, "1:01:01")]
)
def test_durations(seconds: float, text: str) -> None:
    assert time_text(seconds) == text
