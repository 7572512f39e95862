# Every target makes the environment it needs. `make help` lists them.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STUDY ?= studies/one_shot.toml
STORE ?= results/$(basename $(notdir $(STUDY))).zarr
PYTEST ?= -q -n auto --dist loadfile --no-loadscope-reorder
BENCH ?=
RESULTS ?=

.PHONY: help demo test docs run show batch resume summary plot list generate check equations verify compare identify paper gallery lint format bench bench-compare bench-pages clean
.DEFAULT_GOAL := help

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: $(VENV)/run ## from a fresh clone to the figure of one shot of the M113
	$(BIN)/qddot generate m113
	$(BIN)/qddot run studies/one_shot.toml

# Hundreds of processes import the same files: what Python compiles of them is kept, whatever the environment says.
# As many of them as there are cores are at work; threads of linear algebra would only wait for each other.
test: $(VENV)/test ## all tests
	PYTHONDONTWRITEBYTECODE= OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest $(PYTEST)

run: $(VENV)/run ## run a study: make run STUDY=studies/one_shot.toml
	$(BIN)/qddot run $(STUDY)

show: $(VENV)/run ## what drives a study, as a table and a figure: make show STUDY=studies/terrain_run.toml
	$(BIN)/qddot show $(STUDY)

batch: $(VENV)/run ## all runs of a study's sweep: make batch STUDY=studies/interval_sweep.toml
	$(BIN)/qddot batch $(STUDY)

resume: $(VENV)/run ## go on with a batch that was stopped, killed or ran out of disk: make resume STUDY=...
	$(BIN)/qddot batch $(STUDY)

summary: $(VENV)/run ## best, worst, quantiles and failures of a batch: make summary STUDY=...
	$(BIN)/qddot summary $(STORE)

plot: $(VENV)/run ## the figure of a batch: make plot STUDY=...
	$(BIN)/qddot plot $(STORE)

list: $(VENV)/run ## models, studies, library, methods and metrics
	$(BIN)/qddot list

generate: $(VENV)/run ## derive all models, write their kernels and equations
	$(BIN)/qddot generate

check: $(VENV)/run ## whether generated/ is what the models give
	$(BIN)/qddot generate --check

equations: $(VENV)/run ## the derived equations as HTML and, where LaTeX is installed, PDF
	$(BIN)/qddot equations --quiet

lint: $(VENV)/test ## ruff, format check, types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/test ## ruff's fixes and format
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

verify: $(VENV)/run ## section 3.1 of the paper: six schemes against the analytic solution
	$(BIN)/qddot verify

compare: $(VENV)/run ## the paper's equations (5) to (11) as printed beside those derived: term by term
	-$(BIN)/qddot compare studies/paper/equations_5_to_11.txt

identify: $(VENV)/run ## the recoil pulse, barrel and damping that the paper's five displacements ask for
	$(BIN)/qddot identify studies/paper/identify_recoil.toml
	$(BIN)/qddot identify studies/paper/identify_recoil_and_damping.toml

paper: compare identify ## the whole paper: equations, pulse, sections 3 and 4, every claim with its verdict
	$(BIN)/qddot paper
	$(BIN)/qddot report

docs: $(VENV)/docs ## the pages of docs/ and the reference as a site that needs no network: results/site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "wrote results/site/index.html; to search in it: $(BIN)/mkdocs serve"

gallery: $(VENV)/run ## a page with a figure for each shipped model: docs/gallery/
	$(BIN)/python docs/gallery.py

bench: $(VENV)-bench/run ## speed, beside other tools in an environment of their own: make bench BENCH="--quick batch"
	$(VENV)-bench/bin/python -m benchmarks $(BENCH)

# The files behind the goal are its arguments; as goals they are there already.
bench-compare: $(VENV)/run ## two results of `make bench` row by row: make bench-compare A.json B.json
	@$(BIN)/python -m benchmarks.compare $(filter-out $@,$(MAKECMDGOALS))

bench-pages: $(VENV)/run ## speed as the pages show it, from docs/speed.json or new: make bench-pages RESULTS=results/benchmarks.json
	$(BIN)/python -m benchmarks.pages $(RESULTS) $(ELSEWHERE)

clean: ## remove results and caches; `rm -rf .venv` removes the environment
	rm -rf results build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

$(VENV)/run: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[all]'
	@touch $@

$(VENV)/docs: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[all,docs]'
	@touch $@ $(VENV)/run

PEERS := heyoka numbalsoda CyRK jitcode casadi diffrax scikit-sundae pydy cython

$(VENV)-bench/run: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)-bench
	$(VENV)-bench/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[all]'
	for peer in $(PEERS); do \
	  $(VENV)-bench/bin/python -m pip install --quiet --disable-pip-version-check $$peer || echo "$$peer does not install here"; \
	done
	@touch $@

$(VENV)/test: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]'
	@touch $@ $(VENV)/run $(VENV)/docs
