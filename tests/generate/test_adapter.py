"""What generated adapters and packages have besides conversions: constants, groups, names, exports."""

from __future__ import annotations

import importlib
import math
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from tests.generate.conftest import Generated


def test_constants(things: SimpleNamespace) -> None:
    adapter = things.msg.EverythingAdapter
    assert adapter.DEBUG == 10
    assert adapter.NAME == "x"
    assert math.isinf(adapter.LIMIT)
    assert things.srv.Set_RequestAdapter.A == 3


def test_names_that_adapters_use_themselves(things: SimpleNamespace) -> None:
    adapter = things.msg.TakenAdapter
    assert (adapter.fields_, adapter.new_, adapter.custom_type_) == (3, 4, 5)
    assert adapter.new(cls=1) == things.msg.Taken(cls=1)


def test_projects_are_named_after_what_was_asked_for(things: SimpleNamespace) -> None:
    assert 'name = "things-root-things"' in (things.folder / "pyproject.toml").read_text()


@pytest.mark.parametrize("name", ["types", "rosidl_adapter_proto", "class", "a-b"])
def test_python_roots_that_cannot_be(name: str, tmp_path: Path) -> None:
    with pytest.raises(
        GenerateError, match=rf"'{name}' (is|cannot be) the name of a(nother)? Python package"
    ):
        generate(
            Request(("std_msgs",)), Catalog((store_source(),)), tmp_path / "out", Options(python_root=name)
        )


def test_names_that_collide(things: SimpleNamespace) -> None:
    """A message may be called like the adapter of another, like a base class, or like a message elsewhere."""
    assert things.msg.PartAdapter.DESCRIPTOR.full_name == "things.msg.pb.PartAdapter"
    assert things.msg.PartAdapter_.custom_type is things.msg.Part
    assert things.msg.PartAdapterAdapter.custom_type is things.msg.PartAdapter
    assert things.msg.ServiceAdapter.custom_type is things.msg.Service
    assert things.msg.HeaderAdapter.type_name == "things/msg/Header"
    assert things.msg.HeaderAdapter.fields[0].nested.type_name == "std_msgs/msg/Header"


def test_services_named_like_adapters(things: SimpleNamespace) -> None:
    """A service may be called like the adapter of another one, and like that of a message in it."""
    srv = things.srv
    assert srv.HeaderAdapter_ is srv.Header
    assert srv.HeaderAdapterAdapter is srv.HeaderAdapter
    assert srv.Header.type_name == "things/srv/Header"
    assert srv.HeaderAdapter.type_name == "things/srv/HeaderAdapter"
    assert srv.HeaderAdapter.request.fields[0].nested is things.msg.HeaderAdapter


def test_groups(things: SimpleNamespace) -> None:
    assert things.srv.SetAdapter.request is things.srv.Set_RequestAdapter
    assert things.srv.SetAdapter.response.custom_type is things.srv.Set_Response
    go = things.action.GoAdapter
    assert [go.goal, go.result, go.feedback] == [
        things.action.Go_GoalAdapter,
        things.action.Go_ResultAdapter,
        things.action.Go_FeedbackAdapter,
    ]
    assert go.send_goal.request.custom_type is things.action.Go_SendGoal_Request
    assert go.get_result.type_name == "things/action/Go_GetResult"
    assert go.feedback_message.custom_type is things.action.Go_FeedbackMessage


def test_services_and_actions_have_the_names_of_ros(things: SimpleNamespace) -> None:
    srv, action = things.srv, things.action
    assert srv.Set is srv.SetAdapter
    assert (srv.Set.Request, srv.Set.Response) == (srv.Set_Request, srv.Set_Response)
    assert action.Go is action.GoAdapter
    go = action.Go
    assert (go.Goal, go.Result, go.Feedback) == (action.Go_Goal, action.Go_Result, action.Go_Feedback)
    assert action.Go_SendGoal.Request is action.Go_SendGoal_Request
    assert action.Go_GetResult.Response is action.Go_GetResult_Response


def test_every_service_and_action_has_the_names_of_ros(ros_install: Generated) -> None:
    groups = [name for name in ros_install.interfaces if name.namespace != "msg"]
    assert groups
    for name in groups:
        package = importlib.import_module(f"rosidl_proto.{name.package}.{name.namespace}")
        parts = {"srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}[name.namespace]
        group = getattr(package, name.name)
        assert group is ros_install.adapter(name)
        for part in parts:
            assert getattr(group, part) is getattr(package, f"{name.name}_{part}")
            assert getattr(group, part) is getattr(group, part.lower()).custom_type


def test_package_exports(things: SimpleNamespace) -> None:
    assert {name for name in things.srv.__all__ if name.startswith("Set")} == {
        "Set",
        "SetAdapter",
        "Set_Request",
        "Set_RequestAdapter",
        "Set_Response",
        "Set_ResponseAdapter",
    }
    assert set(things.srv.__all__) <= set(dir(things.srv))
    with pytest.raises(AttributeError, match="has no attribute 'Nonsense'"):
        _ = things.srv.Nonsense


def test_empty_message(things: SimpleNamespace) -> None:
    adapter = things.msg.NothingAdapter
    assert [field.name for field in adapter.fields] == ["structure_needs_at_least_one_member"]
    assert adapter.convert_to_custom(object()) == things.msg.Nothing()


def test_protoc_output_of_the_same_file_can_be_loaded_beside(things: SimpleNamespace, tmp_path: Path) -> None:
    """protoc's own Python module of a generated .proto file shares the classes' descriptors."""
    proto = "things/msg/Header2.proto"
    subprocess.run(
        [
            sys.executable,
            "-m",
            "grpc_tools.protoc",
            f"-I{things.folder / 'proto'}",
            f"--python_out={tmp_path}",
            proto,
        ],
        check=True,
    )
    program = (
        f"import sys; sys.path[:0] = [{str(tmp_path)!r}, {str(things.folder / 'python')!r}]; "
        "import things.msg.Header2_pb2 as protoc; from things_root.things.msg import Header2; "
        "assert Header2.DESCRIPTOR.file is protoc.DESCRIPTOR"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
