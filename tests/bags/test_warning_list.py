"""Lists of warnings."""

from __future__ import annotations

from rosidl_adapter_proto.bags.warning_list import WarningList


def test_each_is_there_once() -> None:
    warnings = WarningList()
    for text in ("a", "b", "a"):
        warnings.add(text)
    assert warnings == ["a", "b"]


def test_there_are_not_more_than_somebody_reads() -> None:
    warnings = WarningList()
    for number in range(1000):
        warnings.add(str(number))
    assert warnings[:100] == [str(number) for number in range(100)]
    assert warnings[100:] == ["there is more to warn of than these 100, which is not listed"]
