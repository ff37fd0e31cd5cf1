"""Runs the command line as `python -m rosidl_adapter_proto`."""

from rosidl_adapter_proto.cli import main

main()
