# `make demo` shows the main job, `make test` runs all tests and static checks. Both make their own environments.
PYTHON ?= python3
VENV := .venv
JAZZY := .venv-jazzy
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: demo test check test-kilted test-jazzy test-oldest benchmark golden format clean

# What only the tests need of ROS, and the oldest protobuf runtime that generated code runs on.
KILTED_TEST_PACKAGES := ros-test-msgs ros-test-interface-files
JAZZY_TEST_PACKAGES := ros-jazzy-test-msgs ros-jazzy-test-interface-files protobuf==4.21.12 grpcio-tools==1.62.3

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable '.[ros,test]' $(KILTED_TEST_PACKAGES)
	touch $@

$(JAZZY)/ready: pyproject.toml
	$(PYTHON) -m venv $(JAZZY)
	$(JAZZY)/bin/pip install --quiet --editable '.[ros-jazzy,test]' $(JAZZY_TEST_PACKAGES)
	touch $@

demo: $(VENV)/ready
	$(BIN)/python examples/demo.py

test: check test-kilted test-jazzy

check: $(VENV)/ready
	$(BIN)/black --check --quiet rosidl_adapter_proto tests examples benchmarks
	$(BIN)/ruff check --quiet .
	$(BIN)/mypy

test-kilted: $(VENV)/ready
	$(BIN)/python -m pytest

test-jazzy: $(JAZZY)/ready
	$(JAZZY)/bin/python -m pytest

benchmark: $(VENV)/ready
	$(BIN)/python benchmarks/generate.py

golden: $(VENV)/ready
	$(BIN)/python -m pytest tests/generate/test_golden.py --update-golden

format: $(VENV)/ready
	$(BIN)/black --quiet rosidl_adapter_proto tests examples benchmarks
	$(BIN)/ruff check --fix .

clean:
	rm -rf $(VENV) $(JAZZY) build dist generated
