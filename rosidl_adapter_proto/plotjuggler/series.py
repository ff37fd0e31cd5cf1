"""Time series of bags, as PlotJuggler shows them: what a parser plugin makes of messages, a series for each number."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy

from rosidl_adapter_proto.bags.bag import Bag
from rosidl_adapter_proto.bags.model import Topic, message_place
from rosidl_adapter_proto.bags.topic_names import is_named, no_such_topic
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError, PluginError, RequestError, SchemaError
from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy, Plugin
from rosidl_adapter_proto.plotjuggler.series_buffers import MAXIMUM_KEYS, TopicSeries
from rosidl_adapter_proto.plotjuggler.series_model import Series
from rosidl_adapter_proto.plotjuggler.series_names import EVERY_NAME, SeriesNames
from rosidl_adapter_proto.plotjuggler.topic_parsers import TopicParser, TopicParsers, encodings, is_for
from rosidl_adapter_proto.transcode.records import Records

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rosidl_adapter_proto.time import Time

__all__ = ["BagSeries", "Series", "read_series"]

_THREADS = min(4, os.cpu_count() or 1)  # decompressing keeps no more of them busy while one parses
_LATEST = 2**63 - 1


@dataclass(frozen=True)
class BagSeries:
    """The series of a bag.

    Attributes:
        series: Those of a topic stand together, topics by name and keys in the order in which they first came. A key
            that has values of two types has two series.
        warnings: What is missing, for people: topics that could not be read, messages that were not valid, keys that
            were too many.
    """

    series: tuple[Series, ...]
    warnings: tuple[str, ...]


def read_series(
    bag: Bag,
    topics: Iterable[str] = (),
    fields: Iterable[str] = (),
    plugin: Plugin | None = None,
    start: Time | None = None,
    end: Time | None = None,
    array_policy: ArrayPolicy | None = None,
    progress: Callable[[int], None] | None = None,
) -> BagSeries:
    """Return the time series of a bag. All of them are in memory; blobs are no series.

    Args:
        bag: The bag.
        topics: Only these topics: names, or patterns with `*`; by default all.
        fields: Only these series: names such as `/imu/linear_acceleration/x`, what stands above several, such as
            `/imu/linear_acceleration`, or patterns with `*` and `?`; by default all.
        plugin: What parses the messages; by default our plugins, for protobuf, CDR and ROS 1. A plugin that is given
            parses the topics of its encoding alone.
        start: Only messages that were recorded at this time or later: nanoseconds since 1970, a `datetime` with a time
            zone, or anything else that `rosidl_adapter_proto.time` takes.
        end: Only messages that were recorded before this time.
        array_policy: What becomes of long arrays; by default what the plugin does by itself.
        progress: Called with a number of messages once they are parsed.

    Raises:
        BagError: The bag is damaged.
        PluginError: Our plugins cannot be found or built.
        RequestError: The bag has no such topic, no series of one of the names, or nothing that the plugin takes.
        TypeError: A time is none, or `topics` or `fields` is one text.
    """
    names = SeriesNames(fields)
    chosen = chosen_topics(bag, topics, names, plugin)
    reader = _Reader(TopicParsers(bag.types, plugin, array_policy), names)
    for file, run in bag.runs(chosen, start=start, end=end, threads=_THREADS):
        reader.read(file.path, file.topics, run.records, numpy.asarray(run.indexes, numpy.int64))
        if progress is not None:
            progress(len(run.indexes))
    read = [each for _, each in sorted(reader.topics.items())]
    problem = names.problem()
    if problem is not None and read and not any(each.failure for each in read):
        raise RequestError(f"{bag.path}: {problem}")
    warnings = WarningList()
    for text in (text for each in read for text in each.warnings()):
        warnings.add(text)
    return BagSeries(tuple(series for each in read for series in each.collected.series()), tuple(warnings))


def chosen_topics(
    bag: Bag, topics: Iterable[str] = (), names: SeriesNames = EVERY_NAME, plugin: Plugin | None = None
) -> list[str]:
    """Return the topics that `read_series` reads.

    Args:
        bag: As for `read_series`.
        topics: As for `read_series`.
        names: The names of series.
        plugin: As for `read_series`.

    Raises:
        RequestError: There is no topic of a name or a pattern, none that can have such a series, or none that the
            plugin takes.
        TypeError: `topics` is one text.
    """
    if isinstance(topics, str):
        raise TypeError(f"topics is one text, {topics!r}; give a list of names")
    patterns = list(topics)
    for pattern in patterns:
        if not any(is_named(name, [pattern]) for name in bag.topics):
            raise RequestError(f"{bag.path}: {no_such_topic(pattern, bag.topics)}")
    named = [name for name in bag.topics if not patterns or is_named(name, patterns)]
    chosen = [name for name in named if names.may_be_of(name)]
    if named and not chosen:
        raise RequestError(f"{bag.path}: no topic has such series; there are {', '.join(named)}")
    parsed = [name for name in chosen if plugin is None or is_for(plugin, bag.topics[name])]
    if chosen and not parsed:
        found = sorted({each for name in chosen for each in encodings(bag.topics[name]) if each})
        raise RequestError(
            f"{bag.path}: the plugin is for other topics than these, which are {', '.join(found)}"
        )
    return parsed


class _TopicSoFar:
    """What was read of a topic, in all files.

    Attributes:
        collected: Its series.
        count: How many messages there were.
        refused: How many of them could not be parsed.
        first_refused: The place of the first of them, and why.
        failure: Why no more of it is read; empty if it is.
    """

    def __init__(self, name: str, names: SeriesNames) -> None:
        self.collected = TopicSeries(name, names.is_chosen)
        self.count = 0
        self.refused = 0
        self.first_refused = ""
        self.failure = ""

    def read(self, path: str, parser: TopicParser, records: Records, which: NDArray[numpy.int64]) -> None:
        """Read messages of a chunk of a file.

        Raises:
            BagError: A time is too late.
            PluginError: The plugin was stopped, or broke its contract.
        """
        times = numpy.asarray(records.log_times)[which]
        name = self.collected.topic
        if int(times.max()) > _LATEST:
            raise BagError(
                f"{path}: a message of {name} has the time {times.max()}, and no series goes beyond {_LATEST} "
                "(the year 2262)"
            )
        ranges = numpy.asarray(records.ranges).reshape(-1, 2)[which]
        columns, refused = parser.parse(records.data, ranges)
        if refused and not self.refused:
            first = min(refused)
            place = message_place(path, self.count + first + 1, name, int(times[first]))
            self.first_refused = f"{place}: {refused[first]}"
        self.refused += len(refused)
        self.collected.add(times.astype(numpy.int64), columns, refused)

    def warnings(self) -> Iterator[str]:
        """Yield what is missing, for people."""
        name, left_out = self.collected.topic, self.collected.left_out
        if self.failure:
            yield f"{self.failure}; {len(self.collected)} of {self.count} messages of {name} were read"
        if self.refused:
            yield (
                f"{self.refused} of {self.count} messages of {name} could not be parsed and are left out; the first: "
                f"{self.first_refused}"
            )
        if left_out:
            yield (
                f"{name} has more than {MAXIMUM_KEYS} series; {left_out} values of others are left out: choose some "
                "with --field"
            )


class _Reader:
    """Reads runs of messages.

    Attributes:
        topics: What was read so far, by the names of topics.
    """

    def __init__(self, parsers: TopicParsers, names: SeriesNames) -> None:
        self.topics: dict[str, _TopicSoFar] = {}
        self._parsers = parsers
        self._names = names
        self._of_files: dict[tuple[str, int], TopicParser] = {}

    def read(
        self, path: str, topics: Mapping[int, Topic], records: Records, indexes: NDArray[numpy.int64]
    ) -> None:
        """Read some messages of a chunk of a file."""
        topic_ids = numpy.asarray(records.topic_ids)[indexes]
        for topic_id in numpy.unique(topic_ids).tolist():
            topic = topics[topic_id]
            which = indexes[topic_ids == topic_id]
            so_far = self.topics.setdefault(topic.name, _TopicSoFar(topic.name, self._names))
            parser = self._parser(path, topic_id, topic, so_far)
            if parser is not None and not so_far.failure:
                try:
                    so_far.read(path, parser, records, which)
                except PluginError as error:
                    so_far.failure = str(error)
            so_far.count += len(which)

    def _parser(self, path: str, topic_id: int, topic: Topic, so_far: _TopicSoFar) -> TopicParser | None:
        """Return the parser of a topic of a file; None if there is none, which is noted as its failure."""
        key = (path, topic_id)
        if key not in self._of_files and not so_far.failure:
            try:
                self._of_files[key] = self._parsers.parser(topic)
            except (BagError, SchemaError) as error:
                so_far.failure = str(error)
        return self._of_files.get(key)
