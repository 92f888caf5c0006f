# Two commands for a newcomer: `make session` and `make test`. Both set up .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SESSION ?= sessions/demo-$(shell date +%Y%m%d-%H%M%S)
JOBS ?= 2

.PHONY: help install session test lint types contract unit format clean

help: ## list the commands
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

install: $(VENV)/.installed ## make the environment in .venv

$(VENV)/.installed: pyproject.toml constraints.txt
	@PYTHON=$(PYTHON) ./tests/install-system-packages runtime
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check 'uv>=0.5'
	@$(BIN)/uv pip install --quiet --python $(BIN)/python --constraint constraints.txt --editable '.[dev]'
	@touch $@

session: install ## a short simulated session on real shapes, with table and report
	$(BIN)/reach collect --station simulated --objects cube_3cm,bracket,knob --grasps 4 --repeats 2 \
		--operator auto --seed 7 --out $(SESSION)

test: install ## lint, types, import contract, and all tests
	@./tests/install-system-packages
	$(MAKE) --no-print-directory lint types contract unit

lint: install ## style
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: install ## mend the style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: install ## strict types
	$(BIN)/mypy

contract: install ## who may import whom
	$(BIN)/lint-imports

unit: install ## unit, property and end-to-end tests
	$(BIN)/pytest -n $(JOBS)

clean: ## remove the environment and caches
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache
