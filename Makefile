# `make demo` and `make test` do all their own set-up in a virtual environment.
PYTHON ?= python3
VENV ?= .venv
OUT ?= runs/strip_footing
BIN = $(VENV)/bin

.PHONY: demo test test-long gpu lint clean

demo: $(VENV)/demo
	$(BIN)/warpsph run strip_footing --out $(OUT) --overwrite
	@echo "pictures: $(OUT)/history.png (load against settlement) and $(OUT)/field.png (plastic strain)"

test: $(VENV)/test
	$(BIN)/python -m pytest

test-long: $(VENV)/test
	$(BIN)/python -m pytest -m long

# On a machine with a CUDA device: the tests that run there, then its benchmark of record.
gpu: $(VENV)/test
	$(BIN)/python -m pytest -m cuda
	$(BIN)/python tools/benchmark.py --devices cuda:0 --dimensions 2,3 --materials viscoplastic \
		--nodes 1e3,1e4,1e5,1e6,4e6 --out runs/benchmark_gpu.json

lint: $(VENV)/test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

$(VENV)/demo: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q -e .
	@touch $@

$(VENV)/test: pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install -q -e ".[dev]"
	@touch $@ $(VENV)/demo

clean:
	rm -rf $(VENV) runs build dist
