"""The ament index resource, as versions of this program leave it for each other."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.settings import OPTIONS, Setting
from rosidl_adapter_proto.generate.targets.index import (
    RESOURCE_FOLDER,
    GeneratedPackage,
    InstalledPackage,
    installed_packages,
)
from tests.folders import write_package

DEFAULTS = {each.attribute: each.default for each in OPTIONS if each.changes_output}
FACTS = {"interfaces": 1, "definitions": "0123", **DEFAULTS}


def prefix(folder: Path, text: str) -> Path:
    return write_package(folder / "ros", {f"{RESOURCE_FOLDER}/my_msgs": text})


@pytest.mark.parametrize(
    "option", [each for each in OPTIONS if each.changes_output], ids=lambda row: row.name
)
def test_a_version_without_an_option(option: Setting, tmp_path: Path) -> None:
    """What was installed before there was an option is what its default makes."""
    facts = {name: value for name, value in FACTS.items() if name != option.attribute}
    ros = prefix(tmp_path, json.dumps(facts))

    assert installed_packages([ros]) == {
        "my_msgs": InstalledPackage(ros, GeneratedPackage(1, "0123", DEFAULTS))
    }


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (json.dumps({**FACTS, "colour": "red"}), "it has 'colour', which only a newer version knows"),
        (json.dumps({"definitions": "0123", **DEFAULTS}), "'interfaces' is missing"),
        (json.dumps({"interfaces": 1}), "'definitions' is missing"),
        ("[]", "it is not a JSON object"),
        ("{", "Expecting property name enclosed in double quotes: line 1 column 2 (char 1)"),
    ],
)
def test_what_cannot_be_read(text: str, reason: str, tmp_path: Path) -> None:
    ros = prefix(tmp_path, text)

    with pytest.raises(GenerateError) as raised:
        installed_packages([ros])

    assert str(raised.value) == (
        f"{ros / RESOURCE_FOLDER}/my_msgs is not a resource that this version of rosidl-proto reads ({reason}); "
        "install its package again, or remove the file"
    )
