from __future__ import annotations

import dataclasses

import pytest

from rosidl_adapter_proto.interfaces.model import (
    Action,
    ArrayType,
    BasicType,
    Field,
    Location,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    messages,
    parts,
    references,
    value_type,
)

FOO, DO, GO = (TypeName.parse(each) for each in ("pkg/msg/Foo", "pkg/srv/Do", "pkg/action/Go"))
TIME = TypeName("builtin_interfaces", "msg", "Time")
UUID = TypeName("unique_identifier_msgs", "msg", "UUID")
INT8 = BasicType("int8")

SERVICE = Service(DO, Message(DO.sibling("_Request"), ()), Message(DO.sibling("_Response"), ()))
GOAL, RESULT, FEEDBACK = (Message(GO.sibling(each), ()) for each in ("_Goal", "_Result", "_Feedback"))
ACTION = Action(GO, GOAL, RESULT, FEEDBACK)


def test_type_names() -> None:
    assert str(FOO) == "pkg/msg/Foo"
    assert (FOO.package, FOO.namespace, FOO.name) == ("pkg", "msg", "Foo")
    assert FOO.sibling("_Request") == TypeName("pkg", "msg", "Foo_Request")
    assert sorted([FOO, DO, GO]) == [GO, FOO, DO]


@pytest.mark.parametrize(
    "text", ["", "Foo", "pkg/Foo", "pkg/msg/Foo/Bar", "/msg/Foo", "pkg//Foo", "pkg/msg/"]
)
def test_what_is_no_type_name(text: str) -> None:
    with pytest.raises(ValueError) as caught:
        TypeName.parse(text)
    assert str(caught.value) == f"{text!r} is not of the form package/namespace/Name"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("int8", (-128, 127)),
        ("uint8", (0, 255)),
        ("octet", (0, 255)),
        ("char", (0, 127)),
        ("int16", (-32768, 32767)),
        ("uint16", (0, 65535)),
        ("int32", (-(2**31), 2**31 - 1)),
        ("uint32", (0, 2**32 - 1)),
        ("int64", (-(2**63), 2**63 - 1)),
        ("uint64", (0, 2**64 - 1)),
    ],
)
def test_integer_ranges(name: str, expected: tuple[int, int]) -> None:
    assert BasicType(name).scalar.range == expected


@pytest.mark.parametrize("each", [INT8, StringType(), FOO])
def test_value_types(each: BasicType | StringType | TypeName) -> None:
    assert value_type(each) == value_type(ArrayType(each, 2)) == value_type(SequenceType(each)) == each


def test_what_describes_the_same_type_is_equal() -> None:
    field = Field("a", INT8)
    assert field == dataclasses.replace(field, comment=("c",), unit="m", location=Location("f", 1))
    assert field != dataclasses.replace(field, default=1)
    assert Message(FOO, (field,), comment=("c",), text="x") == Message(FOO, (field,), text="y")
    with pytest.raises(dataclasses.FrozenInstanceError):
        field.name = "b"  # type: ignore[misc]


def test_locations() -> None:
    assert str(Location("a/msg/A.msg", 3, 5)) == "a/msg/A.msg:3:5"
    assert str(Location("a/msg/A.msg", 3)) == "a/msg/A.msg:3:1"


def test_the_messages_of_a_service() -> None:
    assert messages(SERVICE) == (SERVICE.request, SERVICE.response)
    assert messages(SERVICE, events=True) == (SERVICE.request, SERVICE.response, SERVICE.event)
    assert SERVICE.event == Message(
        DO.sibling("_Event"),
        (
            Field("info", TypeName("service_msgs", "msg", "ServiceEventInfo")),
            Field("request", SequenceType(DO.sibling("_Request"), 1)),
            Field("response", SequenceType(DO.sibling("_Response"), 1)),
        ),
    )


def test_the_messages_of_an_action() -> None:
    goal_id = Field("goal_id", UUID)
    expected = [
        *messages_of_parts(),
        Message(GO.sibling("_SendGoal_Request"), (goal_id, Field("goal", GO.sibling("_Goal")))),
        Message(
            GO.sibling("_SendGoal_Response"), (Field("accepted", BasicType("boolean")), Field("stamp", TIME))
        ),
        Message(GO.sibling("_GetResult_Request"), (goal_id,)),
        Message(
            GO.sibling("_GetResult_Response"), (Field("status", INT8), Field("result", GO.sibling("_Result")))
        ),
        Message(GO.sibling("_FeedbackMessage"), (goal_id, Field("feedback", GO.sibling("_Feedback")))),
    ]
    assert list(messages(ACTION)) == expected
    with_events = [str(each.name).removeprefix("pkg/action/Go_") for each in messages(ACTION, events=True)]
    assert with_events == [
        *("Goal", "Result", "Feedback", "SendGoal_Request", "SendGoal_Response", "SendGoal_Event"),
        *("GetResult_Request", "GetResult_Response", "GetResult_Event", "FeedbackMessage"),
    ]


def test_parts() -> None:
    assert parts(Message(FOO, ())) == {}
    own = {"request": DO.sibling("_Request"), "response": DO.sibling("_Response")}
    assert parts(SERVICE) == {DO: own}
    send_goal, get_result = GO.sibling("_SendGoal"), GO.sibling("_GetResult")
    assert parts(ACTION) == {
        GO: {
            "goal": GO.sibling("_Goal"),
            "result": GO.sibling("_Result"),
            "feedback": GO.sibling("_Feedback"),
            "send_goal": send_goal,
            "get_result": get_result,
            "feedback_message": GO.sibling("_FeedbackMessage"),
        },
        send_goal: {"request": send_goal.sibling("_Request"), "response": send_goal.sibling("_Response")},
        get_result: {"request": get_result.sibling("_Request"), "response": get_result.sibling("_Response")},
    }


def messages_of_parts() -> list[Message]:
    return [ACTION.goal, ACTION.result, ACTION.feedback]


def test_references() -> None:
    fields = (
        Field("a", INT8),
        Field("b", FOO),
        Field("c", ArrayType(DO, 2)),
        Field("d", SequenceType(StringType())),
    )
    assert list(references(Message(FOO, fields))) == [(fields[1], FOO), (fields[2], DO)]
