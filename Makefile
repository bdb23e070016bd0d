# Every target sets up what it needs by itself: Python 3.11 or newer, make and a network are enough.

PYTHON ?= $(shell command -v python3 || command -v python3.13 || command -v python3.12 || command -v python3.11 || command -v python)
UV := $(or $(shell command -v uv 2>/dev/null),.tools/bin/uv)
BIN := .venv/bin
WORKERS ?= 2

# An installed interpreter is taken where one is new enough; uv fetches one only where there is none.
export UV_PYTHON_PREFERENCE ?= system
export NO_MKDOCS_2_WARNING = 1
export PYRIGHT_PYTHON_IGNORE_WARNINGS = 1
unexport VIRTUAL_ENV

# $(call stage,NAME,COMMAND): run COMMAND and print how long it took.
stage = @echo "== $(1)"; start=$$(date +%s); $(2) || { echo "== $(1): FAILED" >&2; exit 1; }; \
	echo "== $(1): $$(( $$(date +%s) - start )) s"

.DEFAULT_GOAL := help
.PHONY: help demo test lint types tests docs serve format setup clean

help: ## show this list
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{ printf "%-15s %s\n", $$1, $$2 }'

demo: .venv/.ready-to-run ## watch a humanoid's arm learn to reach
	$(BIN)/toddle reach nicu

test: lint ## everything that must hold: format, lint, types, tests, examples, docs
	@$(MAKE) --no-print-directory -j2 tests types docs

lint: .venv/.ready-to-develop ## check the format and the rules
	$(call stage,format,$(BIN)/ruff format --check --quiet .)
	$(call stage,lint,$(BIN)/ruff check --quiet .)

types: .venv/.ready-to-develop ## check the types
	$(call stage,types,$(BIN)/pyright)

tests: .venv/.ready-to-develop ## run the tests and the examples
	$(call stage,tests,$(BIN)/pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder --durations=10)

docs: .venv/.ready-to-develop ## build the documentation into site/
	$(call stage,docs,$(BIN)/mkdocs build --strict --quiet)

serve: .venv/.ready-to-develop ## show the documentation at http://127.0.0.1:8000
	$(BIN)/mkdocs serve

format: .venv/.ready-to-develop ## rewrite the files in the project's format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

setup: .venv/.ready-to-develop ## only set up

clean: ## remove everything that can be made again
	rm -rf .venv .tools .cache site dist .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/.ready-to-run: pyproject.toml uv.lock | $(UV)
	$(call stage,set-up,$(UV) sync --frozen --inexact --no-default-groups --quiet)
	@touch $@

.venv/.ready-to-develop: pyproject.toml uv.lock | $(UV)
	$(call stage,set-up,$(UV) sync --frozen --all-groups --all-extras --quiet)
	@touch $@ .venv/.ready-to-run

.tools/bin/uv:
	@test -n "$(PYTHON)" || { echo "no Python found: install Python 3.11 or newer" >&2; exit 1; }
	$(call stage,uv,$(PYTHON) scripts/get_uv.py .tools)
