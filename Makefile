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

# More options of pytest, such as TESTS=tests/cli or TESTS=--passed=FILE (tests/campaign.py).
TESTS ?=

.PHONY: demo test test-all azurite campaign lint types examples benchmark studio check-page android docs docs-pages docs-serve
.PHONY: stale dist release lock clean

demo: $(VENV)/.base
	$(BIN)/vislam2tag demo demo-out

test: $(VENV)/.torch
	$(BIN)/python -m pytest -n 2 --dist worksteal $(TESTS)

# With the tests that take long on any machine.
test-all: $(VENV)/.torch azurite
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not campaign" $(TESTS)

# Azure's server of blobs for tests of az://, an npm package, once a machine; without npm those tests are skipped.
azurite:
	$(PYTHON) -m tests.azurite

# Hundreds of runs, outside CI: goes on where it was stopped. docs/results/how-good.md shows the last results.
campaign: $(VENV)/.torch
	$(BIN)/python -m pytest -n 2 --dist worksteal -m campaign --passed=campaign.jsonl
	$(BIN)/python benchmarks/fuzz_campaign.py

lint: $(VENV)/.installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.installed
	$(BIN)/mypy

examples: $(VENV)/.torch
	set -e; for example in examples/*.py; do echo "== $$example"; $(BIN)/python $$example; done

benchmark: $(VENV)/.installed
	$(BIN)/python benchmarks/speed.py process

# The page of `vislam2tag studio`, from studio/ into src/vislam2tag/studio/page (needs Node.js 18 or newer), of the lock
# file's versions: `npm ci` would also ask for the builds of Rollup for other systems, which not every registry has.
studio:
	cd studio && npm install --no-save --ignore-scripts --no-audit --no-fund --loglevel error
	cd studio && npm run --silent openapi && npm run --silent build && npm run --silent lint && npm run --silent types && npm run --silent test

# Builds the page, and fails if the commit has another one.
check-page: studio
	@different=$$(git status --porcelain -- src/vislam2tag/studio/page studio/src/api studio/package-lock.json); \
	[ -z "$$different" ] || { echo "the page in git is not what studio/ builds; run make studio and commit: $$different"; exit 1; }

# The documentation as a site in site/ (zensical.toml); a warning, such as a link that leads nowhere, is an error.
docs: $(VENV)/.installed
	$(BIN)/zensical build --clean --strict

# The pages that are made of the program: commands, settings, Python interface, findings, tutorials.
docs-pages: $(VENV)/.installed
	$(BIN)/python -m tests.docs.pages

docs-serve: $(VENV)/.installed
	$(BIN)/zensical serve

# Results in benchmarks/results whose code changed after they were measured; `make release` fails if there are any.
# `.venv/bin/python -m tests.docs.figures NAME` measures one again.
stale: $(VENV)/.installed
	-@$(BIN)/python -m tests.docs.figures --stale

# The phone app: fetches pinned inputs, builds, tests, signs and verifies it (docs/how-to/phone-app.md).
android:
	android/fetch.sh
	android/build.sh
	touch $(APP_IS_BUILT)

# The app again, if what it is made of is newer.
APP_IS_BUILT := android/out/.built
$(APP_IS_BUILT): $(shell git ls-files android 2>/dev/null)
	$(MAKE) android

# Wheel and source distribution, and the wheel of the documentation (extra docs).
dist: docs
	rm -rf dist
	$(BIN)/python -m build --quiet --no-isolation --outdir dist .
	$(BIN)/python -m build --quiet --no-isolation --wheel --outdir dist docs-wheel

# Each installs in an empty environment, and runs the demonstration from an empty folder; the source distribution without
# extras.
INSTALLS := install-wheel-with-extras install-sdist
.PHONY: $(INSTALLS)
install-wheel-with-extras: FILE = dist/vislam2tag-[0-9]*.whl
install-wheel-with-extras: EXTRAS = [all,docs]
install-sdist: FILE = dist/*.tar.gz
$(INSTALLS): dist
	@set -e; file="$$PWD/$$(echo $(FILE))$(EXTRAS)"; empty=$$(mktemp -d); trap 'rm -rf "$$empty"' EXIT; cd "$$empty"; \
	$(PYTHON) -m venv venv; venv/bin/pip install --quiet --no-compile --disable-pip-version-check --find-links "$(CURDIR)/dist" "$$file"; \
	venv/bin/vislam2tag demo demo-out >demo.txt; test -s demo-out/smoother/report.html; \
	if [ "$(EXTRAS)" ]; then test -s "$$(venv/bin/vislam2tag docs how-to/install --no-browser)"; fi; \
	echo "$$(basename "$$file") installs and runs: $$(venv/bin/vislam2tag --version)"

# All that a release has, in dist/ with SHA256SUMS: wheel, source distribution, this site, and the app, signed with this
# machine's debug key, if the machine has its tools (`make android` installs them on Debian 12, as root). Fails if figures
# are stale; CI, which is no release, makes it with STALE=list.
STALE ?= fail
release: dist docs $(INSTALLS)
	$(BIN)/python -m tests.docs.figures --stale || [ "$(STALE)" = list ]
	@set -e; version=$$($(BIN)/python -m hatchling version); cd site; \
	$(PYTHON) -m zipfile -c "../dist/vislam2tag-$$version-docs.zip" .
	@if [ -z "$$(android/fetch.sh missing)" ]; then $(MAKE) $(APP_IS_BUILT) && cp android/out/vislam2tag-debug.apk dist/; \
	else echo "dist/ has no app: this machine does not have the tools that make android needs"; fi
	cd dist && sha256sum *.* >SHA256SUMS && cat SHA256SUMS

$(VENV)/.base: pyproject.toml requirements-base.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --require-hashes -r requirements-base.lock
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

$(VENV)/.installed: $(VENV)/.base requirements.lock
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --require-hashes -r requirements.lock
	touch $@

$(VENV)/.torch: $(VENV)/.installed
	$(if $(TORCH),$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check $(TORCH))
	touch $@

# Remakes the lock files from pyproject.toml (needs uv: pip install uv); the base's versions are those of all.
LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --no-header
lock:
	$(LOCK) --group dev --extra all pyproject.toml requirements-build.in --output-file requirements.lock
	$(LOCK) --constraint requirements.lock pyproject.toml requirements-build.in --output-file requirements-base.lock

clean:
	rm -rf $(VENV) demo-out site .cache dist
