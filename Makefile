# Set-up, checks and evaluation. `make help` lists the targets.
# Everything is installed into $(VENV), with the versions of constraints.txt.
# There are no hashes in it: pip demands one of every requirement then, and has none of a folder or of
# `-e .`, so the two commands could not install this package itself (--require-hashes refuses it).

PYTHON ?= python3
VENV ?= .venv
OUT ?= results
WORKERS ?= 2

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt
PACKAGES := envs baselines train evaluation realtime cli
CHECKED := $(PACKAGES) tests benchmarks examples
TYPES := build/types

# Stamps: a target that finds its stamp newer than the requirements installs nothing.
BASE := $(VENV)/.installed-base
DEV := $(VENV)/.installed-dev
DOCS := $(VENV)/.installed-docs

# Tests start many processes: the first compiles what the others import.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.NOTPARALLEL:
.DELETE_ON_ERROR:
.PHONY: help evaluate paper test test-fast coverage lint types unit format bench docs docs-serve audit wheel constraints clean distclean

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo "  PYTHON=python3.12 chooses the interpreter of a new $(VENV), OUT=DIR where results go."

evaluate: $(BASE) ## All maneuvers with the default policies, and the paper's cases: tables and reports
	@$(BIN)/motion-cueing evaluate --out $(OUT)
	@$(BIN)/motion-cueing paper --out $(OUT)/paper

paper: $(BASE) ## Reproduce the paper's six cases, with a pass or a fail for each number
	@$(BIN)/motion-cueing paper --out $(OUT)/paper

test: lint types unit ## Lint, check types and run the tests

lint: $(DEV) ## Ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# The last NumPy for Python 3.10 has other types: one set of annotations cannot be right for both.
types: $(DEV) $(TYPES)/motion_cueing ## mypy, strict; with Python 3.11 or newer
	@if $(BIN)/python -c 'import sys; sys.exit(sys.version_info < (3, 11))'; \
	then set -x; MYPYPATH=$(TYPES) $(BIN)/mypy --namespace-packages $(PACKAGES:%=-p motion_cueing.%); \
	else echo "Types are not checked with Python 3.10"; fi

# `worksteal` leaves the tests of a file with one worker where it can: fixtures of a module are built once.
# Workers that meet a cold cache each compile into a folder of their own; Warp keeps the first.
unit: $(DEV) ## The tests alone
	$(BIN)/pytest -n $(WORKERS) --dist worksteal

test-fast: $(DEV) ## The tests that take no seconds each, for work in between
	$(BIN)/pytest -n $(WORKERS) --dist worksteal -m "not slow"

coverage: $(DEV) ## Branch coverage by package, measured over all tests
	$(BIN)/pytest -n $(WORKERS) --dist worksteal --cov --cov-report=term:skip-covered

format: $(DEV) ## Format the code and mend what ruff can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(DEV) ## Measure speed; see docs/results/performance.md
	$(BIN)/python -m benchmarks.report

docs: $(DOCS) $(TYPES)/motion_cueing ## Build the documentation into build/site; a broken link or reference is a failure
	@PYTHONPATH=$(TYPES) $(BIN)/python docs/generate.py
	@PYTHONPATH= $(BIN)/zensical build --strict --clean

docs-serve: $(DOCS) $(TYPES)/motion_cueing ## Show the documentation at http://localhost:8000, and again at every change
	@PYTHONPATH=$(TYPES) $(BIN)/python docs/generate.py
	@PYTHONPATH= $(BIN)/zensical serve

# The audit's tool lives apart, so that what it needs is not among what it looks at.
audit: ## Look up known vulnerabilities of constraints.txt, and write build/sbom.json (CycloneDX)
	@mkdir -p build
	@test -x build/audit/bin/pip-audit || { $(PYTHON) -m venv build/audit && \
		build/audit/bin/python -m pip install -qq --disable-pip-version-check pip-audit; }
	build/audit/bin/pip-audit --requirement constraints.txt --no-deps --disable-pip \
		--format cyclonedx-json --output build/sbom.json

# Dates in the wheel are those of the last commit, so whoever builds it gets the same bytes.
wheel: $(DEV) ## Build the wheel twice into dist, and compare the two
	@rm -rf dist build/wheel build/again && mkdir -p build
	@for folder in dist build/again; do \
		rm -rf build/source && mkdir -p build/source && git archive HEAD | tar x -C build/source && \
		SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(BIN)/python -m pip wheel -qq --no-deps \
			--disable-pip-version-check --wheel-dir $$folder ./build/source || exit 1; done
	@cmp dist/*.whl build/again/*.whl && sha256sum dist/*.whl

constraints: $(DEV) ## Rewrite constraints.txt for the requirements in pyproject.toml; UPGRADE=1 for newer versions
	$(BIN)/python -m pip install -qq --disable-pip-version-check uv
	$(BIN)/uv pip compile --quiet --universal --python-version 3.10 --all-extras --no-annotate \
		--custom-compile-command "make constraints" $(if $(UPGRADE),--upgrade) \
		--output-file constraints.txt pyproject.toml

clean: ## Remove results and caches
	rm -rf $(OUT) build dist *.egg-info .benchmarks .hypothesis .mypy_cache .pytest_cache .ruff_cache docs/tutorials/*.ipynb

distclean: clean ## The same, and the virtual environment
	rm -rf $(VENV)

# Type checkers see the folders under their installed names through this link.
$(TYPES)/motion_cueing:
	@mkdir -p $(TYPES)
	@ln -sfn ../.. $@

$(BIN)/python:
	@command -v $(PYTHON) > /dev/null || { echo "make: $(PYTHON) not found; name a Python 3.10 or newer with PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
		{ echo "make: $$($(PYTHON) --version) is too old; name a Python 3.10 or newer with PYTHON=..." >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2> /dev/null || \
		{ echo "make: $(PYTHON) has no venv module; install it (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1; }
	@echo "Making $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv $(VENV)

$(BASE): pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing into $(VENV)"
	@$(PIP) -e '.[optimal]'
	@touch $@

$(DEV): pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing into $(VENV), with the tools of development"
	@$(PIP) -e '.[dev,train]'
	@touch $(BASE) $@

$(DOCS): pyproject.toml constraints.txt | $(BIN)/python
	@$(BIN)/python -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "make: the documentation's tools need Python 3.11 or newer; name one with PYTHON=... VENV=..." >&2; exit 1; }
	@echo "Installing into $(VENV), with the tools of the documentation"
	@$(PIP) -e '.[docs,optimal,train]'
	@touch $@
