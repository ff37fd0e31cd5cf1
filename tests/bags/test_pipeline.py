"""Work on threads, in order and in bounded memory."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from rosidl_adapter_proto.bags.pipeline import map_in_order


def one(item: object) -> int:
    return 1


def squares(count: int, threads: int, **options: Any) -> list[int]:
    options = {"size": one, "size_limit": 10**9, **options}
    return list(map_in_order(lambda item: item * item, range(count), threads, **options))


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("count", [0, 1, 100])
def test_results_come_in_order(threads: int, count: int) -> None:
    assert squares(count, threads) == [each * each for each in range(count)]


def test_the_first_result_waits_for_none_behind_it() -> None:
    may_go = threading.Event()

    def work(item: int) -> int:
        if item:
            assert may_go.wait(60)
        return item

    results = map_in_order(work, range(9), 4, size=one, size_limit=100)
    assert next(results) == 0
    may_go.set()
    assert list(results) == list(range(1, 9))


@pytest.mark.parametrize(
    ("size", "most"), [(1, 6), (25, 4), (60, 1), (1000, 1)], ids=["few", "by size", "half", "too large"]
)
def test_few_are_under_way(size: int, most: int) -> None:
    taken: list[int] = []

    def items() -> Iterator[int]:
        for each in range(20):
            taken.append(each)
            yield each

    done = 0
    for _ in map_in_order(one, items(), 4, size=lambda _: size, size_limit=100):
        assert len(taken) - done <= most + 1  # the one that waits for its turn
        done += 1
    assert done == 20


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_comes_behind_the_results_before_it(threads: int) -> None:
    def work(item: int) -> int:
        if item >= 7:
            raise KeyError(item)
        return item

    results = []
    with pytest.raises(KeyError, match="7"):
        for each in map_in_order(work, range(20), threads, size=one, size_limit=100):
            results.append(each)
    assert results == list(range(7))


def test_threads_end_with_the_caller() -> None:
    results = map_in_order(one, range(50), 3, size=one, size_limit=100)
    next(results)
    results.close()  # type: ignore[attr-defined]
    assert not [each for each in threading.enumerate() if each.name.startswith("convert")]
