"""`rosidl-proto bag converters`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Outcome, Run
from tests.converters.plugins import install

HERE = "tests.converters.plugins"
OURS = "rosidl_adapter_proto.converters"
BUILT_IN = {
    "cdr": f"cdr        reads, writes  {OURS}.cdr:CdrConverter, built in\n",
    "protobuf": f"protobuf   reads, writes  {OURS}.protobuf:ProtobufConverter, built in\n",
    "ros1": f"ros1       reads          {OURS}.ros1:Ros1Deserializer, built in\n",
    "rosbag_v2": f"rosbag_v2  reads          {OURS}.ros1:Ros1Deserializer, built in\n",
}


def test_what_is_built_in(run: Run) -> None:
    assert run("bag", "converters") == Outcome(0, "".join(BUILT_IN.values()), "")


def test_plugins(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    install(folder, "my-plugins", a_converter=f"{HERE}:JsonSerializer", b_converter="no_such_module:Class")
    install(folder, "other-plugins", protobuf_converter=f"{HERE}:JsonConverter")
    monkeypatch.syspath_prepend(str(folder))

    ended = run("bag", "converters", "--plugin", f"{HERE}:JsonDeserializer")

    assert (ended.code, ended.err) == (0, "")
    twice = (
        f"protobuf_converter is there more than once: {OURS}.protobuf:ProtobufConverter (built in) and "
        f"{HERE}:JsonConverter (entry point of other-plugins 1.0); one format has one converter"
    )
    assert ended.out == (
        f"a          writes         {HERE}:JsonSerializer, entry point of my-plugins 1.0\n"
        "b          broken         b_converter (no_such_module:Class, entry point of my-plugins 1.0) "
        "cannot be used: ModuleNotFoundError: No module named 'no_such_module'\n"
        f"{BUILT_IN['cdr']}"
        f"json       reads          {HERE}:JsonDeserializer, registered\n"
        f"protobuf   broken         {twice}\n"
        f"protobuf   broken         {twice}\n"
        f"{BUILT_IN['ros1']}{BUILT_IN['rosbag_v2']}"
    )


def test_a_plugin_that_is_not_there(run: Run) -> None:
    assert run("bag", "converters", "--plugin", "no_such_module:Class") == Outcome(
        3,
        "",
        "Error: plugin (no_such_module:Class, given by name) cannot be used: "
        "ModuleNotFoundError: No module named 'no_such_module'\n",
    )
