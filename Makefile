# `make demo` and `make test` are the two commands; both set themselves up first.
PYTHON ?= python3
BIN := .venv/bin
# Matrices here are small: threads for them only get in each other's way.
export OPENBLAS_NUM_THREADS ?= 1
# Processes that run tests side by side.
WORKERS ?= auto
# How many examples Hypothesis tries in `make test-all`: full, drawn freely, or quick, always the same fifth.
PROFILE ?= full
# --known-skips fails unless what `make test-all` skips is what tests/skips.json lists.
SKIPS ?=
# Random cases of each search, and the seed that draws them.
CASES ?= 30
SEED ?= 0
SEARCH = --cases $(CASES) --seed $(SEED)
READY := .venv/.ready
DOCS_READY := .venv-docs/.ready
# The folders of the distributions: tvist-protocol, tvist-shaping, tvist-urscript and tvist.
DISTRIBUTIONS := ./protocol ./shaping ./urscript .
# The folders of what they install.
SOURCES := cli clients controller lab protocol ros2 shaping sim_plant testing tvist_server urscript view

.PHONY: acceptance checksums page docs docs-serve release setup demo notebooks test test-all durations lint elsewhere bench nightly search soak dist format lock schemas clean

setup: $(READY)

$(READY): requirements.lock pyproject.toml protocol/pyproject.toml shaping/pyproject.toml urscript/pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "tvist needs Python 3.11 or newer: make setup PYTHON=python3.12")'
	@echo "installing into .venv: about a minute"
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation $(addprefix --editable ,$(DISTRIBUTIONS))
	@echo "and its bytecode, as pip makes it for what is not a checkout"
	-$(BIN)/python -m compileall -q -j 0 $(SOURCES)
	@touch $@

demo: setup
	$(BIN)/tvist demo

notebooks: setup
	$(BIN)/marimo edit lab/notebooks

# Side by side: a process has all tests of a file, one has all that need the clock, and the longest begin first.
BESIDE := $(BIN)/pytest --numprocesses $(WORKERS) --dist loadgroup --no-loadscope-reorder

test: setup
	$(BESIDE) --hypothesis-profile quick --quick

test-all: setup
	$(BESIDE) --hypothesis-profile $(PROFILE) -m "not nightly" --durations 20 $(SEARCH) $(SKIPS)

# On a quiet machine: how long each test takes, which says what `make test` runs and what is beyond its budget.
durations: setup
	$(BESIDE) --hypothesis-profile quick -m "not nightly" --keep-durations

lint: setup
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.durations

# Calls that another system does not have: everything runs on macOS, and what a client needs on Windows, too.
elsewhere: setup
	$(BIN)/mypy --platform darwin --cache-dir .mypy_cache/darwin
	$(BIN)/mypy --platform win32 --cache-dir .mypy_cache/win32 $(addprefix --package ,tvist_client tvist_protocol tvist_shaping tvist_urscript)

bench: setup
	$(BIN)/python -m benchmarks

# The tests that take minutes each or need Podman or the site: under an hour in two processes.
nightly: setup elsewhere $(DOCS_READY)
	$(BESIDE) -m nightly --record-nightly --durations 20

# Random cases of all that is promised of stops, streams, changes and sequences of commands, over five arms in turn.
search: CASES = 100
search: setup
	$(BESIDE) -m search $(SEARCH)

# Those, and a search for hours of what `.ci/run` searches for two minutes.
soak: CASES = 2000
soak: nightly search

# The clients of other projects, and what docs/reference/ur-clients.md says of them. SOURCES and BUILD of UR's C++ library: see
# tests/acceptance/urcl.py, which needs root. ROS2: a Python with rclpy, as tests/acceptance/ros2.sh makes it.
URCL ?=
ROS2 ?=
acceptance: setup
	$(BIN)/pytest tests/acceptance/clients.py
ifneq ($(URCL),)
	$(PYTHON) tests/acceptance/urcl.py $(URCL) --tvist $(BIN)/tvist
	$(PYTHON) tests/acceptance/urcl.py $(URCL) --tvist $(BIN)/tvist --examples
endif
ifneq ($(ROS2),)
	$(ROS2) -m pytest tests/acceptance/ros2.py
endif

format: setup
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# The page of the view is in the repository, built; only who changes it needs Node.
page:
	cd view/page && npm ci --ignore-scripts --no-audit --no-fund && node build.mjs

# The site needs no package of tvist: it is made from the files. So its environment is a small one of its own.
# Only the pages of the commands are made by the program, in its own environment.
SITE := NO_MKDOCS_2_WARNING=1 .venv-docs/bin/python -m tools.site

$(DOCS_READY): docs/requirements.lock
	$(PYTHON) -m venv .venv-docs
	.venv-docs/bin/pip install --quiet --disable-pip-version-check --require-hashes -r docs/requirements.lock
	@touch $@

docs: setup $(DOCS_READY)
	$(SITE)

docs-serve: setup $(DOCS_READY)
	$(SITE) --serve

COMPILE := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes \
  --no-emit-index-url --no-annotate --no-header \
  --no-emit-package tvist-protocol --no-emit-package tvist-shaping --no-emit-package tvist-urscript

# The locks name versions and hashes, never where they come from.
lock:
	$(COMPILE) --extra dev -o requirements.lock pyproject.toml
	$(COMPILE) --extra server -c requirements.lock -o docker/requirements.lock pyproject.toml
	$(COMPILE) -o docs/requirements.lock docs/requirements.in
	echo hatchling | $(COMPILE) -c requirements.lock -o docker/build.lock -
	printf '%s\n' cmake nanobind ninja scikit-build-core | $(COMPILE) -o docker/ruckig-build.lock -

# Equal commits give equal files: what is in them is dated by the commit.
DIST ?= dist
dist: setup
	rm -rf $(DIST)
	for each in $(DISTRIBUTIONS); do \
	  (cd $$each && SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(CURDIR)/$(BIN)/hatchling build -d $(abspath $(DIST))) || exit 1; \
	done

checksums: dist
	cd dist && sha256sum * > SHA256SUMS

# `make release VERSION=X.Y.Z` writes versions and dates, as .bumpversion.toml says, commits and tags them.
release:
	$(PYTHON) -m venv .venv-release
	.venv-release/bin/pip install --quiet --disable-pip-version-check bump-my-version==1.8.1
	.venv-release/bin/bump-my-version bump --new-version $(VERSION)

schemas: setup
	$(BIN)/python -m tools.stubs
	$(BIN)/python -m tvist_protocol.generate
	$(BIN)/python -m tvist_server.gateways.metrics > docs/reference/generated/metrics.md

clean:
	rm -rf .venv .venv-docs .venv-release build dist .mypy_cache .ruff_cache .pytest_cache
