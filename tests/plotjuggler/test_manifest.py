"""Manifests of plugins of PlotJuggler 3: as YAML, and as the released program reads them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import Error, PluginError
from rosidl_adapter_proto.plotjuggler.manifest import (
    CheckBox,
    ComboBox,
    Label,
    LineEdit,
    Manifest,
    SpinBoxDouble,
    SpinBoxInt,
    read_manifest,
    read_released_manifest,
    unseen_by_released,
)

# The example of PlotJuggler's page, whose structure this is.
PAGE = r"""
plugin_type: MessageParser # only one supported for the time being
name: ParserFactoryROS2
version: 0.1.0
description: Plugin to parse DDS messages (e.g., from ROS2)
author: Davide Faconti
license: AGPL
url: https://github.com/facontidavide/rosx_introspection

encoding: "ros2msg" # mandatory for MessageParser type

parameters_model: # Optional

    - ID: label_1 # identifier of the label
      type: Label
      label: "This is just text"

    - ID: host_name # contains text
      label: "Host IP:"
      type: LineEdit
      default_value: "127.0.0.1"                  # Optional
      description: "ID address must be numerical" # Optional
      regexp_validation: "[0-9]{1,3}\\.[0-9]{1,3}\\.[0-9]{1,3}\\.[0-9]{1,3}" # Optional

    - ID: port_number
      label: "Port number:"
      type: SpinBoxInt
      description: "Port number" # Optional
      default_value: 1888        # Optional
      range: [0, 9999]           # Optional: vector with min/max pair

    - ID: real_value
      label: "Multiplier:"
      type: SpinBoxDouble
      description: "Multiplier value" # Optional
      default_value: 3.14             # Optional
      range: [0, 10]                  # Optional: vector with min/max pair

    - ID: debug_mode
      type: CheckBox
      default_value: true  # Optional. False if missing
      description: "Enable debug mode" # Optional

    - ID: more_options
      type: ComboBox
      values: "YES;NO;ASK"        # Mandatory: must be semicolon separated
      default_value: "ASK"        # Optional
      description: "Autoconfirm?" # Optional
