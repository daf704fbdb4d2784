# make demo   a film of the robot working beside a worker it sees through four cameras
# make test   the proof, in minutes; make test-all: all of it; make test-long: for a release
# make check  style, types, floors
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin/python
READY := $(VENV)/.ready
PYTEST := $(RUN) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

.PHONY: demo test test-all test-long check bench train-quick clean
.DEFAULT_GOAL := demo

$(READY): pyproject.toml constraints.txt
	@test -x $(RUN) || $(PYTHON) -m venv $(VENV)
	@echo "Installing hrc_env and what it needs (a minute or two) ..."
	@$(RUN) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
	@$(RUN) -m hrc_env setup
	@touch $(READY)

demo: $(READY)
	$(RUN) -m hrc_env demo

test: $(READY)
	$(RUN) -m hrc_env setup
	$(PYTEST) -m "not slow and not long"

test-all: $(READY)
	$(RUN) -m hrc_env setup
	$(PYTEST) -m "not long"

test-long: $(READY) test-stock
	$(RUN) -m hrc_env setup
	$(PYTEST) -m long

check: $(READY)
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/lint-imports
	$(VENV)/bin/pyright

bench: $(READY)
	$(RUN) -m hrc_env bench speed
	$(RUN) -m hrc_env bench perception
	$(RUN) benchmarks/pixels.py
	$(RUN) benchmarks/soak.py
	$(RUN) -m benchmarks.sim_dt
	$(RUN) benchmarks/prediction.py

train-quick: $(READY)
	$(RUN) train.py

clean:
	rm -rf $(VENV) out
	find . -name '*.nb[ic]' -delete
