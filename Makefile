# Everything runs from .venv, which is made once and again when constraints.txt or setup.py change.
# Another Python: make install PYTHON=/path/to/python3.12

PYTHON ?=
ARGS ?=
JOBS ?= 3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# xdist 3.8 waits for ever after it has replaced a worker that crashed
PYTEST = $(BIN)/python -m pytest -n $(JOBS) --dist loadfile --max-worker-restart 0
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq install --no-compile -c constraints.txt
LAWS = OPENBLAS_NUM_THREADS=1 $(BIN)/python -c "import xy_sysid as xy; run = xy.simulate(10, hidden=7, seed=1).run('x'); xy.fit(run); xy.diagnose(run); \
  xy.use(xy.PhysicalModel(xy.AxisModel(0.1, 1e-3, 200.0)), limit=5.0, rate=2000.0)"
FITS := import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))

unexport PYTHONDONTWRITEBYTECODE # or each worker compiles every test again, 9 s of each

.DEFAULT_GOAL := help
.PHONY: help install demo test faults soak test-busy lint types unit laws docs bench blind pictures clean

help: ## this text
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 18

install: $(INSTALLED) ## make .venv with the ROS 2 wheels and the test tools

$(INSTALLED): constraints.txt setup.py
	@found=; for python in $(PYTHON) $(if $(PYTHON),,python3.12 python3.11 python3.13 python3); do \
	  if "$$python" -c '$(FITS)' >/dev/null 2>&1; then found=$$python; break; fi; done; \
	if [ -z "$$found" ]; then \
	  echo "make: no Python 3.11, 3.12 or 3.13 with venv and ensurepip found$(if $(PYTHON), as PYTHON=$(PYTHON))." \
	    "Install one (on Debian and Ubuntu: python3 python3-venv), or say where it is: make install PYTHON=PATH" >&2; exit 1; fi; \
	echo "making $(VENV) with $$("$$found" --version); this takes about a minute"; \
	"$$found" -m venv --clear $(VENV)
	@$(PIP) setuptools
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat --editable '.[ros,page,test]'
	-@$(BIN)/python -m compileall -q -x '/(plotly|matplotlib|fontTools|pip|docutils)/' $(VENV)/lib & $(LAWS); wait
	@touch $@

demo: $(INSTALLED) ## watch a simulated XY table being identified live (ARGS="--help" for more)
	@$(BIN)/xy-sysid demo $(ARGS)

test: $(INSTALLED) ## style, types and every test
	@$(MAKE) --no-print-directory -j 2 lint types laws
	@$(MAKE) --no-print-directory unit

lint: $(INSTALLED) ## style of the code, and of the prose in README and docs
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/proselint check --config proselint.json *.md config/*.md docs/*.md

types: $(INSTALLED) ## types
	@$(BIN)/mypy

unit: $(INSTALLED) ## every test (ARGS="-k words" for some), three files at a time, as many wait (JOBS=0: one after the other)
	@$(PYTEST) $(ARGS)

laws: $(INSTALLED) # compiled here once if they changed, and not by each of the tests' workers
	@$(LAWS)

docs: $(VENV)/.docs ## the documentation site in build/site (index.html); a broken link is an error
	@$(BIN)/python -m campaigns.documents.architecture --write
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict $(ARGS)
	@echo "build/site/index.html"

test-busy: $(INSTALLED) ## every test with eight busy processes beside them (ARGS="-k words" for some)
	@PYTHONPATH=test $(BIN)/python -m helpers.busy 8 $(PYTEST) $(ARGS)

bench: $(VENV)/.bench ## measure against other software, and write the table (ARGS names one)
	@$(BIN)/python -m campaigns.bench $(ARGS)

blind: $(INSTALLED) ## name hidden effects on machines never tuned on, and write docs/blind.md (ARGS="--part 3" for a third)
	@$(BIN)/python -m campaigns.blind $(ARGS)

faults: $(INSTALLED) ## attack everything with fixed seeds, and write docs/faults.md; a hole is an error (ARGS names groups)
	@$(BIN)/python -m campaigns.faults $(ARGS)

soak: $(INSTALLED) ## a day of data through all nodes and the page, with memory and descriptors of each (ARGS="--minutes 20")
	@$(BIN)/python -m campaigns.faults soak $(ARGS)

$(VENV)/.docs: $(INSTALLED)
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat --editable '.[docs]'
	@touch $@

$(VENV)/.bench: $(INSTALLED)
	@$(PIP) --no-build-isolation --config-settings editable_mode=compat --editable '.[bench]'
	@touch $@

pictures: $(INSTALLED) ## make the pictures and the text of docs/reading-pictures.md (needs chromium; ARGS names some)
	@$(BIN)/python -m campaigns.pictures $(ARGS)

clean: ## remove what the other targets made
	rm -rf $(VENV) build install log .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
