"""Every message is accounted for."""

from __future__ import annotations

from typing import Any

import pytest

from rosidl_adapter_proto.bags.chunks import FailureInChunk
from rosidl_adapter_proto.bags.conversion import Counts, OnError, Settings
from rosidl_adapter_proto.bags.ledger import Ledger
from rosidl_adapter_proto.bags.model import Topic
from rosidl_adapter_proto.bags.routes import Fate, TopicRoute
from rosidl_adapter_proto.errors import BagError
from rosidl_adapter_proto.transcode.records import Failure


def ledger(said: int, fate: Fate = Fate.CONVERTED, **settings: Any) -> Ledger:
    routes = {1: TopicRoute(Topic("/a", "a/msg/A", "cdr"), fate)}
    return Ledger("in.mcap", routes, {1: said}, Settings(**settings))


@pytest.mark.parametrize(
    ("fate", "counts"),
    [
        (Fate.CONVERTED, Counts(converted=5)),
        (Fate.COPIED, Counts(copied=5)),
    ],
)
def test_all_are_there(fate: Fate, counts: Counts) -> None:
    assert ledger(5, fate).counts({1: 5}) == {"/a": counts}


@pytest.mark.parametrize(
    ("fate", "counts"),
    [(Fate.SKIPPED, Counts(skipped=5)), (Fate.NOT_SELECTED, Counts(not_selected=5))],
)
def test_none_is_there(fate: Fate, counts: Counts) -> None:
    assert ledger(5, fate).counts({}) == {"/a": counts}


@pytest.mark.parametrize("found", [3, 6])
def test_another_number_than_the_file_says(found: int) -> None:
    with pytest.raises(BagError) as caught:
        ledger(5).counts({1: found})
    assert str(caught.value) == (
        f"in.mcap: it says that /a has 5 messages, but {found} were found; `--on-error skip` converts those"
    )


@pytest.mark.parametrize("on_error", [OnError.SKIP, OnError.COPY])
def test_some_are_lost(on_error: OnError) -> None:
    damaged = ledger(5, on_error=on_error)
    assert damaged.counts({1: 3}) == {"/a": Counts(converted=3, lost=2)}
    assert damaged.warnings == ["in.mcap: 2 of the 5 messages of /a are lost"]

    wrong = ledger(5, on_error=on_error)
    assert wrong.counts({1: 6}) == {"/a": Counts(converted=6)}
    assert wrong.warnings == ["in.mcap: it says that /a has 5 messages, but 6 were found"]


@pytest.mark.parametrize("times", [{"start_time": 1}, {"end_time": 0}])
def test_what_is_at_other_times_is_not_lost(times: dict[str, Any]) -> None:
    assert ledger(5, **times).counts({1: 3}) == {"/a": Counts(converted=3, not_selected=2)}
    with pytest.raises(BagError, match="but 6 were found"):
        ledger(5, **times).counts({1: 6})


def test_failures_are_counted_and_the_first_are_kept() -> None:
    skipping = ledger(50, on_error=OnError.SKIP)
    for chunk in range(2):
        failures = [
            FailureInChunk(Failure(1, 100 * chunk + i, 0, i, BagError(f"wrong {i}")), 2 * i) for i in range(6)
        ]
        skipping.add_failures({1: 20}, failures, {1: 5 * chunk})
    assert skipping.failed_count == 40
    assert [(each.number, each.log_time) for each in skipping.failures] == [
        *((2 * i + 1, i) for i in range(6)),
        *((5 + 20 + 2 * i + 1, 100 + i) for i in range(4)),
    ]
    assert skipping.counts({1: 10}) == {"/a": Counts(converted=10, skipped=40)}
