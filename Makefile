# `make demo` and `make test` set up .venv by themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo test lint fuzz clean

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $@

demo: $(VENV)/ready
	mkdir -p examples/out
	$(BIN)/hystgen identify examples/stage_recording.csv --holdout examples/stage_holdout.csv \
	    -o examples/out/stage.yaml --units V,um --plot examples/out/stage.png
	$(BIN)/hystgen emit examples/out/stage.yaml -o examples/out >/dev/null
	$(BIN)/hystgen verify examples/out/stage.yaml
	@echo; echo "The C, ready to compile, and the plot:"
	@$(BIN)/hystgen emit examples/out/stage.yaml -o examples/out --list-outputs
	@echo examples/out/stage.png

test: $(VENV)/ready lint
	$(BIN)/python -m pytest -n 2

lint: $(VENV)/ready
	$(BIN)/ruff check hystgen tests benchmarks examples c_runtime
	$(BIN)/mypy
	$(BIN)/python tests/static_checks.py

# Eight modules, five minutes each
fuzz: $(VENV)/ready
	HYSTGEN_FUZZ_SECONDS=300 $(BIN)/python -m pytest -n 2 tests/test_fuzz.py -k nothing

clean:
	rm -rf $(VENV) build dist
