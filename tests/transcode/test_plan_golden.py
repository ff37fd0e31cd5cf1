"""Golden plans: packed plans as text and as bytes, which the tests of the core read too.

Whoever changes the layout of plans, or the list of CDR forms, sees it here, and `core/test` fails until the core agrees
with it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from protobuf_types import descriptor_of, general_file
from ros_types import describe, nasty_types, protobuf_class, struct_type

from rosidl_adapter_proto.interfaces.scalars import SCALARS, CdrForm
from rosidl_adapter_proto.transcode.plan import UNBOUNDED, VERSION, Operation, Plan, build_plan
from rosidl_adapter_proto.transcode.protobuf_plan import NATURAL_FORMS, protobuf_plan
from tests.transcode.recorded_plans import plan_of_text

FOLDER = Path(__file__).parents[1] / "golden" / "plans"
TYPES = {
    **nasty_types(),
    **struct_type("test/msg/Stamp", sec="int32", nanosec="uint32"),
    **struct_type("test/msg/Header", stamp="test/msg/Stamp", frame_id="string"),
    **struct_type("test/msg/Image", header="test/msg/Header", width="uint32", data="uint8[]", step="uint32"),
}
PLANS: dict[str, tuple[str, dict[str, Any]]] = {
    "every_form": ("test/msg/Nasty", {}),
    "image": ("test/msg/Image", {"omit_empty_messages": True}),
    "chosen_fields": ("test/msg/Image", {"fields": ["header.stamp.nanosec", "width"]}),
}
RECORDED = {"imu": "sensor_msgs/msg/Imu"}
"""Plans of texts that are in files beside them."""
GENERAL, GENERAL_SET = "general", "general_set"
"""The plan of a message that does not come from ROS, and the descriptor set that it is of."""


def bound(number: int) -> str:
    return "-" if number == UNBOUNDED else str(number)


def operation_text(operation: Operation) -> str:
    return (
        f"  {operation.name} = {operation.protobuf_name or '-'}:"
        f" type {operation.scalar}, {operation.cdr.name} to {operation.protobuf}, number {operation.number},"
        f" {operation.shape.name} of {bound(operation.count)}, characters {bound(operation.string_bound)},"
        f" message {operation.message}{', omitted if empty' if operation.omit_empty else ''}\n"
    )


def plan_text(plan: Plan) -> str:
    """Write a plan as `core/test/golden.cpp` does."""
    text = f"plan of version {VERSION}{', partial' if plan.partial else ''}\n"
    for index, message in enumerate(plan.messages):
        text += f"message {index}: {message.name} = {message.protobuf_name}\n"
        text += "".join(map(operation_text, message.operations))
    return text


def in_lines(content: bytes) -> str:
    digits = content.hex()
    return "bytes\n" + "".join(f"{digits[i : i + 100]}\n" for i in range(0, len(digits), 100))


def golden(plan: Plan) -> str:
    return plan_text(plan) + in_lines(plan.pack())


def forms() -> str:
    """Write each CDR form, the protobuf types that its values and its arrays have, and the largest character."""
    facts = {CdrForm.MESSAGE: {("message", "message", 0)}}
    for scalar in SCALARS.values():
        if scalar.cdr is not None:
            facts.setdefault(scalar.cdr, set()).add((scalar.protobuf, scalar.many, scalar.largest_character))
    for protobuf, (_, form) in NATURAL_FORMS.items():
        if protobuf != "enum":  # which is an int32 on the wire
            facts.setdefault(form, set()).add((protobuf, protobuf, 0))
    text = ""
    for form in CdrForm:
        ((one, many, largest_character),) = facts[form]
        types = (getattr(FieldDescriptor, f"TYPE_{each.upper()}") for each in (one, many))
        text += f"{form.value} {form.name} {' '.join(map(str, types))} {largest_character}\n"
    return text


def plan_of(name: str) -> Plan:
    if name == GENERAL:
        plan, _ = protobuf_plan(descriptor_of([general_file()], "test.General"))
        return plan
    type_name, options = PLANS[name]
    message_class = protobuf_class(TYPES, type_name, hashed=name == "image")
    return build_plan(describe(TYPES, type_name), message_class.DESCRIPTOR, **options)


def compare(name: str, text: str, request: pytest.FixtureRequest) -> None:
    file = FOLDER / f"{name}.txt"
    if request.config.getoption("--update-golden"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    assert text == file.read_text(encoding="utf-8"), f"{file}: if it is meant, run: make golden"


@pytest.mark.parametrize("name", [*PLANS, GENERAL])
def test_golden_plan(name: str, request: pytest.FixtureRequest) -> None:
    compare(name, golden(plan_of(name)), request)


@pytest.mark.parametrize("name", RECORDED)
def test_golden_plan_of_a_recorded_text(name: str, request: pytest.FixtureRequest) -> None:
    text = (FOLDER / f"{name}_text.txt").read_bytes()
    compare(name, golden(plan_of_text(text, RECORDED[name])), request)


def test_general_set(request: pytest.FixtureRequest) -> None:
    content = FileDescriptorSet(file=[general_file()]).SerializeToString(deterministic=True)
    compare(GENERAL_SET, f"a descriptor set\n{in_lines(content)}", request)


def test_forms(request: pytest.FixtureRequest) -> None:
    compare("forms", forms(), request)


def test_plans_have_every_form() -> None:
    plans = plan_of("every_form"), plan_of(GENERAL)
    found = [{each.cdr for message in plan.messages for each in message.operations} for plan in plans]
    assert found[0] == {each for each in CdrForm if each <= CdrForm.MESSAGE}
    assert found[0] | found[1] == set(CdrForm)


def test_no_other_files() -> None:
    assert {file.stem for file in FOLDER.iterdir()} == {
        *PLANS,
        *RECORDED,
        *(f"{each}_text" for each in RECORDED),
        *(GENERAL, GENERAL_SET),
        "forms",
    }
