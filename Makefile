# Two commands do everything, set-up included:  make demo  and  make test

PYTHON ?=
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.set-up

.PHONY: help setup demo test lint types import-rules pytest format bench lock clean

help:
	@echo "make demo     press a ball into a GelSight Mini and write the picture and a report"
	@echo "make test     lint, types, import rules and tests"
	@echo "make bench    measure speed and accuracy (minutes)"
	@echo "make setup    only the set-up: .venv and the libLLVM the renderer needs"
	@echo "make format   let ruff tidy the code"
	@echo "make lock     resolve the dependencies anew into requirements.lock"
	@echo "make clean    remove .venv, caches and the demo's output"

setup: $(STAMP)

$(STAMP): pyproject.toml requirements.lock scripts/setup.sh
	@PYTHON="$(PYTHON)" sh scripts/setup.sh

demo: setup
	@$(BIN)/optisense render gelsight-mini --contact sphere:1.5@0,0:0.8 --out demo-output

test: lint types import-rules pytest

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

import-rules: setup
	$(BIN)/lint-imports

pytest: setup types lint import-rules
	$(BIN)/python -m pytest

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: setup
	$(BIN)/python -m benchmarks

lock:
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 \
	    --generate-hashes --no-emit-index-url --upgrade --output-file requirements.lock

clean:
	rm -rf $(VENV) demo-output build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
