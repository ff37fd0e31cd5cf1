"""Every message of every distribution in the embedded store generates, compiles, imports and converts.

So do adapters that are made of them at run time, and these are like the generated ones.

Distributions define the same protobuf files in different ways, so each needs a process of its own.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate import Request, generate
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source

# Converts a message of each type that is made and read by the rosbags library, which knows nothing of us.
PROGRAM = """
import dataclasses, importlib, sys
from rosbags.typesys import Stores, get_typestore
from rosidl_adapter_proto import TypeRegistry, adapter_for
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from tests.run_time import check_attributes

distribution, names = sys.argv[1], sys.argv[2:]
generation = "ros1" if distribution == "noetic" else "ros2"
types = get_typestore(Stores(f"{generation}_{distribution}"))

def value(field, number):
    import numpy
    kind, detail = field
    if kind.name == "NAME":
        return message(detail)
    if kind.name == "BASE":
        if detail[0] in ("string", "wstring"):
            return f"text {number}"[: detail[1] or None]
        return detail[0] == "bool" or (number + 0.5 if detail[0].startswith("float") else number)
    element, size = detail
    values = [value(element, number + each) for each in range(size if kind.name == "ARRAY" else min(2, size or 2))]
    scalar = element[0].name == "BASE" and element[1][0] not in ("string", "wstring")
    dtype = {"byte": "uint8", "char": "uint8"}.get(element[1][0], element[1][0]) if scalar else None
    return numpy.array(values, dtype=dtype) if scalar else values

def message(name):
    fields = types.fielddefs[name][1]
    return types.types[name](**{each: value(field, index) for index, (each, field) in enumerate(fields)})

def check(ros, custom, path):
    for name, _ in types.fielddefs[ros.__msgtype__][1]:
        if name == "structure_needs_at_least_one_member":
            continue
        expected, found = getattr(ros, name), getattr(custom, name)
        if dataclasses.is_dataclass(expected):
            check(expected, found, f"{path}.{name}")
        elif isinstance(expected, list) and expected and dataclasses.is_dataclass(expected[0]):
            assert len(expected) == len(found), path
            for one, other in zip(expected, found):
                check(one, other, f"{path}.{name}")
        elif hasattr(expected, "tolist"):
            if isinstance(found, bytes):
                assert expected.tobytes() == found, f"{path}.{name}"
            else:
                assert expected.tolist() == list(found), f"{path}.{name}"
        elif isinstance(found, bytes):
            assert expected == found.decode("utf-16-le"), f"{path}.{name}"
        else:
            assert expected == found, f"{path}.{name}"

registry = TypeRegistry(Catalog((store_source(distribution),)))
for name in types.fielddefs:
    package, namespace, short = name.split("/")
    module = importlib.import_module(f"rosidl_proto.{package}.{namespace}")
    generated = getattr(module, f"{short}Adapter")
    at_run_time = adapter_for(name, registry)
    check_attributes(at_run_time, generated)
    made = message(name)
    for adapter in (generated, at_run_time):
        custom = adapter.convert_to_custom(made)
        assert adapter.custom_type.FromString(custom.SerializeToString()) == custom
        check(made, custom, name)
        data = bytes(types.serialize_cdr(made, name))
        assert adapter.from_cdr(data) == custom, name
        check(types.deserialize_cdr(adapter.to_cdr(custom), name), custom, name)
print(len(types.fielddefs))
"""


@pytest.mark.parametrize("distribution", store.distributions())
def test_every_distribution(distribution: str, tmp_path: Path) -> None:
    source = store_source(distribution)
    result = generate(Request(tuple(source.packages)), Catalog((source,)), tmp_path / "out")
    checkout = Path(__file__).parents[2]
    environment = {"PYTHONPATH": f"{tmp_path / 'out/python'}:{checkout}"}
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, distribution],
        env=environment,
        capture_output=True,
        check=False,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    assert 100 < int(process.stdout) <= len(result.interfaces)
