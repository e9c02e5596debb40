# Two commands do everything on a fresh machine: `make serve` and `make test`.
# Each target makes what it needs: the virtual environment, the dashboard, the Debian packages of the tests.

PYTHON ?= python3
HOST ?= 127.0.0.1
PORT ?= 8000
CAMERA ?= sim:mirrors
PAGE ?= all
SEED ?= 2
COUNT ?= 20

BIN := .venv/bin
# Distributions of their own, which extras name.
PACKAGES := $(foreach each,$(wildcard packages/*),--editable ./$(each))
BUILT_PAGE := server/transientcam_server/static/index.html
DASHBOARD := $(shell find client/dashboard -not -path '*/node_modules*' -type f -not -name '*.d.ts' 2>/dev/null)
# The last four, for tests that skip without them, recommended ones left out. Mesa has a software device of Vulkan.
DEBIAN_PACKAGES := umockdev libusb-1.0-0 usbutils chromium strace nginx-light caddy octave mesa-vulkan-drivers

CHECKS := check-pyright check-mypy check-style check-documents check-dashboard

# Every process would compile all modules anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help install serve test test-fast mutants check bench paper docs docs-site dist lock release clean dashboard debian-packages debian-package-names \
	check-pyright check-mypy check-style check-documents check-dashboard check-newest compiled-once

help:  ## Say what each target does
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 16

install: .venv/serve.stamp .venv/version.stamp dashboard  ## Install client, service and dashboard into .venv

serve: install  ## Run the daemon and its dashboard (PORT=8000 CAMERA=sim:mirrors)
	$(BIN)/transientcam serve --host $(HOST) --port $(PORT) --camera '$(CAMERA)'

# What waits for the network first, side by side; and then what computes.
test:  ## Run every check and every test
	@$(MAKE) --no-print-directory --jobs 3 .venv/test.stamp debian-packages client/dashboard/node_modules/.package-lock.json
	@$(MAKE) --no-print-directory .venv/version.stamp dashboard
	@$(MAKE) --no-print-directory --jobs 2 compiled-once $(CHECKS)
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

# The packages that are arithmetic, without a daemon, a browser, a compiler or a fuzzer.
test-fast: .venv/test.stamp  ## Run the tests of mathematics, wire format and planning's arithmetic, in a minute
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile \
		-m 'not daemon and not browser and not fuzz and not compiled and not sampled' \
		tests/moments tests/client/wire tests/server/planning/prediction tests/server/planning/search/test_pareto.py

check: .venv/test.stamp client/dashboard/node_modules/.package-lock.json  ## Lint, types, import laws
	@$(MAKE) --no-print-directory --jobs 2 $(CHECKS)

mutants: .venv/mutants.stamp  ## Draw random mutants that no test notices (SEED=2 COUNT=20 WHERE='wire lease')
	$(BIN)/python -m tests.mutants $(SEED) $(COUNT) $(WHERE)

bench: .venv/test.stamp  ## Measure speed, everything in one run on the same data
	$(BIN)/python -m benchmarks

paper: .venv/test.stamp  ## Make the paper's figures, beside what the paper says of them (docs/paper.md)
	$(BIN)/transientcam paper -o docs

docs: .venv/test.stamp dashboard  ## Measure anew, and write a page of docs/ (PAGE=plans) or all (hours)
	$(BIN)/python -m benchmarks $(PAGE) --write
	@if [ '$(PAGE)' = all ]; then $(BIN)/transientcam paper -o docs && $(BIN)/python -m tools.mathematics && \
		$(BIN)/python -m tools.examples --write && $(BIN)/python tools/documents.py --write; fi

docs-site: .venv/test.stamp  ## Write the documentation as a site: open build/site/index.html
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html docs build/site

# The time of the last commit stands for now, so that the same commit gives the same bytes. An unpacked
# sdist is no repository, or lies in another one: its files have that time.
EPOCH_S = $(shell git ls-files --error-unmatch Makefile >/dev/null 2>&1 && git log -1 --format=%ct || date -r pyproject.toml +%s)
dist: build/dist.stamp dashboard  ## Build the sdist and, from it, the wheel (dist/), with the sample data beside
	SOURCE_DATE_EPOCH=$${SOURCE_DATE_EPOCH:-$(EPOCH_S)} \
		build/dist/bin/python -m build --no-isolation --outdir dist && \
	for each in packages/*; do build/dist/bin/python -m build --no-isolation --wheel --outdir dist $$each; done
	cp examples/measurement.npz dist/transientcam-measurement.npz

# Every version and every hash of what is installed, for all platforms. uv's own lock names where packages
# come from, and is not kept: what is exported from it is.
EXPORT = build/lock/bin/uv --quiet export --frozen --no-dev --no-header --no-annotate --no-emit-workspace --format requirements-txt
lock:  ## Resolve pyproject.toml anew, to the newest of all, into requirements/
	$(PYTHON) -m venv build/lock && build/lock/bin/python -m pip install --quiet 'uv>=0.9'
	build/lock/bin/uv --quiet lock --upgrade
	$(EXPORT) --extra test --group build --output-file requirements/test.txt >/dev/null
	$(EXPORT) --extra server --extra conformance --extra opt8241 --extra cluster --extra plot \
		--output-file requirements/service.txt >/dev/null
	for each in build dist release; do $(EXPORT) --only-group $$each --output-file requirements/$$each.txt >/dev/null; done
	rm uv.lock

# What is released says what is in it, and of that nothing has a known weakness; both of the locked versions.
release: dist build/release.stamp  ## dist, with a bill of materials (CycloneDX) and a look for known weaknesses
	build/release/bin/python -m cyclonedx_py requirements --output-reproducible --of JSON \
		--output-file dist/transientcam.cdx.json requirements/service.txt
	build/release/bin/python -m pip_audit --disable-pip --require-hashes --requirement requirements/service.txt

# Small, and of its own: what builds needs nothing of what is built.
build/dist.stamp: requirements/build.txt requirements/dist.txt
	$(PYTHON) -m venv build/dist
	build/dist/bin/python $(LOCKED) --requirement requirements/build.txt --requirement requirements/dist.txt
	@touch $@

build/release.stamp: requirements/release.txt
	$(PYTHON) -m venv build/release
	build/release/bin/python -m pip install --quiet --require-hashes --no-deps --requirement requirements/release.txt
	@touch $@

clean:  ## Remove everything that was built or installed here
	rm -rf .venv build dist client/dashboard/node_modules $(dir $(BUILT_PAGE))
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# -- what the targets above stand on -----------------------------------------------------------

.venv/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "transientcam needs Python 3.11 or newer")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip

# The locks have all that is needed, and what builds: nothing is resolved or fetched beside them.
LOCKED := -m pip install --quiet --require-hashes --no-deps
OURS := -m pip install --quiet --no-deps --no-build-isolation --editable .

.venv/serve.stamp: pyproject.toml requirements/service.txt requirements/build.txt $(wildcard packages/*/pyproject.toml) | .venv/bin/python
	$(BIN)/python $(LOCKED) --requirement requirements/build.txt
	$(BIN)/python $(LOCKED) --requirement requirements/service.txt
	$(BIN)/python $(OURS) $(PACKAGES)
	@touch $@

# The client of the TOFcam660's vendor, which drives our emulation of it. What the tests use of it needs NumPy
# alone; its own requirements (OpenCV, Bluetooth, serial ports) are for its other cameras. And LeRobot, which makes
# the camera of examples/: that part of it needs draccus and no torch. It stands apart, as draccus has a package "tests".
.venv/test.stamp: pyproject.toml requirements/test.txt requirements/vendor.txt requirements/lerobot.txt $(wildcard packages/*/pyproject.toml) | .venv/bin/python
	$(BIN)/python $(LOCKED) --requirement requirements/test.txt
	$(BIN)/python $(LOCKED) --requirement requirements/vendor.txt
	$(BIN)/python $(LOCKED) --upgrade --target build/lerobot --requirement requirements/lerobot.txt
	$(BIN)/python $(OURS) $(PACKAGES)
	@touch $@ .venv/serve.stamp .venv/version.stamp

# For nothing else, and with much that nothing else needs.
.venv/mutants.stamp: .venv/test.stamp
	$(BIN)/python -m pip install --quiet 'cosmic-ray>=8.7'
	@touch $@

# What is installed here states the commit that it is of.
.venv/version.stamp: $(wildcard .git/logs/HEAD) | .venv/serve.stamp
	$(BIN)/python $(OURS)
	@touch $@

client/dashboard/node_modules/.package-lock.json: client/dashboard/package-lock.json
	npm --prefix client/dashboard ci --no-audit --no-fund
	@touch $@

# pyproject.toml bounds numba and uvicorn, since internals of both are used:
# - numba: config.CACHE_DIR, the event "numba:compile", and a dispatcher's compile and signatures
#   (transientcam_compiled/_cache.py); extending, cgutils, castgraph and typing.templates
#   (transientcam_moments/_kernels/simd.py, portable.py)
# - uvicorn: HttpToolsProtocol, WebSocketsSansIOProtocol (conn, queue, close_sent, read_paused), FlowControl
#   (transientcam_server/daemon/connections.py, streams.py); Server's signals and the clock of its loop (server.py)
# Where this passes with a newer one, the bound may be raised to it.
check-newest:  ## Test what uses internals of numba and uvicorn with the newest of both
	$(PYTHON) -m venv build/newest
	build/newest/bin/python -m pip install --quiet --upgrade --editable '.[test]'
	build/newest/bin/python -m pip install --quiet --upgrade numba 'uvicorn[standard]'
	build/newest/bin/python -m pip list | grep -E '^(numba|uvicorn) '
	build/newest/bin/python -m pytest --numprocesses auto --dist loadfile tests/compiled tests/moments/test_kernels*.py \
		tests/simulation/light/test_image_kernels.py tests/server/daemon tests/server/api/stream

# Once, before tests in several processes would each compile the same: the simulation's kernels, and every
# module of the tests, with their assertions rewritten.
compiled-once: .venv/test.stamp
	@mkdir -p build
	@$(BIN)/python -m pytest --collect-only --quiet >build/collected.txt || { cat build/collected.txt; exit 1; }

# Side by side, the slowest first.
check-pyright:
	$(BIN)/pyright

check-mypy:
	$(BIN)/mypy

check-style:
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports

# Of OpenAPI and AsyncAPI the types of both clients follow. Those of the page are written here: its check needs
# them, and its build does not.
check-documents:
	$(BIN)/python tools/documents.py

check-dashboard: check-documents
	npm --prefix client/dashboard run check
	npm --prefix client/dashboard test

# The daemon runs without its page where there is no Node; a test run does not.
dashboard:
	@if command -v npm >/dev/null; then $(MAKE) --no-print-directory $(BUILT_PAGE); \
	elif [ -e $(BUILT_PAGE) ]; then echo 'npm was not found: serving the dashboard as it was last built.'; \
	else echo 'npm was not found: the daemon runs without its dashboard. Install Node.js 20 or newer to get it.'; fi

$(BUILT_PAGE): $(DASHBOARD) client/dashboard/node_modules/.package-lock.json
	npm --prefix client/dashboard run build
	@touch $@

debian-package-names:
	@echo $(DEBIAN_PACKAGES)

debian-packages:
	@missing=$$(for p in $(DEBIAN_PACKAGES); do dpkg -s $$p >/dev/null 2>&1 || echo $$p; done); \
	if [ -z "$$missing" ]; then exit 0; fi; missing=$$(echo $$missing); \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
		apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends $$missing; \
	else echo "The tests need some Debian packages. Run:  sudo apt-get install --no-install-recommends $$missing" >&2; exit 1; fi
