# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
# `make help` lists what there is to do. Every target sets up what it needs first.

VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/.stamps
OUT ?= demo

# The newest supported Python on the path, else whichever there is, for the check to name it.
SUPPORTED = import sys; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 12)))
PYTHON ?= $(or $(shell for python in python3.12 python3.11 python3 python; do \
	$$python -c '$(SUPPORTED)' >/dev/null 2>&1 && echo $$python && break; done),python3)

# Recordings of real machines; the tests that need them are skipped without.
ARMID_DATA ?= $(abspath $(wildcard ../shared/data))
export ARMID_DATA

# Only what is in the environment counts, whatever ROS the shell has sourced.
export AMENT_PREFIX_PATH := $(abspath $(VENV))
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport CMAKE_PREFIX_PATH PYTHONPATH PYTHONHOME _ROS_WHEELS_BOOTSTRAP_COMPLETE
ifdef ROS_DISTRO
unexport LD_LIBRARY_PATH
endif

PIP := $(BIN)/python -m pip install -qq
# The lock is complete; resolving anew, pip takes the newest of what is asked for with an extra.
LOCKED := $(PIP) --require-hashes --no-deps --no-build-isolation
TREE := $(shell find armid_ros scripts launch config resource -name __pycache__ -prune \
	-o -print 2>/dev/null)
MESSAGES := $(shell find msg_schemas -name __pycache__ -prune -o -type f -print)
INTERFACES := $(shell find tests/interfaces -type f 2>/dev/null)

.DEFAULT_GOAL := all
.PHONY: all armid-bench demo test test-fast test-long numeric docs fuzz chaos golden coverage lint bench benchmark lock clean help check
.DELETE_ON_ERROR:
.NOTPARALLEL:

all: $(STAMPS)/armid_ros $(VENV)/setup.bash  ## set up .venv: ROS 2, armid_msgs, armid_ros
	@echo 'armid_ros is in $(VENV); to use it in a shell:  . $(VENV)/setup.bash'

demo: $(STAMPS)/armid_ros $(VENV)/setup.bash  ## identify the shipped arm on the moon, from excitation to figures in OUT
	$(BIN)/armid demo --out $(OUT)

# A test that waits for ever is ended, and shows where; a worker that cannot be ended ends all.
LONGEST ?= 4200
THREADS ?= 1
RUN_TESTS = OMP_NUM_THREADS=$(THREADS) OPENBLAS_NUM_THREADS=$(THREADS) $(BIN)/pytest \
	--durations=15 --numprocesses=auto --dist=loadfile --max-worker-restart=2 \
	-o faulthandler_timeout=600 -o faulthandler_exit_on_timeout=true

test: lint  ## lint, types, layers, and every test that has to pass: what CI runs
	ARMID_FUZZ=100 timeout --kill-after=30 $(LONGEST) env $(RUN_TESTS) -m 'not long' $(PYTEST)

test-fast: lint  ## while you work: lint, types, layers, and the tests that a change usually breaks
	ARMID_FUZZ=50 $(RUN_TESTS) -m 'not slow and not long and not real_data' $(PYTEST)

# Numbers agree to their tolerances whichever kernel of the BLAS the processor gets, in any order.
has = $(shell grep -qsw $(1) /proc/cpuinfo && echo $(2))
KERNELS ?= $(call has,avx,Sandybridge) $(call has,avx2,Haswell Zen) $(call has,avx512bw,SkylakeX)
NUMERIC ?= $(addprefix tests/,arm diagnosis effects identification model papers/elastic simulation)
SEED := $(or $(SEED),$(shell od -An -N2 -tu2 /dev/urandom | tr -d ' '))
KERNEL_TESTS := $(foreach kernel,$(KERNELS),numeric-$(kernel)-1 numeric-$(kernel)-2)
THIS_PYTHON = $(shell $(BIN)/python -c 'import sys; print(f"python3.{sys.version_info[1]}")')
OTHER_PYTHONS ?= $(foreach python,$(filter-out $(THIS_PYTHON),python3.11 python3.12),$(shell \
	$(python) -c '' 2>/dev/null && echo $(python)))

numeric-%: $(STAMPS)/armid_ros $(STAMPS)/test
	OPENBLAS_CORETYPE=$(firstword $(subst -, ,$*)) $(MAKE) --no-print-directory \
		THREADS=$(lastword $(subst -, ,$*)) numeric

numeric: $(STAMPS)/armid_ros $(STAMPS)/test
	$(RUN_TESTS) -m 'not long' --seed $(SEED) $(NUMERIC) $(PYTEST)

test-long: test $(KERNEL_TESTS) fuzz chaos  ## all: whole sets, fuzz, chaos, each kernel, Python and a random order; hours (make -k goes on)
	$(RUN_TESTS) -m long --seed $(SEED) $(PYTEST)
	set -e; for python in $(OTHER_PYTHONS); do \
		$(MAKE) VENV=.venv-$$(basename $$python) PYTHON=$$python numeric; done

docs: $(STAMPS)/armid_ros $(STAMPS)/test  ## the documentation site, in build/site; notebooks are executed
	NO_MKDOCS_2_WARNING=1 OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m mkdocs build
	@echo 'open build/site/index.html; to search it:  python3 -m http.server --directory build/site'

fuzz: $(STAMPS)/armid_ros $(STAMPS)/test  ## read 10,000 damaged files of every kind, and keep what fails in tests/fuzz/failures
	ARMID_FUZZ=$(or $(FUZZ),10000) OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest \
		--numprocesses=0 tests/fuzz $(PYTEST)

golden: $(STAMPS)/armid_ros $(STAMPS)/test  ## write the answers of every command anew; git diff tests/golden shows what changed
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.golden $(CASES)

