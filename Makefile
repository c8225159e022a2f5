# Two commands on a fresh machine (python3 >= 3.11 and make):
#   make run    installs into .venv and runs the quick start models/clamped_panel
#   make test   installs the development tools and runs every check
STUDY ?= models/clamped_panel/study.toml
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	"$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && { echo "$$p"; break; }; done)
BIN := .venv/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: run test nightly lint quick bench clean

run: .venv/.installed
	@$(BIN)/romgen run $(STUDY)

# The whole pipeline on a coarse mesh with short ring-downs.
quick: .venv/.installed
	@$(BIN)/romgen run models/clamped_panel/reduced.toml

test: lint
	$(BIN)/pytest

# The long runs too: all platforms, large fuzz, and the quick start judged by its own limits.
nightly: lint
	$(BIN)/pytest -m "slow or not slow"
	$(BIN)/romgen run $(STUDY)
	$(BIN)/romgen validate $(STUDY)

lint: .venv/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: .venv/.installed-dev
	$(BIN)/python -m benchmarks

clean:
	rm -rf .venv runs

.venv/bin/python:
	@if [ -z "$(PYTHON)" ]; then \
		echo "romgen needs Python 3.11 or newer; found $$(python3 --version 2>/dev/null || echo no python3). Install one, or: make PYTHON=/path/to/python3.11 run"; \
		exit 1; fi
	@"$(PYTHON)" -m venv .venv || { \
		echo "$(PYTHON) cannot create a virtual environment; on Debian and Ubuntu: apt install python3-venv"; exit 1; }

.venv/.installed: pyproject.toml | .venv/bin/python
	@echo "installing romgen into .venv (once, a few minutes)"
	@$(PIP) --editable '.[fem,cross]'
	@touch $@

.venv/.installed-dev: pyproject.toml | .venv/bin/python
	@echo "installing romgen and its development tools into .venv (once, a few minutes)"
	@$(PIP) --editable '.[dev]'
	@touch .venv/.installed $@
