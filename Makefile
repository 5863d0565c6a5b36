# make setup   prepares .venv with the command `vigil`, and the system libraries of the renderer;
#              EXTRAS=azure,mistral adds the clients of model providers (`vigil models` names them)
# make run     plays the starter pack with the solver and two flawed agents, and compares them
# make test    runs the tests, after installing what they need (make setup-dev)
# make coverage  runs the tests of the pure parts, and fails if they cover less than pyproject.toml demands
# make release-check  builds the wheel and plays from it in empty environments, with the lowest and newest dependencies (docs/releases.md)
# make test-verifiers  tests the environment of verifiers, in .venv-verifiers: it needs an older openai (docs/verifiers.md)
# make docs    builds the documentation into site/, which needs no network and no server; make docs-version puts it into
#              pages/VERSION, next to the versions that are there already
# make pictures draws the pictures of README.md and docs/ again; it takes long, and needs Chromium (docs/writing.md)
# make mutants lists the small faults that the tests do not notice; MODULE=scoring.outcomes for one module, EVERY=8 for a sample
PYTHON ?= $(shell for p in python3.13 python3.12 python3.11 python3; do \
	command -v $$p >/dev/null 2>&1 && $$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null \
	&& { echo $$p; break; }; done)
VENV := .venv
BIN := $(VENV)/bin
VERIFIERS := .venv-verifiers
comma := ,
EXTRAS ?=
STAMP := $(VENV)/.ready$(if $(EXTRAS),-$(subst $(comma),-,$(EXTRAS)))
DEV_STAMP := $(VENV)/.ready-dev
PIP := $(BIN)/python -m pip --disable-pip-version-check
REQUIREMENTS := pyproject.toml constraints.txt scripts/system-libraries
RUNS ?= runs/starter
DOCS ?= pages
MODULE ?= protocol.profile scoring.outcomes protocol.actions env protocol.goals scoring.goal_check protocol.replies base.json_text protocol.reasoning records.record scoring.summary
EVERY ?= 1
LOCKED := azure,docs,mistral,mutants,procthor,thor
RELEASE_PYTHONS ?= python3.11 python3.12 python3.13

.PHONY: setup setup-dev setup-docs setup-verifiers run test coverage test-verifiers release-check lint docs docs-version pictures lock \
	lock-verifiers mutants clean
.DELETE_ON_ERROR:

setup: $(STAMP)
setup-dev: $(DEV_STAMP)

define prepare
	@test -n "$(PYTHON)" || { echo "VIGIL needs Python 3.11, 3.12 or 3.13 on PATH (or: make PYTHON=/path/to/python3.11)." >&2; exit 1; }
	@scripts/system-libraries
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV) || { rm -rf $(VENV); \
		echo "$(PYTHON) cannot make virtual environments; on Debian or Ubuntu: apt-get install python3-venv" >&2; exit 1; }
	@$(PIP) install --quiet --constraint constraints.txt uv && \
		$(BIN)/uv pip install --quiet --python $(BIN)/python --compile-bytecode --constraint constraints.txt --editable '$(1)' || \
		{ echo "uv could not install the packages; pip tries, with its own settings."; \
		$(PIP) install --quiet --constraint constraints.txt --editable '$(1)'; }
endef

$(STAMP): $(REQUIREMENTS)
	$(call prepare,.$(if $(EXTRAS),[$(EXTRAS)]))
	@touch $@

$(DEV_STAMP): $(REQUIREMENTS)
	$(call prepare,.[dev])
	@touch $@ $(VENV)/.ready

setup-docs:
	@$(MAKE) --no-print-directory setup EXTRAS=docs

setup-verifiers: $(VERIFIERS)/.ready

$(VERIFIERS)/.ready: pyproject.toml constraints-verifiers.txt
	$(PYTHON) -m venv --clear $(VERIFIERS)
	$(VERIFIERS)/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints-verifiers.txt \
		--editable '.[verifiers]' gymnasium hypothesis psutil pytest pytest-xdist
	@touch $@

run: setup
	@$(BIN)/vigil run --pack starter --agent solver --log-dir $(RUNS)/solver
	@$(BIN)/vigil run --pack starter --agent never_report --log-dir $(RUNS)/never_report
	@$(BIN)/vigil run --pack starter --agent premature --log-dir $(RUNS)/premature
	@$(BIN)/vigil score $(RUNS)/solver $(RUNS)/never_report $(RUNS)/premature
	@echo "Next: $(BIN)/vigil view $(RUNS)                      the runs step by step, in the browser"
	@echo "      $(BIN)/vigil report $(RUNS)/* --out report     tables and figures, in report/report.html"
	@echo "      $(BIN)/vigil run --model openai/gpt-4o --dry-run      what a model's run would take"

# Compiled code is kept even where the environment says otherwise: every worker and started command would compile again.
test: setup-dev
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist worksteal

coverage: setup-dev
	$(BIN)/python -m pytest -n auto --dist worksteal $(addprefix tests/,base packs protocol records scoring) --cov

test-verifiers: setup-verifiers
	$(VERIFIERS)/bin/python -m pytest -n 0 tests/integrations/test_verifiers.py

# Fetches the dependencies again for each interpreter, which takes minutes each time.
release-check: setup
	$(BIN)/python scripts/release_check.py $(RELEASE_PYTHONS)

lint: setup-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell
	$(BIN)/pyright

docs: setup-docs
	$(BIN)/python -m scripts.build_docs

docs-version: setup-docs
	$(BIN)/python -m scripts.build_docs --publish $(DOCS)

# tools/pictures.py names what the commands before it have drawn; the runs are played again, with today's frames.
pictures: setup-dev
	rm -rf docs/pictures/catalog
	$(BIN)/vigil render --catalog --variants 1 --out docs/pictures/catalog
	$(BIN)/vigil pack sheet vigil_balanced_1000 --count 80 --out docs/packs
	$(BIN)/python -m tools.house_pictures
	$(BIN)/python -m tools.concepts
	$(BIN)/python -m tools.pictures
	rm -rf runs/readme runs/web
	$(BIN)/python -m tools.readme_pictures
	$(BIN)/python -m tools.web_pictures

# Takes hours; see docs/mutants.md. Interrupted, it goes on where it was stopped.
mutants: setup-dev
	$(PIP) install --quiet --constraint constraints.txt --editable '.[mutants]'
	@failed=0; for module in $(MODULE); do $(BIN)/python -m tools.mutants $$module --every $(EVERY) || failed=1; done; exit $$failed

# Pins the versions that `make setup` installs, from what is installed now; LOCKED are the extras that `dev` does not hold.
lock: setup-dev
	$(PIP) install --quiet --constraint constraints.txt --editable '.[$(LOCKED)]'
	$(PIP) freeze --exclude-editable > constraints.txt

lock-verifiers: setup-verifiers
	$(VERIFIERS)/bin/python -m pip freeze --exclude-editable --disable-pip-version-check > constraints-verifiers.txt

clean:
	rm -rf $(VENV) $(VERIFIERS) runs build dist site .pytest_cache .ruff_cache .hypothesis