coverage: override PYTEST += --cov=armid_ros --cov-report=term
coverage: test  ## test, and which lines the tests run; takes half as long again

lint: $(STAMPS)/armid_ros $(STAMPS)/test  ## format, lint, layers, words, types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	$(BIN)/pytest -q tests/docsite/test_words.py
	$(BIN)/mypy

bench: $(STAMPS)/armid_ros $(STAMPS)/bench  ## speed and accuracy, side by side with the peers
	$(BIN)/python -m benchmarks $(BENCH)

SITE = $(shell $(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
armid-bench: $(STAMPS)/armid_ros $(STAMPS)/bench  ## add the command `armid bench`: a public benchmark of diagnosis, and its peers
	echo '$(CURDIR)' >$(SITE)/armid_bench.pth

benchmark: $(STAMPS)/armid_ros $(STAMPS)/test  ## name the effects hidden in the locked set, about 30 min
	$(BIN)/python -m benchmarks.hidden_effects locked

# make lock UPGRADE=1 takes the newest of everything; without, what is locked stays if it can.
UV = $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
	--generate-hashes --no-emit-index-url --no-emit-find-links \
	--custom-compile-command 'make lock'
lock: $(STAMPS)/test  ## pin the requirements anew, with hashes, for Python 3.11 and 3.12
	cd requirements && ../$(UV) $(if $(UPGRADE),--upgrade) bench.in -o bench.txt
	cd requirements && ../$(UV) -c bench.txt test.in -o test.txt
	cd requirements && ../$(UV) -c bench.txt run.in ros.in -o run.txt
	cd requirements && ../$(UV) -c bench.txt build.in -o build.txt
	sed -nE 's/^([a-z][^ ]*==[^;\\]*[^ ;\\])( ;[^\\]*[^ \\])? *\\$$/\1\2/p' requirements/bench.txt >requirements/constraints.txt

chaos: $(STAMPS)/armid_ros $(STAMPS)/test  ## 100 random schedules of events around the identifier
	ARMID_CHAOS=100 $(BIN)/pytest tests/ros/test_chaos.py

clean:  ## remove the environment and everything built
	rm -rf $(VENV) .venv-* build install log dist *.egg-info .coverage .coverage.* .mypy_cache \
		.ruff_cache .pytest_cache .import_linter_cache

help:
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-11s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

CHECK = command -v $(firstword $(PYTHON)) >/dev/null || { echo 'armid_ros: there is no' \
	'$(PYTHON): Python 3.11 or 3.12 is needed, as in `make PYTHON=/path/to/python3.12`' >&2; \
	exit 1; }; VENV=$(VENV) $(PYTHON) requirements/check_host.py

check:
	@$(CHECK)

# A Python that was asked for is checked even where the environment exists already.
$(STAMPS)/venv: | $(if $(filter file,$(origin PYTHON)),,check)
	@$(CHECK)
	$(PYTHON) -m venv $(VENV)
	@mkdir -p $(STAMPS)
	@touch $@

$(STAMPS)/run: requirements/run.txt requirements/build.txt $(STAMPS)/venv
	@echo 'installing ROS 2 Jazzy and the libraries (a minute or two, once)'
	$(PIP) --require-hashes -r requirements/build.txt
	$(LOCKED) -r requirements/run.txt
	@touch $@

$(STAMPS)/test: requirements/test.txt $(STAMPS)/run $(STAMPS)/control_msgs
	$(LOCKED) -r $<
	@touch $@

$(STAMPS)/bench: requirements/bench.txt $(STAMPS)/run
	$(LOCKED) -r $<
	@touch $@

$(STAMPS)/armid_msgs: $(MESSAGES) $(STAMPS)/run
	@echo 'compiling armid_msgs'
	$(PIP) --no-deps --no-build-isolation --force-reinstall ./msg_schemas
	@touch $@

# On a robot's computer this comes with ros2_control; there is no wheel of it.
$(STAMPS)/control_msgs: $(INTERFACES) msg_schemas/present_directories.cmake $(STAMPS)/run
	@echo 'compiling control_msgs for the tests'
	PATH='$(abspath $(BIN)):'"$$PATH" cmake --log-level=WARNING -S tests/interfaces \
		-B $(VENV)/build/control_msgs -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF -DCMAKE_INSTALL_MESSAGE=NEVER \
		-DCMAKE_INSTALL_PREFIX='$(abspath $(VENV))' -DCMAKE_PREFIX_PATH='$(abspath $(VENV))' \
		-DPython3_EXECUTABLE='$(abspath $(BIN))/python'
	PATH='$(abspath $(BIN)):'"$$PATH" cmake --build $(VENV)/build/control_msgs --target install -- --quiet
	@touch $@

# Not editable, for pip then leaves out the files that ROS 2 looks for. What a build left behind
# would be installed again, files that are gone included.
$(STAMPS)/armid_ros: $(TREE) setup.py setup.cfg package.xml $(wildcard requirements/*.in) $(STAMPS)/armid_msgs
	@rm -rf build/lib build/lib.* build/bdist.*
	$(PIP) --no-deps --no-build-isolation --force-reinstall .
	$(BIN)/python setup.py -q build_ext --inplace  # for what runs in this tree, the tests
	@touch $@

define SETUP_BASH
# Source this to use armid_ros and its ROS 2 in a shell.
. '$(abspath $(BIN))/activate'
export AMENT_PREFIX_PATH='$(abspath $(VENV))'$${AMENT_PREFIX_PATH:+":$$AMENT_PREFIX_PATH"}
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3
endef

$(VENV)/setup.bash: Makefile $(STAMPS)/venv
	$(file >$@,$(SETUP_BASH))@:
