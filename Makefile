# Two commands do everything: `make dock` (install, then dock once) and `make test` (install, then test).
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(PYTHON) -m pip --python $(BIN)/python --disable-pip-version-check install --quiet --constraint constraints.txt
ARGS ?=
EXTRAS ?= test

.PHONY: dock test lint tools check format wheel clean

dock: $(BIN)/python
	rm -rf build
	$(PIP) .
	$(BIN)/auvdock dock conical --fidelity auto $(ARGS)

test: $(BIN)/python
	rm -rf build
	$(PIP) '.[$(EXTRAS)]'
	$(BIN)/pytest --numprocesses auto $(ARGS)

lint: tools
	$(MAKE) check

tools: $(BIN)/python
	$(PIP) --editable '.[dev]'

check:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

format:
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

wheel: $(BIN)/python
	rm -rf build dist
	$(PIP) build
	$(BIN)/python -m build

clean:
	rm -rf build dist .venv .lint *.egg-info

# --without-pip: Debian's Python has venv but not ensurepip; the outer pip installs into the environment.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "auvdock needs Python 3.11 or newer: make PYTHON=python3.12 ..."; exit 2; }
	$(PYTHON) -m venv --without-pip $(VENV)
