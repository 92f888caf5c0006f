# Two commands for a newcomer: `make session` and `make test`. Both set up .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SESSION ?= sessions/demo-$(shell date +%Y%m%d-%H%M%S)
EXPERIMENT ?= sessions/experiment
GRASPS ?= 25
REPEATS ?= 5
JOBS ?= 2

.PHONY: help install session experiment first-half second-half test lint types contract unit format clean

help: ## list the commands
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

install: $(VENV)/.installed ## make the environment in .venv

$(VENV)/.installed: pyproject.toml constraints.txt
	@PYTHON=$(PYTHON) ./tests/install-system-packages runtime
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check 'uv>=0.5'
	@$(BIN)/uv pip install --quiet --python $(BIN)/python --compile-bytecode \
		--constraint constraints.txt --editable '.[dev]'
	@touch $@

session: install ## a short simulated session on real shapes, with table and report
	$(BIN)/reach collect --station simulated --objects cube_3cm,bracket,knob --grasps 4 --repeats 2 \
		--operator auto --seed 7 --out $(SESSION)

experiment: install ## all 2,625 simulated trials and Table 1; goes on where it was stopped
	@mkdir -p $(EXPERIMENT)
	$(MAKE) --no-print-directory --jobs 2 first-half second-half
	$(BIN)/reach evaluate $(EXPERIMENT)/first-half $(EXPERIMENT)/second-half \
		--markdown $(EXPERIMENT)/table1.md --json $(EXPERIMENT)/table1.json

# Two simulated cells at once, one a core: a session has one robot and one writer.
first-half: PARTS := cube_3cm,wedge,perforated_plate,hook,cylinder,pawn,nozzle,cup,knob,mount,turbine
second-half: PARTS := near_cube,bracket,star,clamp,egg,vase,bowl,mug,gear,pipe_connector
first-half second-half:
	$(BIN)/reach collect --out $(EXPERIMENT)/$@ --operator auto $(if $(wildcard $(EXPERIMENT)/$@),\
		--resume,--objects $(PARTS) --grasps $(GRASPS) --repeats $(REPEATS) --seed 1)

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
