"""Comparing the values in messages, whatever they are made of."""

from __future__ import annotations

from typing import Any


def assert_same_values(ours: Any, theirs: Any) -> None:
    """Compare a protobuf message with a message of another library, which has attributes of the same names."""
    for name in (field.name for field in ours.DESCRIPTOR.fields):
        our, their = getattr(ours, name), getattr(theirs, name)
        if hasattr(our, "DESCRIPTOR"):
            assert_same_values(our, their)
        elif isinstance(our, (bytes, str, int, float)):
            assert our == (bytes(their) if isinstance(our, bytes) else their), name
        elif len(our) and hasattr(our[0], "DESCRIPTOR"):
            for one, other in zip(our, their, strict=True):
                assert_same_values(one, other)
        else:
            assert list(our) == list(their), name
