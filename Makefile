# `make` or `make help` lists what there is. Every target sets up on first use what it needs.
VENV := $(or $(GAITVAL_VENV),.venv)
BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
S ?= 5
OUT ?=
SET ?=
TOPIC ?=
SLOW ?=
FOR ?=
PYTEST_ARGS ?=

settings := $(foreach setting,$(SET),--set $(setting))

# What a target needs beyond the libraries of the main job: extras of pyproject.toml. They are set up
# at once for all targets of a call, so that none waits for another's (make -j2 lint docs).
needs_test := test peers
needs_lint := lint
needs_docs := docs
needs_pictures := docs test
needs_audit := audit
needs_bench := test peers
needs_claims := test peers
needs_wheel := test
needed := $(sort $(FOR) $(foreach target,$(MAKECMDGOALS),$(needs_$(target))))

.DEFAULT_GOAL := help
.PHONY: help setup subject test lint docs pictures baseline tables check bench claims general held-out paper wheel audit clean

help: ## This list
	@echo 'gaitval: a simulated walker that walks like a recorded person, compared with the record'
	@echo
	@sed -n 's/^\([a-z-]*\):.*## /  make \1|/p' $(MAKEFILE_LIST) | awk -F'|' '{printf "%-16s %s\n", $$1, $$2}'
	@echo
	@echo 'Examples: make subject S=5'
	@echo '          make subject S=5 SCRATCH=1 OUT=/tmp/S05'
	@echo '          make subject S=5 SET="seed=1 training.samples=500000"'

setup: ## Install what the main job needs into .venv; FOR="cohort test" for more extras
	@bash scripts/setup.sh $(needed)

subject: setup ## The main job for subject S (1-10); SCRATCH=1 trains from nothing, OUT=, SET="a=b c=d"
	@$(BIN)/gaitval subject $(S) $(if $(OUT),--out $(OUT)) $(if $(filter-out 0,$(SCRATCH)),--scratch) $(settings)

test: setup ## All tests but the slow ones; SLOW=1 for those too, PYTEST_ARGS="-k scaling" for some
	@# The tests run side by side: threads of linear algebra beside them would wait for each other.
	@# Hundreds of them start Python, which else might compile the same again and again.
	@OMP_NUM_THREADS=1 PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder \
		$(if $(filter-out 0,$(SLOW)),,-m 'not slow') $(PYTEST_ARGS)

lint: setup ## ruff and mypy --strict
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy --strict

docs: setup ## Build the documentation site into site/, warnings as errors
	@PYTHONPATH=. NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo 'Site: site/index.html'

pictures: setup ## Make the pictures of README and site from today's results (10 min, Chromium); SET=names
	@$(BIN)/python docs/build/pictures.py $(SET)

baseline: setup ## Make the finished run of subject S its stored baseline (policy, mu, metrics)
	@$(BIN)/gaitval baseline $(S) $(if $(OUT),--out $(OUT) --to $(shell printf 'reports/S%02d' $(S))/baseline)
	@$(BIN)/python docs/build/accuracy_tables.py

tables: setup ## Write the accuracy tables of the READMEs
	@$(BIN)/python docs/build/accuracy_tables.py

check: setup ## Walk the stored policy of subject S again and compare with its stored metrics
	@$(BIN)/gaitval check --baseline $(shell printf 'reports/S%02d' $(S))/baseline

bench: setup ## Speed against peers, as ratios within one run
	@$(BIN)/pytest benchmarks --benchmark-enable --benchmark-only --benchmark-columns=min,median,rounds

claims: setup ## Measure what a release is held to (TOPIC="speed accuracy", or all) into reports/claims.csv
	@$(BIN)/python -m claims $(TOPIC)

general: setup ## Train the general policy of reports/general, which trainings start from (65 min)
	@$(BIN)/python -m experiments.general_policy --out reports/general-first
	@$(BIN)/python -m experiments.general_policy --start reports/general-first --samples 24000000
	@$(BIN)/python -m experiments.placing_feet
	@$(BIN)/python -m experiments.slow_policy
	@$(BIN)/python -m experiments.delayed_policy

held-out: setup ## Run all walks that know only a part of the record (2 h), which claims are read from
	@$(BIN)/python -m experiments.held_out_runs holdout
	@$(BIN)/python -m experiments.held_out_runs kinematics
	@$(BIN)/python -m experiments.held_out_runs halves ../shared/data

paper: setup ## Every figure of the paper from our own data, and what agrees (3 min), into paper/; OUT=
	@$(BIN)/python -m experiments.paper.figures $(if $(OUT),--out $(OUT))

wheel: setup ## Build the wheel into dist/, and beside it what it runs on (CycloneDX)
	@$(BIN)/python -m build --wheel
	@$(BIN)/python scripts/sbom.py

audit: setup ## Known weaknesses of the locked packages, by pip-audit
	@# --strict: a package that the database does not know fails too, and so does a mirror without it.
	@$(BIN)/pip-audit --strict --require-hashes --disable-pip --progress-spinner off \
		$(patsubst %,--requirement %,$(wildcard locks/*.txt))

clean: ## Remove .venv, caches and built files; results in reports/ stay
	rm -rf $(VENV) build dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis .benchmarks
	find gaitval tests benchmarks -name __pycache__ -type d -exec rm -rf {} +
