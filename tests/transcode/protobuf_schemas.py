"""Descriptor files of messages that do not come from ROS, made by hypothesis."""

from __future__ import annotations

from google.protobuf import descriptor_pb2
from hypothesis import strategies as st
from protobuf_types import SCALAR_TYPES, add_message, set_option

KEYS = [name for name in SCALAR_TYPES if name not in ("double", "float", "bytes")]
TYPE_IDS = range(1, 24)


@st.composite
def files(draw: st.DrawFn) -> descriptor_pb2.FileDescriptorProto:
    """Return a file with messages `test.M0`, `test.M1` and so on, which may contain each other and themselves."""
    file = descriptor_pb2.FileDescriptorProto(name="made.proto", package="test", syntax="proto3")
    enum = file.enum_type.add(name="E")
    enum.value.add(name="V0", number=0)
    for index, number in enumerate(
        draw(st.lists(st.integers(-5, 5).filter(bool), max_size=4, unique=True)), 1
    ):
        enum.value.add(name=f"V{index}", number=number)
    count = draw(st.integers(1, 4))
    messages = st.integers(0, count - 1).map(".test.M{}".format)
    values = st.one_of(st.sampled_from(SCALAR_TYPES), st.just("enum .test.E"), messages)
    texts = st.one_of(
        values,
        values.map("repeated {}".format),
        st.builds(
            "map {} {}".format, st.sampled_from(KEYS), st.one_of(st.sampled_from(SCALAR_TYPES), messages)
        ),
    )
    for index in range(count):
        fields = draw(st.lists(texts, max_size=5))
        message = add_message(file, f"M{index}", **{f"f{i}": text for i, text in enumerate(fields)})
        for field in message.field:
            if draw(st.integers(0, 5)) == 0:
                set_option(field, bytes([draw(st.sampled_from(TYPE_IDS))]))
    return file
