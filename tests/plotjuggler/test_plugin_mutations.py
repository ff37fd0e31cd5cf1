"""Mutated messages and schemas: whatever they are, no plugin traps, and none writes more than it may."""

from __future__ import annotations

from pathlib import Path

import pytest
import wasmtime

from tests.plotjuggler.released_host import OUTPUT_SIZE, ReleasedHost, ReleasedParser
from tests.plotjuggler.topics import ENCODINGS, Topic, topics

MUTATIONS = 100_000
"""How many of messages, and how many of schemas, for each plugin."""


class Mutations:
    """Functions of `mutations.wat` for a plugin."""

    def __init__(self, plugin: Path) -> None:
        self.host = host = ReleasedHost(plugin)
        module = wasmtime.Module.from_file(host.store.engine, Path(__file__).with_name("mutations.wat"))
        names = {each.name: each.name for each in module.imports}
        given = {"decode": "pj_parser_decode", "create": "pj_parser_create", "destroy": "pj_parser_destroy"}
        imports = [host.exports[given.get(str(name), str(name))] for name in names]
        self.functions = wasmtime.Instance(host.store, module, imports).exports(host.store)

    def call(self, name: str, *arguments: int) -> int:
        function = self.functions[name]
        assert isinstance(function, wasmtime.Func)
        return int(function(self.host.store, *arguments))


@pytest.fixture
def mutations(plugin: Path) -> Mutations:
    return Mutations(plugin)


def longest(topic: Topic) -> bytes:
    return max(topic.messages, key=len)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_messages(mutations: Mutations, encoding: str) -> None:
    host = mutations.host
    recorded = [topic for topic in topics(encoding) if longest(topic)]
    good = 0
    for topic in recorded:
        parser = ReleasedParser(host, topic.type_name.encode(), topic.schema)
        parser.set_array_policy(True, 20)
        message = longest(topic)
        original = host.allocate(len(message), message)
        count = MUTATIONS // len(recorded)
        good += mutations.call(
            "messages", count, parser.instance, original, len(message), parser.input, parser.output
        )
        assert parser.decode(message)
    assert MUTATIONS / 10 < good < MUTATIONS


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_schemas(mutations: Mutations, encoding: str) -> None:
    host = mutations.host
    recorded = [topic for topic in topics(encoding) if topic.schema]
    good = 0
    for topic in recorded:
        message, schema = longest(topic), topic.schema
        addresses = [
            host.allocate(len(each) + 1, each + b"\0") for each in (topic.type_name.encode(), schema)
        ]
        work, given = host.allocate(len(schema) + 1), host.allocate(len(message) or 1, message)
        output = host.allocate(OUTPUT_SIZE)
        count = MUTATIONS // len(recorded)
        good += mutations.call("schemas", count, *addresses, len(schema), work, given, len(message), output)
        assert ReleasedParser(host, topic.type_name.encode(), schema).instance
    assert MUTATIONS / 10 < good < MUTATIONS