"""
PLAIN = "plugin_type: MessageParser\nname: n\nencoding: json;cbor\nversion: 1.0\n"


def test_the_example_of_the_page() -> None:
    address = r"[0-9]{1,3}\.[0-9]{1,3}\.[0-9]{1,3}\.[0-9]{1,3}"
    assert read_manifest(PAGE) == Manifest(
        "ParserFactoryROS2",
        "ros2msg",
        "0.1.0",
        "Plugin to parse DDS messages (e.g., from ROS2)",
        "Davide Faconti",
        "AGPL",
        "https://github.com/facontidavide/rosx_introspection",
        (
            Label("label_1", "This is just text"),
            LineEdit("host_name", "Host IP:", "127.0.0.1", "ID address must be numerical", address),
            SpinBoxInt("port_number", "Port number:", 1888, "Port number", (0, 9999)),
            SpinBoxDouble("real_value", "Multiplier:", 3.14, "Multiplier value", (0.0, 10.0)),
            CheckBox("debug_mode", None, True, "Enable debug mode"),
            ComboBox("more_options", None, ("YES", "NO", "ASK"), "ASK", "Autoconfirm?"),
        ),
    )


def test_the_released_program_rejects_the_example_of_the_page() -> None:
    with pytest.raises(PluginError) as caught:
        read_released_manifest(PAGE)
    assert str(caught.value) == (
        "manifest: the released PlotJuggler sees the plugin_type 'MessageParser # only one supported for the time"
        " being' instead of 'MessageParser': it keeps quotes and comments"
    )


def test_a_plain_manifest_is_read_the_same_by_both() -> None:
    expected = Manifest("n", "json;cbor", "1.0")
    assert read_manifest(PLAIN) == read_released_manifest(PLAIN) == expected
    assert expected.encodings == ("json", "cbor")
    assert unseen_by_released(PLAIN) == []


def test_what_the_released_program_does_not_see() -> None:
    text = (
        PLAIN
        + 'url: https://example.org\nauthor: "A"\nparameters_model:\n  - {ID: a, type: Label, label: b}\n'
    )
    assert unseen_by_released(text) == [
        "author is seen as '\"A\"'",
        "url is not seen: line 5 has 2 colons",
        "parameters_model is not seen",
    ]
    assert unseen_by_released(PAGE)[-1] == "parameters_model is not seen"
    with pytest.raises(PluginError) as caught:
        read_released_manifest("plugin_type: MessageParser\nname: a:b\nencoding: x")
    assert str(caught.value) == "manifest: the released PlotJuggler sees no name: line 2 has 2 colons"
    # A member of a parameter takes the place of one of the plugin.
    nested = PLAIN + "parameters_model:\n  - ID: a\n    type: Label\n    label: b\n    name: c\n"
    assert read_released_manifest(nested).name == "c"


def widget(kind: str, members: str) -> str:
    return f"{PLAIN}parameters_model:\n  - {{ID: p, type: {kind}, {members}}}\n"


WRONG = {
    "": "manifest: not members with names",
    "a: 1\n---\nb: 1": "manifest: line 2: a second document begins; there may be one",
    "name: n": "manifest: plugin_type: is missing",
    "plugin_type: DataLoader": "manifest: plugin_type: 'DataLoader'; the only one is MessageParser",
    "plugin_type: [a]": "manifest: plugin_type: is not a single value",
    "plugin_type: MessageParser\nname: ''": "manifest: name: is empty",
    "plugin_type: MessageParser\nname: n": "manifest: encoding: is missing",
    "plugin_type: MessageParser\nname: n\nencoding: ;": "manifest: encoding: is empty",
    PLAIN + "license: {a: b}": "manifest: license: is not a single value",
    PLAIN + "parameters_model: x": "manifest: parameters_model: is not a list of at most 1000 parameters",
    PLAIN + "parameters_model: [x]": "manifest: parameters_model[0]: not members with names",
    PLAIN + "parameters_model: [{type: Label}]": "manifest: parameters_model[0]: ID: is missing",
    PLAIN + "parameters_model: [{ID: a}]": "manifest: parameter a: type: is missing",
    PLAIN
    + "parameters_model: [{ID: a, type: Slider}]": "manifest: parameter a: type: 'Slider' is none of Label,"
    " LineEdit, SpinBoxInt, SpinBoxDouble, CheckBox, ComboBox",
    PLAIN
    + "parameters_model: [{ID: a, type: CheckBox}, {ID: a, type: CheckBox}]": "manifest: parameter a: ID:"
    " a second parameter of that name",
    widget("Label", "x: y"): "manifest: parameter p: label: is missing",
    widget("Label", "label: a, default_value: b"): "manifest: parameter p: default_value: no Label has it",
    widget(
        "LineEdit", "label: a, regexp_validation: '('"
    ): "manifest: parameter p: regexp_validation: '(' is no"
    " regular expression: missing ), unterminated subpattern at position 0",
    widget(
        "LineEdit", f"label: a, regexp_validation: {'a' * 1001}"
    ): "manifest: parameter p: regexp_validation: has"
    " more than 1000 characters",
    widget("LineEdit", "label: a, regexp_validation: 'a{99999999999999}'"): "manifest: parameter p:"
    " regexp_validation: 'a{99999999999999}' is no regular expression: the repetition number is too large",
    widget(
        "SpinBoxInt", "label: a, default_value: 1.5"
    ): "manifest: parameter p: default_value: '1.5' is no integer"
    " of 32 bits",
    widget(
        "SpinBoxInt", "label: a, default_value: 2147483648"
    ): "manifest: parameter p: default_value: '2147483648'"
    " is no integer of 32 bits",
    widget(
        "SpinBoxInt", "label: a, range: [0]"
    ): "manifest: parameter p: range: is not a smallest and a largest"
    " number, such as [0, 10]",
    widget(
        "SpinBoxInt", "label: a, range: [2, 1]"
    ): "manifest: parameter p: range: begins at 2, which is more than 1",
    widget(
        "SpinBoxInt", "label: a, range: [0, 1], default_value: 2"
    ): "manifest: parameter p: default_value: 2 is not"
    " within 0 and 1",
    widget(
        "SpinBoxDouble", "label: a, default_value: nan"
    ): "manifest: parameter p: default_value: 'nan' is no number",
    widget(
        "SpinBoxDouble", "label: a, range: [[], 1]"
    ): "manifest: parameter p: range: is not a single value",
    widget(
        "CheckBox", "default_value: 2"
    ): "manifest: parameter p: default_value: '2' is neither true nor false",
    widget("ComboBox", "label: a"): "manifest: parameter p: values: is missing",
    widget(
        "ComboBox", "values: a;b, default_value: c"
    ): "manifest: parameter p: default_value: 'c' is none of a, b",
    PLAIN + "x" * 65_536: "manifest: 65604 characters; at most 65536 are read",
}


@pytest.mark.parametrize("text", WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_is_told(text: str) -> None:
    with pytest.raises(PluginError) as caught:
        read_manifest(text)
    assert str(caught.value) == WRONG[text]


def test_what_is_no_yaml() -> None:
    for text in ("a: [", "a: b: c", "a: &x *x", "[" * 1000, "a: \0"):
        with pytest.raises(PluginError, match=r"^manifest: "):
            read_manifest(text)


def test_defaults_and_ranges_are_optional() -> None:
    members = {
        "LineEdit": "label: a",
        "SpinBoxInt": "label: a",
        "SpinBoxDouble": "label: a",
        "CheckBox": "label: a",
    }
    found = [read_manifest(widget(kind, each)).parameters[0] for kind, each in members.items()]
    assert found == [
        LineEdit("p", "a", None, None, None),
        SpinBoxInt("p", "a", None, None, None),
        SpinBoxDouble("p", "a", None, None, None),
        CheckBox("p", "a", False, None),
    ]


@given(st.data())
def test_damaged_manifests_give_our_errors_alone(data: st.DataObject) -> None:
    begin = data.draw(st.integers(0, len(PAGE)))
    text = PAGE[:begin] + data.draw(st.text(max_size=5)) + PAGE[begin + data.draw(st.integers(0, 20)) :]
    for read in (read_manifest, read_released_manifest, unseen_by_released):
        try:
            read(text)
        except Error:
            continue
