# make demo         a film of the robot working beside a worker it sees through four cameras
# make test         the proof, in minutes
# make test-all     all of it: pixels at length, processes, experiments end to end
# make test-stock   all of it in a fresh environment with the packages that everybody gets
# make test-ray     engines and training on a cluster of Ray, in a fresh environment
# make test-long    what a release needs: that, and what takes longest
# make train-quick  a policy
# make docs         the site, in out/docs
# make wheel        wheels for PyPI: of pure Python, and with compiled kernels
# make results      all numbers and pictures of the documentation made at older versions (hours)
# make behaviour    whether anything behaves otherwise than recorded
# make check        style, types, floors, language
PYTHON ?= python3
VENV ?= .venv
STOCK := out/stock
RAY := out/ray
RUN := $(VENV)/bin/python
# What is installed: the environment; with its learner; with what develops it. Each has the former.
CORE := $(VENV)/.core
TRAIN := $(VENV)/.train
DOCS := $(VENV)/.docs
DEV := $(VENV)/.dev
PYTEST := $(RUN) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

.PHONY: demo test test-all test-stock test-ray test-long behaviour check bench train-quick docs wheel results clean
.DEFAULT_GOAL := demo

$(CORE): NEEDED := .
$(TRAIN): NEEDED := .[train]
$(TRAIN): HAS := $(CORE)
$(DEV): NEEDED := .[dev]
$(DEV): HAS := $(CORE) $(TRAIN) $(DOCS)
$(CORE) $(TRAIN) $(DEV): pyproject.toml constraints.txt
	@test -x $(RUN) || $(PYTHON) -m venv $(VENV)
	@echo "Installing hrc_env and what it needs into $(VENV) (a minute or two) ..."
	@$(RUN) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e "$(NEEDED)"
	@$(RUN) -m hrc_env setup
	@touch $(HAS) $@

# Imports the package and runs none of it: no weights, no kernels.
$(DOCS): pyproject.toml constraints.txt
	@test -x $(RUN) || $(PYTHON) -m venv $(VENV)
	@echo "Installing hrc_env and what builds its site into $(VENV) (a minute) ..."
	@$(RUN) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[docs]" || \
		{ echo "make docs needs the packages of the extra docs: run it once with a network."; exit 1; }
	@touch $@

docs: $(DOCS)
	$(RUN) -m docs.site

wheel: $(DEV)
	$(RUN) -m assets.kernels.wheel

demo: $(CORE)
	$(RUN) -m hrc_env demo

test: $(DEV)
	$(RUN) -m hrc_env setup
	$(PYTEST) -m "not slow and not long"

test-all: $(DEV)
	$(RUN) -m hrc_env setup
	$(PYTEST) -m "not long"

test-long: $(DEV) test-stock
	$(RUN) -m hrc_env setup
	$(PYTEST) -m long

# No settings of pip, nothing cached: on Linux torch is its CUDA build, with triton, 6 GB.
test-stock:
	rm -rf $(STOCK)
	mkdir -p $(STOCK)/home
	env -i HOME="$(CURDIR)/$(STOCK)/home" PATH="$$PATH" MAKEFLAGS="$(MAKEFLAGS)" \
		$(MAKE) test-all VENV="$(STOCK)/venv" PYTHON="$(PYTHON)"

test-ray:
	rm -rf $(RAY)
	$(PYTHON) -m venv $(RAY)
	$(RAY)/bin/python -m pip install --quiet -c constraints.txt -e ".[ray]" "pytest>=8"
	$(RAY)/bin/python -m hrc_env setup
	$(RAY)/bin/python -m pytest tests/engines

behaviour: $(DEV)
	$(RUN) -m tests.behaviour

check: $(DEV)
	$(RUN) -m tests.behaviour --commits
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/lint-imports
	$(RUN) -m tests.language
	$(VENV)/bin/pyright

bench: $(DEV)
	$(RUN) -m benchmarks speed
	$(RUN) -m benchmarks perception

train-quick: $(TRAIN)
	$(RUN) train.py

results: $(DEV)
	$(RUN) -m hrc_env setup --networks heavy
	$(RUN) -m benchmarks.results

clean:
	rm -rf $(VENV) out
	find . -name '*.nb[ic]' -delete
