"""Accounts for every message of a file that is converted: none may be lost without a word."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from rosidl_adapter_proto.bags.chunks import FailureInChunk
from rosidl_adapter_proto.bags.conversion import SHOWN_FAILURES, Counts, FailedMessage, OnError, Settings
from rosidl_adapter_proto.bags.routes import Fate, TopicRoute
from rosidl_adapter_proto.bags.warning_list import WarningList
from rosidl_adapter_proto.errors import BagError


class Ledger:
    """What has become of the messages of a file.

    Attributes:
        failures: The first messages that could not be converted.
        warnings: What the user should know.
        is_damaged: Whether something of the file could not be read.

    Args:
        path: The file, for people.
        routes: What becomes of its topics.
        said: How many messages the file says that each topic has.
        settings: How to convert.
    """

    def __init__(
        self, path: str, routes: Mapping[int, TopicRoute], said: Mapping[int, int], settings: Settings
    ) -> None:
        self.failures: list[FailedMessage] = []
        self.warnings = WarningList()
        self.is_damaged = False
        self._path = path
        self._routes = routes
        self._said = said
        self._on_error = settings.on_error
        self._chooses_times = settings.start_time > 0 or settings.end_time is not None
        self._failed: Counter[int] = Counter()

    @property
    def failed_count(self) -> int:
        """How many messages could not be converted: single ones, and those of topics of which no type is known."""
        unknown = [topic_id for topic_id, route in self._routes.items() if route.reason]
        return self._failed.total() + sum(self._said.get(topic_id, 0) for topic_id in unknown)

    def add_failures(
        self, counts: Mapping[int, int], failures: Sequence[FailureInChunk], written: Mapping[int, int]
    ) -> None:
        """Note the messages of a chunk that could not be converted.

        Args:
            counts: How many of each topic there are.
            failures: The first of them.
            written: How many messages of each topic the chunks before it gave.

        Raises:
            BagError: The conversion is to stop there.
        """
        before = Counter(written) + self._failed
        self._failed.update(counts)
        for each in failures[: SHOWN_FAILURES - len(self.failures)]:
            failure = each.failure
            self.failures.append(
                FailedMessage(
                    self._path,
                    self._routes[failure.topic_id].topic.name,
                    before[failure.topic_id] + each.number + 1,
                    failure.log_time,
                    str(failure.error),
                )
            )
        if self._on_error is OnError.STOP and failures:
            raise BagError(
                f"{self.failures[0]}; `--on-error skip` leaves such messages out, and `--on-error copy` copies them"
            )

    def add_damage(self, damage: BagError, advice: str = "") -> None:
        """Note that the file is damaged.

        Args:
            damage: What is wrong, and where.
            advice: What else to say if the conversion is to stop there.

        Raises:
            BagError: The conversion is to stop there.
        """
        if self._on_error is OnError.STOP:
            raise BagError(f"{damage}{advice}")
        self.is_damaged = True
        self.warnings.add(str(damage))

    def counts(self, written: Mapping[int, int]) -> dict[str, Counts]:
        """Return what became of the messages of each topic, by its name, compared with what the file says.

        Args:
            written: How many messages of each topic were written, without those that could not be converted.

        Raises:
            BagError: There are other numbers of messages than the file says, and nobody asked to go on then.
        """
        found: dict[str, Counts] = {}
        for topic_id, route in self._routes.items():
            name = route.topic.name
            counts = self._of_topic(topic_id, route.fate, written.get(topic_id, 0))
            self._compare(name, counts, self._said.get(topic_id, 0))
            found[name] = found.get(name, Counts()) + counts
        return found

    def _of_topic(self, topic_id: int, fate: Fate, written: int) -> Counts:
        said, failed = self._said.get(topic_id, 0), self._failed[topic_id]
        if fate is Fate.NOT_SELECTED:
            return Counts(not_selected=said)
        if fate is Fate.SKIPPED:
            return Counts(skipped=said)
        if fate is Fate.COPIED:
            return Counts(copied=written)
        if self._on_error is OnError.COPY:
            return Counts(converted=written, copied=failed)
        return Counts(converted=written, skipped=failed)

    def _compare(self, name: str, counts: Counts, said: int) -> None:
        """Account for the messages of a topic that were not found."""
        found, missing = counts.total, said - counts.total
        if missing > 0 and self._chooses_times:
            counts.not_selected = missing
        elif missing and self._on_error is OnError.STOP:
            raise BagError(
                f"{self._path}: it says that {name} has {said} messages, but {found} were found; "
                "`--on-error skip` converts those"
            )
        elif missing > 0:
            counts.lost = missing
            self.warnings.add(f"{self._path}: {missing} of the {said} messages of {name} are lost")
        elif missing:
            self.warnings.add(
                f"{self._path}: it says that {name} has {said} messages, but {found} were found"
            )
