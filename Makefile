# Everything runs from .venv, which is made once and again when constraints.txt or setup.py change.
# Another Python: make install PYTHON=/path/to/python3.12

PYTHON ?=
ARGS ?=
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
PIP := $(BIN)/python -m pip --disable-pip-version-check -qq install --no-compile -c constraints.txt
FITS := import ensurepip, sys, venv; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 13))

.DEFAULT_GOAL := help
.PHONY: help install demo test lint types unit bench blind pictures clean

help: ## this text
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 18

install: $(INSTALLED) ## make .venv with the ROS 2 wheels and the test tools

$(INSTALLED): constraints.txt setup.py
	@found=; for python in $(PYTHON) $(if $(PYTHON),,python3.12 python3.11 python3); do \
	  if "$$python" -c '$(FITS)' >/dev/null 2>&1; then found=$$python; break; fi; done; \
	if [ -z "$$found" ]; then \
	  echo "make: no Python 3.11 or 3.12 with venv and ensurepip found$(if $(PYTHON), as PYTHON=$(PYTHON))." \
	    "Install one (on Debian and Ubuntu: python3 python3-venv), or say where it is: make install PYTHON=PATH" >&2; exit 1; fi; \
	echo "making $(VENV) with $$("$$found" --version); this takes about a minute"; \
	"$$found" -m venv --clear $(VENV)
	@$(PIP) setuptools
	@$(PIP) --no-build-isolation --editable '.[ros,page,test]'
	-@$(BIN)/python -m compileall -q -j 0 -x '/(plotly|matplotlib|fontTools|pip|docutils)/' $(VENV)/lib
	@touch $@

demo: $(INSTALLED) ## watch a simulated XY table being identified live (ARGS="--help" for more)
	@$(BIN)/xy-sysid demo $(ARGS)

test: lint types unit ## style, types and every test

lint: $(INSTALLED) ## style
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

types: $(INSTALLED) ## types
	@$(BIN)/mypy

unit: $(INSTALLED) ## every test (ARGS="-k words" for some)
	@$(BIN)/python -m pytest $(ARGS)

bench: $(VENV)/.bench ## measure against other software, and write the table (ARGS names one)
	@$(BIN)/python -m bench $(ARGS)

blind: $(INSTALLED) ## name hidden effects on machines never tuned on, and write docs/blind.md (ARGS="--part 3" for a third)
	@$(BIN)/python -m blind $(ARGS)

$(VENV)/.bench: $(INSTALLED)
	@$(PIP) --no-build-isolation --editable '.[bench]'
	@touch $@

pictures: $(INSTALLED) ## make the pictures and the text of docs/reading-pictures.md (needs chromium; ARGS names some)
	@$(BIN)/python -m pictures $(ARGS)

clean: ## remove what the other targets made
	rm -rf $(VENV) build install log .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
