# stickslip. Everything runs in the virtual environment .venv, which is made when it is missing or out of date.

PYTHON ?= python3
BIN := .venv/bin
# Python writes the bytecode of what is imported, most of it while the kernels are compiled: pip would compile
# fifteen thousand modules, of which two thousand are ever imported.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
# The packages of some parts, of files whose digests stand there alone.
PINNED = $(PIP) --require-hashes $(1:%=-r requirements/%.txt)
PACKAGES := .venv/.packages
STAMP := .venv/.up-to-date
DEV := .venv/.for-development
# What pytest gets in addition, for example: make test PYTEST="-k march -x"
PYTEST ?=
# Which part of the long tests, such as 3/10, the third tenth of each.
PART ?= 1/1
# With COSTS=1 `make test-all` writes what each test costs to tests/costs.json, which says what `make test` runs.
COSTS ?=
# With TIER=rest it runs what `make test` leaves.
TIER ?= all
# Which benchmarks: all when empty; `python -m benchmarks --help` lists them.
BENCH ?=
.DEFAULT_GOAL := help
.PHONY: help setup dev demo test test-all test-long style lint bench docs pins sbom serve clean

help:
	@echo "make setup      set up .venv; the command is then $(BIN)/stickslip"
	@echo "make dev        add to it what tests, checks, benchmarks and the reference need"
	@echo "make demo       run the main job end to end; pictures go to demo-output/"
	@echo "make test       run the cheap tests, one case of each: every claim once, a few minutes"
	@echo "make test-all   check the types too and run every test but the long ones: a quarter of an hour"
	@echo "make test-long  run the long studies, ten hours of them; a tenth of each: make test-long PART=3/10"
	@echo "make lint       check the code: ruff, mypy, import-linter"
	@echo "make bench      measure the solver and print tables; some of them: make bench BENCH='case-a chains'"
	@echo "make docs       build the documentation site, reference and gallery too; it goes to site/"
	@echo "make pins       renew the digests in requirements/, after a version there was changed"
	@echo "make sbom       list what an installation consists of, as CycloneDX, in sbom.cdx.json"
	@echo "make serve      start the service on http://127.0.0.1:8000"
	@echo "make clean      remove .venv, caches and demo-output/"

setup: $(STAMP)

# The first kernels are compiled beside, from when they can be, and nobody waits for them here: what fails of it
# fails again, and is told, where they are needed. What is imported meanwhile is kept as bytecode, whatever
# PYTHONDONTWRITEBYTECODE says: else every process takes a second longer to start.
$(PACKAGES): pyproject.toml $(wildcard requirements/*.txt)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "stickslip needs Python 3.11 or newer, as in: make $(MAKECMDGOALS) PYTHON=python3.12" >&2; exit 1; }
	$(PYTHON) -m venv .venv
	$(call PINNED,kernels)
	@echo "Installing the other packages; the kernels of a first design are compiled beside."
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m service.warm_up --first </dev/null >/dev/null 2>&1 & kernels=$$!; \
	  $(call PINNED,package) || { kill $$kernels; exit 1; }
	$(PIP) --no-deps --no-build-isolation -e .
	@touch $@

$(STAMP): $(PACKAGES)
	@echo "Compiling the other kernels on all cores: half a minute on two, once."
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m service.warm_up
	@touch $@

dev: $(DEV)

$(DEV): $(PACKAGES)
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m service.warm_up & kernels=$$!; \
	  $(call PINNED,image dev) || { kill $$kernels; exit 1; }; \
	  wait $$kernels
	@touch $(STAMP) $@

# Its first optimum waits for no compiler; what it does not call is compiled by whoever needs it first.
demo: $(PACKAGES)
	PYTHONDONTWRITEBYTECODE= $(BIN)/stickslip demo

# The kernels are compiled before, so that not every process does it. Three processes for two cores: tests of the
# service also wait, and a process computes for little more than half of its time. A file is of one of them, in
# the order of the folders: services first, at the end what is short.
# They may write bytecode: what is read again by hundreds of processes, and the tests themselves.
TESTS := PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n 3 --dist loadscope --no-loadscope-reorder

test: style
	$(BIN)/python -m service.warm_up
	$(TESTS) --tier quick $(PYTEST)

# Types are checked meanwhile: mypy keeps one core busy for most of a minute.
test-all: style
	$(BIN)/python -m service.warm_up
	$(BIN)/mypy & types=$$!; \
	  $(TESTS) --tier $(TIER) $(if $(COSTS),--costs) $(PYTEST); tests=$$?; \
	  wait $$types && exit $$tests

test-long: dev
	$(BIN)/python -m pytest -m long --part $(PART) $(PYTEST)

style: dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/lint-imports

lint: style
	$(BIN)/mypy

bench: dev
	$(BIN)/python -m benchmarks $(BENCH)

docs: dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# Of all files of a version, for any system and any Python: which one is installed is another machine's affair.
pins: dev
	for file in requirements/*.txt; do \
	  $(BIN)/uv pip compile $$file --output-file .venv/pins --generate-hashes --no-deps --universal \
	    --python-version 3.12 --no-header --no-annotate --quiet && mv .venv/pins $$file || exit 1; \
	done

sbom: setup
	$(BIN)/python deploy/sbom.py > sbom.cdx.json

serve: setup
	$(BIN)/stickslip serve

clean:
	rm -rf .venv demo-output sbom.cdx.json site build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find stickslip solver optim service migrations tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
