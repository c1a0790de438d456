# Everything runs in .venv, made on first use from the lock file.
PYTHON ?= python3
# Networks need PyTorch: locked here, not with the rest, as each machine has its own build of it. `make test TORCH=` does
# without; tests of networks are then skipped.
TORCH ?= torch==2.13.0
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test lint types examples benchmark android lock clean

demo: $(VENV)/.installed
	$(BIN)/vislam2tag demo demo-out

test: $(VENV)/.torch
	$(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(VENV)/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed
	$(BIN)/mypy

examples: $(VENV)/.installed
	set -e; for example in examples/*.py; do echo "== $$example"; $(BIN)/python $$example; done

benchmark: $(VENV)/.installed
	$(BIN)/python benchmarks/process_speed.py

# The phone app: fetches pinned inputs, builds, tests, signs and verifies it (docs/android.md).
android:
	android/fetch.sh
	android/build.sh

$(VENV)/.installed: pyproject.toml requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/.torch: $(VENV)/.installed
	$(if $(TORCH),$(BIN)/python -m pip install --quiet --disable-pip-version-check $(TORCH))
	touch $@

# Remakes the lock file from pyproject.toml (needs uv: pip install uv).
lock:
	uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header \
		--group dev pyproject.toml requirements-build.in --output-file requirements.lock

clean:
	rm -rf $(VENV) demo-out
