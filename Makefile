# Everything runs in .venv, made on first use: `make demo` installs what the demo needs (requirements-base.lock), all
# else adds the extras and the tools of development (requirements.lock).
PYTHON ?= python3
# Networks need PyTorch: locked here, not with the rest, as each machine has its own build of it. `make test TORCH=` does
# without; tests of networks are then skipped.
TORCH ?= torch==2.13.0
# Compiled modules are kept, whatever the environment says: tests start hundreds of processes.
export PYTHONDONTWRITEBYTECODE :=
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test test-all azurite campaign lint types examples benchmark studio android docs docs-pages docs-serve lock clean

demo: $(VENV)/.base
	$(BIN)/vislam2tag demo demo-out

test: $(VENV)/.torch
	$(BIN)/python -m pytest -n 2 --dist worksteal

# With the tests that take long on any machine.
test-all: $(VENV)/.torch azurite
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not campaign"

# Azure's server of blobs for tests of az://, an npm package, once a machine; without npm those tests are skipped.
azurite:
	$(PYTHON) -m tests.azurite

# Hundreds of runs, outside CI: goes on where it was stopped. docs/results/campaign.md and docs/results/hostile_input.md hold results with date and commit.
campaign: $(VENV)/.torch
	$(BIN)/python -m pytest -n 2 --dist worksteal -m campaign --campaign campaign.jsonl
	$(BIN)/python benchmarks/fuzz_campaign.py

lint: $(VENV)/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed
	$(BIN)/mypy

examples: $(VENV)/.torch
	set -e; for example in examples/*.py; do echo "== $$example"; $(BIN)/python $$example; done

benchmark: $(VENV)/.installed
	$(BIN)/python benchmarks/process_speed.py

# The page of `vislam2tag studio`, from studio/ into src/vislam2tag/studio/page (needs Node.js 18 or newer), of the lock
# file's versions: `npm ci` would also ask for the builds of Rollup for other systems, which not every registry has.
studio:
	cd studio && npm install --no-save --ignore-scripts --no-audit --no-fund --loglevel error
	cd studio && npm run --silent openapi && npm run --silent build && npm run --silent lint && npm run --silent types && npm run --silent test

# The documentation as a site in site/ (zensical.toml); a warning, such as a link that leads nowhere, is an error.
docs: $(VENV)/.installed
	$(BIN)/zensical build --clean --strict

# The pages that are made of the program: commands, settings, Python interface, findings, first mistakes, tutorials.
docs-pages: $(VENV)/.installed
	$(BIN)/python -m tests.docs.pages

docs-serve: $(VENV)/.installed
	$(BIN)/zensical serve

# The phone app: fetches pinned inputs, builds, tests, signs and verifies it (docs/how-to/android.md).
android:
	android/fetch.sh
	android/build.sh

$(VENV)/.base: pyproject.toml requirements-base.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-base.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/.installed: $(VENV)/.base requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	touch $@

$(VENV)/.torch: $(VENV)/.installed
	$(if $(TORCH),$(BIN)/python -m pip install --quiet --disable-pip-version-check $(TORCH))
	touch $@

# Remakes the lock files from pyproject.toml (needs uv: pip install uv); the base's versions are those of all.
LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header
lock:
	$(LOCK) --group dev --extra all pyproject.toml requirements-build.in --output-file requirements.lock
	$(LOCK) --constraint requirements.lock pyproject.toml requirements-build.in --output-file requirements-base.lock

clean:
	rm -rf $(VENV) demo-out site .cache
