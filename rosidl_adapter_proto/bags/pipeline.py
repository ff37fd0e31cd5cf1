"""Runs one function for each of many things on threads, in order and in bounded memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

ItemT = TypeVar("ItemT")
ResultT = TypeVar("ResultT")


def map_in_order(
    function: Callable[[ItemT], ResultT],
    items: Iterable[ItemT],
    threads: int,
    *,
    size: Callable[[ItemT], int],
    size_limit: int,
) -> Iterator[ResultT]:
    """Yield what a function returns for each of some items, in their order, from a few of them at once.

    Items are taken on the thread of the caller, and no more than `threads + 2` of them are under way.

    Args:
        function: What to call; with one thread, it is called on that of the caller.
        items: What to call it with.
        threads: On how many threads.
        size: How large an item is.
        size_limit: How large all items under way may be together; a larger one is under way alone.

    Raises:
        Exception: What the function raises, once the results before it were yielded.
    """
    if threads == 1:
        yield from map(function, items)
        return
    under_way: deque[tuple[Future[ResultT], int]] = deque()
    total = 0
    with ThreadPoolExecutor(threads, thread_name_prefix="convert") as executor:
        try:
            for item in items:
                item_size = size(item)
                while under_way and (len(under_way) >= threads + 2 or total + item_size > size_limit):
                    future, future_size = under_way.popleft()
                    total -= future_size
                    yield future.result()
                under_way.append((executor.submit(function, item), item_size))
                total += item_size
                del item
            while under_way:
                yield under_way.popleft()[0].result()
        finally:
            executor.shutdown(wait=False, cancel_futures=True)
