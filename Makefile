# The verbs are CI's. Each makes .venv on first use and installs what it needs; after that a call
# costs nothing until pyproject.toml or requirements.lock changes. Another Python: make PYTHON=...

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
NEWEST := build/newest
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq
PYTEST_ARGS ?= -n 2 --dist worksteal
GAITS ?=
# What the wheel is tried with: quick tests that need neither torch nor a browser.
WHEEL_TESTS := tests/gait tests/shift tests/sim/test_terrain*.py
# What the newest versions are tried with, without torch: these, and pictures and physics.
NEWEST_TESTS := $(WHEEL_TESTS) tests/show/test_plots.py tests/show/test_geometry.py tests/sim/test_world.py

# Stamps. "base" runs trained robots, "dev" trains and tests as well; dev contains base.
BASE := $(VENV)/.base-installed
DEV := $(VENV)/.dev-installed
STUBS := typings/.made

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help demo test test-all check wheel newest bench policies docs lock player clean

help: ## list what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(BASE) ## a robot shifts its gait by itself: out/demo (a light install, without torch)
	@$(BIN)/gaitshift demo --out out/demo --overwrite

test: $(DEV) ## run the tests but for the slow ones; PYTEST_ARGS="-k switching" for some of them
	@$(BIN)/python -m pytest -m 'not slow' $(PYTEST_ARGS)

test-all: $(DEV) ## run the slow tests as well: trainings, pages in a browser, the documentation
	@$(BIN)/python -m pytest $(PYTEST_ARGS)

check: $(DEV) $(STUBS) ## lint, format, types and floors
	@$(BIN)/ruff check --quiet
	@$(BIN)/ruff format --check --quiet
	@$(BIN)/basedpyright
	@$(BIN)/lint-imports --no-logo

wheel: $(DEV) ## build wheel and sdist, try the wheel on Python 3.11 to 3.13 and with old packages
	@$(BIN)/python tools/check_wheel.py $(WHEEL_TESTS)

newest: $(DEV) ## the newest versions that pyproject.toml allows, on some of the tests
	@$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(NEWEST)
	@$(BIN)/uv pip install --quiet --python $(NEWEST) --upgrade --editable '.[identify,view,test]'
	@echo 'newer than requirements.lock:'
	@$(BIN)/uv pip freeze --quiet --python $(NEWEST) --exclude-editable > $(NEWEST)/installed
	@sed 's/ *;.*//' requirements.lock | grep -vxFf - $(NEWEST)/installed || echo nothing
	@$(NEWEST)/bin/gaitshift demo --no-video --out $(NEWEST)/demo --overwrite >/dev/null
	@$(NEWEST)/bin/python -m pytest -n 2 --tb=line -rfE $(NEWEST_TESTS)

bench: $(DEV) ## speed of the environment and of training on this machine
	@$(BIN)/gaitshift bench

policies: $(DEV) ## train the shipped gaits anew by their records, and put them into the package
	@$(BIN)/python tools/make_policies.py $(GAITS)

docs: $(DEV) ## the documentation as a site: out/site/index.html
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet && echo out/site/index.html

lock: $(DEV) ## renew requirements.lock: the newest versions that pyproject.toml allows
	@$(BIN)/uv pip compile pyproject.toml --universal --python-version 3.11 --all-extras --upgrade \
	    --no-annotate --custom-compile-command 'make lock' --quiet --output-file requirements.lock

player: ## bundle the player of reports with three.js (needs npm); its result is committed
	@cd web && npm ci --silent --no-audit --no-fund && npm run --silent build

clean: ## remove what make made, but for .venv and runs/
	@rm -rf out build dist typings .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	@find src tests -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	    { echo 'gaitshift needs Python 3.11 or newer: make PYTHON=python3.12, for example' >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(BASE): pyproject.toml requirements.lock | $(BIN)/python
	@echo 'installing gaitshift into $(VENV) (once)'
	@$(PIP) install --constraint requirements.lock --editable .
	@touch $@

$(DEV): pyproject.toml requirements.lock | $(BIN)/python
	@echo 'installing gaitshift with training and tools into $(VENV) (once, some minutes)'
	@$(PIP) install --requirement requirements.lock
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $(BASE) $@

$(STUBS): $(DEV)
	@echo 'making type stubs of MuJoCo'
	@rm -rf typings/mujoco
	@$(BIN)/pybind11-stubgen mujoco --output-dir typings --ignore-all-errors 2>/dev/null
	@touch $@
