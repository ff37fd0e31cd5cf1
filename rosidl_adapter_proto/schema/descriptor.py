"""From a `.proto` file as plain data to its descriptor, without protoc."""

from __future__ import annotations

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    MessageOptions,
    MethodDescriptorProto,
    ServiceDescriptorProto,
)

from rosidl_adapter_proto.schema.proto import ProtoField, ProtoFile, ProtoMessage, ProtoService

# `deprecated_legacy_json_field_conflicts = true` as protobuf has it on the wire: field 11, whose name releases before
# 4.22 do not know, though they keep it.
_JSON_CONFLICTS_ALLOWED = b"\x58\x01"


def file_descriptor(file: ProtoFile) -> FileDescriptorProto:
    """Return the descriptor of a `.proto` file, equal to what protoc's own Python output embeds.

    That has no JSON names and no comments, which protoc only writes into descriptor sets.
    """
    return FileDescriptorProto(
        name=file.path,
        package=file.package,
        dependency=file.imports,
        message_type=[_message(each) for each in file.messages],
        service=[_service(file.service)] if file.service else [],
        syntax="proto3",
    )


def _message(message: ProtoMessage) -> DescriptorProto:
    return DescriptorProto(
        name=message.name,
        field=[_field(each) for each in message.fields],
        # Of a reserved range, the end is the first number that is not reserved (descriptor.proto).
        reserved_range=[
            DescriptorProto.ReservedRange(start=each, end=each + 1) for each in message.reserved_numbers
        ],
        reserved_name=message.reserved_names,
        options=MessageOptions.FromString(_JSON_CONFLICTS_ALLOWED) if message.has_json_conflict else None,
    )


def _field(field: ProtoField) -> FieldDescriptorProto:
    is_message = field.type.startswith(".")
    type_name = "message" if is_message else field.type
    return FieldDescriptorProto(
        name=field.name,
        number=field.number,
        label=FieldDescriptorProto.LABEL_REPEATED if field.repeated else FieldDescriptorProto.LABEL_OPTIONAL,
        type=FieldDescriptorProto.Type.Value(f"TYPE_{type_name.upper()}"),
        type_name=field.type if is_message else None,
    )


def _service(service: ProtoService) -> ServiceDescriptorProto:
    return ServiceDescriptorProto(
        name=service.name,
        method=[
            MethodDescriptorProto(name=each.name, input_type=each.request, output_type=each.response)
            for each in service.rpcs
        ],
    )
