"""Round trips against the real ROS classes: ROS to protobuf to bytes and back, for every type there is."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest
from google.protobuf import json_format
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.generate.conftest import Generated
from tests.strategies import RosMessages


def check_round_trip(adapter: Any, message: Any) -> None:
    custom = adapter.convert_to_custom(message)
    again = adapter.custom_type.FromString(custom.SerializeToString())
    assert again == custom
    assert adapter.convert_to_ros_message(again) == message
    assert adapter.convert_to_custom(adapter.convert_to_ros_message(custom)) == custom
    assert pickle.loads(pickle.dumps(custom)) == custom
    assert copy.deepcopy(custom) == custom
    assert json_format.ParseDict(json_format.MessageToDict(custom), adapter.custom_type()) == custom


def run_round_trips(adapter: Any, messages: st.SearchStrategy[Any]) -> None:
    @given(messages)
    @settings(max_examples=10, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    def run(message: Any) -> None:
        check_round_trip(adapter, message)

    run()


def test_every_type(ros_install: Generated, ros_messages: RosMessages) -> None:
    names = ros_install.messages()
    assert len(names) > 200

    for name in names:
        adapter = ros_install.adapter(name)

        run_round_trips(adapter, ros_messages.message(name))
