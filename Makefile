# `make demo` and `make test` do all their own set-up in a virtual environment.
PYTHON ?= python3
VENV ?= .venv
OUT ?= runs/strip_footing
BIN = $(VENV)/bin
# What shows that an environment works: meshes, kernels of every scheme, USD and VTK files.
QUICK = tests/test_shapes.py tests/test_simulation.py tests/test_usd.py tests/test_paraview.py
LOWEST_PYTHON ?= python3.10
OTHER_PYTHONS ?= python3.10 python3.13

.PHONY: demo test test-long test-quick test-lowest test-pythons gpu lint clean

demo: $(VENV)/demo
	$(BIN)/warpsph run strip_footing --out $(OUT) --overwrite
	@echo "pictures: $(OUT)/history.png (load against settlement) and $(OUT)/field.png (plastic strain)"

test: $(VENV)/test
	$(BIN)/python -m pytest

test-long: $(VENV)/test
	$(BIN)/python -m pytest -m long

test-quick: $(VENV)/test
	$(BIN)/python -m pytest $(QUICK)

# The lowest versions that pyproject.toml declares, on the lowest Python. A bound that nobody installs is a guess.
test-lowest: $(VENV)/test
	@if $(LOWEST_PYTHON) -c "" 2>/dev/null; then $(MAKE) $(VENV)-lowest/test && \
		$(VENV)-lowest/bin/python -m pytest $(QUICK); \
	else echo "test-lowest: skipped, as there is no $(LOWEST_PYTHON) here"; fi

# The newest versions, on other Pythons where there are any.
test-pythons:
	@for python in $(OTHER_PYTHONS); do \
		if $$python -c "" 2>/dev/null; then $(MAKE) test-quick PYTHON=$$python VENV=$(VENV)-$$python || exit 1; \
		else echo "test-pythons: skipped $$python, as there is none here"; fi; \
	done

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

$(VENV)-lowest/test: pyproject.toml tools/lowest.py
	$(LOWEST_PYTHON) -m venv $(VENV)-lowest
	$(BIN)/python tools/lowest.py dev > $(VENV)-lowest/requirements.txt
	$(VENV)-lowest/bin/python -m pip install -q -r $(VENV)-lowest/requirements.txt -e .
	@touch $@

clean:
	rm -rf $(VENV) $(VENV)-* runs build dist
