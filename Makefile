# `make demo` and `make test` set up .venv by themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# How many seeds of each kind `make blind` takes, the first of them (a block kept for reports), and its working folder
FIRST := 0
BLIND := single=260 pair=80 none=200 foreign=100 poor=65 snr=130
BLIND_DIR := build/blind
JOBS := 2

# Processes of tests; each takes up to 1 GB
PROCESSES := $(shell n=$$(nproc 2>/dev/null || echo 2); [ $$n -gt 8 ] && n=8; echo $$n)

# Modules are compiled once, not by each of the hundred or so processes that tests start
unexport PYTHONDONTWRITEBYTECODE

.PHONY: firmware demo test check prove lint fuzz check-bounds blind track docs links clean

# What the demo needs from the package; zig, 410 MB, only where no compiler that `verify` looks for makes a library
comma := ,
COMPILER = $(shell made=$$(mktemp) && for cc in gcc clang; do \
    $$cc -include stdint.h -shared -fPIC -x c /dev/null -o "$$made" 2>/dev/null && echo $$cc && break; done; \
    rm -f "$$made")

$(VENV)/demo: pyproject.toml
	@echo "installing hystgen and what it needs to fit, plot and compile, into $(VENV) .."
	@test -e $(VENV)/bin/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --disable-pip-version-check --editable '.[fit,plot$(if $(COMPILER),,$(comma)zig)]'
	@touch $@

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $(VENV)/demo $@

demo: $(VENV)/demo
	mkdir -p examples/out
	$(BIN)/hystgen identify examples/stage_recording.csv --holdout examples/stage_holdout.csv \
	    -o examples/out/stage.yaml --units V,um --plot examples/out/stage.png --report examples/out/report
	$(BIN)/hystgen emit examples/out/stage.yaml -o examples/out >/dev/null
	$(BIN)/hystgen verify examples/out/stage.yaml
	@echo; echo "The C, ready to compile, the plot and the report:"
	@$(BIN)/hystgen emit examples/out/stage.yaml -o examples/out --list-outputs
	@echo examples/out/stage.png
	@echo examples/out/report/report.html
	@echo; echo "From a gap to firmware, in about 20 s: a simulated stage with hidden creep and a bent transducer is"
	@echo "recorded, a model is identified and diagnosed, and the compiled C of each model drives that stage."
	@$(BIN)/python examples/from_gap_to_firmware -o examples/out/story
	@echo; echo "These tracking errors as a picture:  examples/out/story/tracking.png"
	@echo "Open this page first:                examples/out/story/diagnosis/report.html"

# A firmware image for three cores, built and run under qemu: needs gcc-arm-none-eabi, qemu-system-arm, qemu-system-misc
firmware: $(VENV)/ready
	$(MAKE) -C examples/firmware HYSTGEN=$(abspath $(BIN))/hystgen ZIG="$(abspath $(BIN))/python -m ziglang"

# Every feature once, without tests marked thorough; each file in one process, which compiles its functions once
test: $(VENV)/ready
	$(BIN)/python -m pytest -n $(PROCESSES) --dist loadfile -m "not thorough"

# Everything CI runs: each feature, and one in eight of the thorough tests; HYSTGEN_WHOLE=1 runs all. Each file in one
# process too, whose tests share what they compute
check: $(VENV)/ready lint
	$(BIN)/python tests/static_checks.py
	$(BIN)/python -m pytest -n $(PROCESSES) --dist worksteal --share 8

# All proofs by Frama-C, which has to be installed; `make check` does a fifth of them
prove: $(VENV)/ready
	CI=true HYSTGEN_WHOLE=1 $(BIN)/python -m pytest -n $(PROCESSES) tests/test_proof.py

lint: $(VENV)/ready
	$(BIN)/ruff check hystgen tests benchmarks examples c_runtime docs
	$(BIN)/mypy

# Ten modules, five minutes each
fuzz: $(VENV)/ready
	HYSTGEN_FUZZ_SECONDS=300 $(BIN)/python -m pytest -n $(PROCESSES) tests/test_fuzz.py -k nothing

# Ten times as many random models as in `make check`, against an exact model; build/oracle keeps those with faults
check-bounds: $(VENV)/ready
	$(BIN)/python -m tests.oracle --models 3000

# Makes the cases with their labels, diagnoses them and counts; a case that already has a result is not run again
blind: $(VENV)/ready
	set -e; for part in $(BLIND); do $(BIN)/python -m benchmarks.plants generate --block report --kind $${part%=*} \
	    --seeds $(FIRST):$$(($(FIRST) + $${part#*=})) -o $(BLIND_DIR) --jobs $(JOBS); done
	$(BIN)/python -m benchmarks.plants run $(BLIND_DIR)/cases -o $(BLIND_DIR)/results --jobs $(JOBS)
	$(BIN)/python -m benchmarks.plants score $(BLIND_DIR)/cases $(BLIND_DIR)/labels $(BLIND_DIR)/results \
	    --json $(BLIND_DIR)/score.json

# Blind plants behind compensators made from their records, four per effect
track: $(VENV)/ready
	$(BIN)/python -m benchmarks.plants track --seeds 0:5 --jobs $(JOBS)

# The documentation as a site, build/docs/index.html; needs Debian's doxygen
docs: $(VENV)/ready
	$(BIN)/python -m sphinx -W --keep-going -b html docs build/docs

# All links of the pages and the site; `make check` skips only those to other sites
links: docs
	$(BIN)/lychee --no-progress --include-fragments=anchor-only --max-retries 3 *.md docs build/docs

clean:
	rm -rf $(VENV) build dist
