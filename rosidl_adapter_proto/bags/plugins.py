"""Converts chunks with converter plugins, for formats that the native module does not know."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Mapping
from threading import Lock
from typing import TYPE_CHECKING, TypeAlias

from rosidl_adapter_proto.bags.routes import Fate, TopicRoute
from rosidl_adapter_proto.converters import Converter, SerializedBagMessage
from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.transcode.error import RecordsError
from rosidl_adapter_proto.transcode.records import (
    KEPT_FAILURES,
    Converted,
    Failure,
    Records,
    pack_records,
    read_records,
)

if TYPE_CHECKING:
    from typing_extensions import Buffer

    Result: TypeAlias = Buffer | Error | None
    """What becomes of a message: its new bytes, or an error, which is only kept of the first ones."""

BATCH_SIZE = 1000
"""How many messages a plugin gets at once, since each may become an error, which is larger than most messages."""


class PluginConverter:
    """Converts chunks, and may be used by many threads, of which one at a time is in the plugins.

    Args:
        routes: What becomes of each topic, by its id.
        failed_ids: The ids in the result of messages that cannot be converted; without one they are left out.
        converter: What converts each message.
    """

    def __init__(
        self, routes: Mapping[int, TopicRoute], failed_ids: Mapping[int, int], converter: Converter
    ) -> None:
        self._routes = routes
        self._failed_ids = failed_ids
        self._converter = converter
        self._lock = Lock()

    def convert(self, data: Buffer, *, start_time: int = 0, end_time: int | None = None) -> Converted:
        """Do what `RecordConverter.convert` does."""
        records = read_records(data)
        unknown = set(records.topic_ids) - self._routes.keys()
        if unknown:
            raise RecordsError(0, f"there is no route for topic id {min(unknown)}")
        chosen = [
            index
            for index, (topic_id, time) in enumerate(zip(records.topic_ids, records.log_times, strict=True))
            if self._routes[topic_id].result is not None
            and time >= start_time
            and (end_time is None or time < end_time)
        ]
        results: dict[int, Result] = {index: records[index] for index in chosen}
        for topic_id in {records.topic_ids[index] for index in chosen}:
            if self._routes[topic_id].fate is Fate.CONVERTED:
                self._convert_topic(
                    records,
                    topic_id,
                    [each for each in chosen if records.topic_ids[each] == topic_id],
                    results,
                )
        return self._packed(records, results)

    def _convert_topic(
        self, records: Records, topic_id: int, indexes: list[int], results: dict[int, Result]
    ) -> None:
        """Replace the messages of one topic by what they become."""
        route = self._routes[topic_id]
        assert route.schema is not None, "what is converted has a type"
        failed = 0
        for first in range(0, len(indexes), BATCH_SIZE):
            batch = indexes[first : first + BATCH_SIZE]
            messages = [
                SerializedBagMessage(
                    records[index],
                    route.topic.name,
                    records.log_times[index],
                    records.publish_times[index],
                    records.sequences[index],
                )
                for index in batch
            ]
            with self._lock:
                converted = self._converter.convert_batch(messages, route.schema, route.result_schema)
            for index, each in zip(batch, converted, strict=True):
                if not isinstance(each, Error):
                    results[index] = each.serialized_data
                    continue
                results[index] = each if failed < KEPT_FAILURES else None
                failed += 1

    def _packed(self, records: Records, results: Mapping[int, Result]) -> Converted:
        failure_counts: Counter[int] = Counter()
        failures: list[Failure] = []
        messages: list[Buffer] = []
        topic_ids, indexes = array("H"), []
        for index, result in results.items():
            topic_id = records.topic_ids[index]
            if result is not None and not isinstance(result, Error):
                topic_ids.append(topic_id)
                indexes.append(index)
                messages.append(result)
                continue
            failure_counts[topic_id] += 1
            if result is not None and len(failures) < KEPT_FAILURES:
                failures.append(
                    Failure(topic_id, records.log_times[index], records.sequences[index], index, result)
                )
            if topic_id in self._failed_ids:
                topic_ids.append(self._failed_ids[topic_id])
                indexes.append(index)
                messages.append(records[index])
        data = pack_records(
            topic_ids,
            array("I", (records.sequences[each] for each in indexes)),
            array("Q", (records.log_times[each] for each in indexes)),
            array("Q", (records.publish_times[each] for each in indexes)),
            messages,
        )
        return Converted(memoryview(data), len(messages), failure_counts, failures)
