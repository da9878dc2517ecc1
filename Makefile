# `make` sets everything up, `make help` lists the rest. The sources of packages are pip's own configuration.
.DEFAULT_GOAL := setup
.PHONY: setup core checked check-core docs pictures manual verification tutorials calibration calibration-designs mutants wheel coverage browser solver-env hsds demo test validate fuzz lint bench bench-peers reports defaults lock clean help
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c

PYTHON ?= python3
BIN := .venv/bin
# An interpreter with the extra `peers`: they may stand in an environment of their own.
PEERS_PYTHON ?= $(BIN)/python
WORKERS ?= 2
# The piston stands for itself on coarse meshes and over one stroke, where full-FE dofs finish in minutes.
SCENES := $(filter-out data/piston/scene.toml data/piston/coarse.toml,\
    $(sort $(wildcard data/*/*.toml tests/validation/scenes/*/*.toml)))
# gmsh and off-screen drawing load these; pipeline/cli/doctor.py has the same list.
SYSTEM_LIBRARIES := libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1 libegl1
# What is loaded of each of them, in the same order. No package of pip brings these.
SONAMES := libGLU.so.1 libGL.so.1 libXrender.so.1 libXcursor.so.1 libXft.so.2 libXinerama.so.1 libgomp.so.1 libEGL.so.1
# Read by the tests, which open a report's page in it.
BROWSERS := chromium chromium-browser google-chrome google-chrome-stable
# What a command imports before it can say that nothing is to be done, and what takes longest to load.
COMPILED := numpy scipy h5py pydantic pydantic_core annotated_types typing_extensions.py typing_inspection \
    skfem meshio matplotlib pyvista
APT_INSTALL := apt-get install -y --no-install-recommends

# A stamp is written last and named after what it vouches for: the lock file, the project file, and the folder,
# since an environment that was moved or copied still points at the old one.
key = $(shell { pwd; cat $(1); } | sha256sum | cut -c 1-16)
LOCKED := .venv/locked-$(call key,requirements.lock)
# What the native core is built of: an edit of it is built by whatever target needs it.
CORE := $(shell find solver/core pipeline \( -name '*.[ch]pp' -o -name CMakeLists.txt \) 2> /dev/null | sort)
READY := .venv/ready-$(call key,requirements.lock pyproject.toml $(CORE))
SOLVER_READY := .venv-solver/ready-$(call key,requirements-solver.lock pyproject.toml $(CORE))
CORE_READY := .build-core/ready-$(call key,$(CORE))

setup: $(READY) ## make .venv with the pinned packages and the system libraries (the targets that need it do it first)

$(READY): $(LOCKED)
	@$(call install_project,.venv)
	@$(call link_package,.venv/links/gudgeon)
	@$(BIN)/python -m compileall -q -j 0 $(addprefix .venv/lib/python3*/site-packages/,$(COMPILED)) modaldb pipeline solver
	@rm -f .venv/ready-*; touch $@
	@echo "set-up: done; $(BIN)/gudgeon --help shows the commands"

# The system libraries come first: without root and without them, nothing is begun.
$(LOCKED):
	@$(check_python)
	@missing="$$($(missing_libraries))"; test -z "$$missing" || { $(install_packages); }; \
	missing="$$($(missing_libraries))"; test -z "$$missing" || { \
	    echo "set-up: gmsh, the pictures and the native core need system packages; install them, then run make again:" \
	        "sudo $(APT_INSTALL) $$missing" >&2; exit 1; }
	@$(call make_environment,.venv,requirements.lock)
	@.venv/bin/python -m docs.tools.prune .venv
	@touch $@

solver-env: $(SOLVER_READY) ## make .venv-solver: the solver and the database alone, without mesher and pictures

$(SOLVER_READY):
	@$(check_python)
	@$(has_compiler) || { echo "set-up: the native core needs a compiler of C++20: sudo $(APT_INSTALL) g++" >&2; exit 1; }
	@test -x .venv-solver/bin/pip || { $(call make_environment,.venv-solver,requirements-solver.lock); }
	@echo '*' > .venv-solver/.gitignore
	@$(call install_project,.venv-solver)
	@touch $@

core: $(LOCKED) ## build the native core after an edit, a few seconds
	@$(call build_core,.venv)

checked: setup ## run tiny scenes of every loop with checked indices and shapes and count their work, a minute
	$(call run_level,checked) $(CORE_CASES)

check-core: checked ## run all tests of the core with checked indices and shapes
	$(call run_level,checked) -n $(WORKERS) --dist loadfile $(CORE_TESTS)

hsds: setup ## start HSDS on this machine, in an environment of its own, and print the variables of its clients
	@test -x .venv-hsds/bin/hsds || { $(PYTHON) -m venv .venv-hsds && .venv-hsds/bin/pip install -q 'hsds>=1.0.2'; }
	@$(BIN)/python -m docs.tools.hsds_server $(ARGS)

demo: setup ## run the piston in its liner from mesh to pictures
	$(BIN)/gudgeon run data/piston

test: browser solver-env ## run the tests, on two cores; `make test WORKERS=8` takes more
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n $(WORKERS) --dist loadfile \
	    --validation-share=0.2

validate: setup ## run all long validations and write docs/validation.md; `make validate ARGS="-k pendulum"` runs some
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n $(WORKERS) --dist loadfile \
	    -m validation --validation-table=docs/validation.md $(ARGS)

verification: setup ## solve every scene whose answer is known and write the verification manual, docs/verification, 6 min of CPU
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m docs.tools.verification $(ARGS)

tutorials: setup ## run the tutorials and renew their outputs and pictures; `make tutorials ARGS=cad-part` runs one
	$(BIN)/python -m docs.tools.tutorials $(ARGS)

calibration: setup ## run 500 random scenes with exact answers and write stated over true errors to docs/calibration.md, 15 min of CPU; what is done is kept
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.calibration --workers $(WORKERS) $(ARGS)

calibration-designs: setup ## run 360 random changes of designs and write stated over true errors of modes from stored ones to docs/design-change.md, 10 min of CPU
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.calibration.designs --write $(ARGS)

mutants: setup ## run the nearest tests of 200 deliberate faults, one at a time; `make mutants ARGS="--only service"` runs some
	$(BIN)/python -m tests.mutants $(ARGS)

browser: setup # After the set-up: apt-get does not run twice at once.
	@for name in $(BROWSERS); do command -v $$name > /dev/null && exit 0; done; \
	missing=chromium; $(install_packages); \
	command -v chromium > /dev/null || \
	    echo "set-up: not installed; the tests of a report's page need: sudo $(APT_INSTALL) chromium"

fuzz: setup ## run the fuzzers at length, an hour; `make fuzz ARGS="records --count 500"` runs one
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -X faulthandler -m tests.fuzz $(ARGS)

lint: setup ## check style and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright

docs: setup ## build the site of the documents, out/site
	$(BIN)/python -m docs.tools.scene_reference
	$(BIN)/python -m docs.tools.api
	$(BIN)/python -m docs.tools.gallery
	$(BIN)/python -m docs.tools.commands
	$(BIN)/python -m docs.tools.notebooks
	$(BIN)/python -m docs.tools.theory_figures
	@$(has_docs) || $(BIN)/python -m pip install -q $(DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build -q --strict -f .mkdocs.yml
	@echo "docs: out/site"

pictures: setup ## run the scenes whose pictures stand in the documents and renew these and their captions, some 20 min of CPU; `make pictures ARGS=stress.png` renews one
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m docs.tools.pictures $(ARGS)

manual: setup browser ## write the theory manual as one PDF, out/theory.pdf
	@$(has_docs) || $(BIN)/python -m pip install -q $(DOCS)
	$(BIN)/python -m docs.tools.theory_manual

wheel: setup ## build the source distribution and a wheel that needs no compiler, out/wheels
	@$(has_release) || $(BIN)/python -m pip install -q $(call extra,release)
	rm -rf out/wheels; mkdir -p out/wheels/raw
	$(BIN)/python -m build -q --no-isolation --outdir out/wheels/raw
	$(BIN)/python -m auditwheel repair --plat auto -w out/wheels out/wheels/raw/*.whl
	mv out/wheels/raw/*.tar.gz out/wheels; rm -rf out/wheels/raw build gudgeon.egg-info

coverage: browser solver-env ## run the tests and list which lines of Python they leave out, a page in out/coverage
	@$(has_release) || $(BIN)/python -m pip install -q $(call extra,release)
	OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n $(WORKERS) --dist loadfile \
	    --validation-share=0.2 --cov=modaldb --cov=pipeline --cov=solver --cov-report=term:skip-covered \
	    --cov-report=html:out/coverage $(ARGS)

bench: setup ## time what the tests only count
	$(BIN)/pytest -o addopts="-q -rs --strict-markers" tests/benchmarks --benchmark-only

bench-peers: setup ## time modes beside scipy, ngsolve, Exudyn, CalculiX; narrow it by `ARGS="--sizes 27k"`
	$(BIN)/python -m tests.benchmarks.modes --peers-python $(PEERS_PYTHON) $(ARGS)

defaults: setup ## compare runs at default settings with converged ones, all scenes and their neighbours, 40 min; what is done is kept, `make defaults ARGS="--minutes 10"` takes less
	$(BIN)/python -m docs.tools.default_accuracy $(ARGS)
	$(BIN)/python -m docs.tools.report_listing out/reports

reports: setup ## write error against run time and robustness cases of every scene to out/reports, timed ones first, and list them in docs/reports; what is done is kept
	@mkdir -p out/reports; rm -f out/reports/seconds.csv; failed=; \
	for command in report robustness; do \
	    for file in $(SCENES); do \
	        name=$$(echo $$file | sed 's,^\(data\|tests/validation/scenes\)/,,; s,/scene\.toml$$,,; s,\.toml$$,,'); \
	        echo "$(BIN)/gudgeon $$command $$file --out out/reports/$$name"; \
	        begun=$$(date +%s); \
	        $(BIN)/gudgeon $$command $$file --out out/reports/$$name > /dev/null || failed="$$failed $$name:$$command"; \
	        echo "$$name,$$command,$$(($$(date +%s) - begun))" >> out/reports/seconds.csv; \
	    done; \
	done; \
	$(BIN)/python -m docs.tools.report_listing out/reports; \
	test -z "$$failed" || { echo "reports: failed:$$failed" >&2; exit 1; }

lock: setup ## pin again what pyproject.toml asks for; `make lock UPGRADE=--upgrade` takes newer versions
	@echo "lock: requirements.lock"
	@$(BIN)/python -c '$(REQUIREMENTS_ALL)' | $(COMPILE) $(UPGRADE) -o requirements.lock -
	@echo "lock: requirements-solver.lock"
	@cp requirements.lock requirements-solver.tmp  # The same versions, and hashes that are known already.
	@$(BIN)/python -c '$(REQUIREMENTS_SOLVER)' | $(COMPILE) -o requirements-solver.tmp -
	@mv requirements-solver.tmp requirements-solver.lock

clean: ## remove the environments and caches; results and the database stay
	rm -rf .venv .venv-solver .venv-hsds .build-core* solver/core/*.so gudgeon.egg-info .pytest_cache .ruff_cache .benchmarks
	find modaldb pipeline solver tests -name __pycache__ -type d -prune -exec rm -rf {} +

help: ## show this list
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/\1|\2/p' Makefile | while IFS='|' read -r name text; do \
	    printf '  make %-12s %s\n' "$$name" "$$text"; done

define check_python
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo "set-up: $(PYTHON) is not Python 3.11 or newer; name one: make PYTHON=python3.11" >&2; exit 1; }; \
	$(PYTHON) -c 'import ensurepip, venv' 2> /dev/null || { \
	    echo "set-up: $(PYTHON) cannot make environments; run: apt-get install python3-venv" >&2; exit 1; }
endef

# $(call make_environment,FOLDER,LOCK FILE). What is not in COMPILED is compiled when first used.
define make_environment
	echo "set-up: making $(1) with $$($(PYTHON) --version)"; \
	rm -rf $(1); \
	$(PYTHON) -m venv $(1); \
	echo "set-up: installing $$(grep -c == $(2)) pinned packages of $(2)"; \
	$(1)/bin/python -m pip install -q --no-compile --require-hashes -r $(2)
endef

# $(call build_core,FOLDER): by the pinned tools of an environment, unless it stands for these sources.
define build_core
	test -e $(CORE_READY) || { \
	    echo "set-up: compiling the native core"; \
	    $(1)/bin/cmake -S solver/core -B .build-core -G Ninja --log-level=WARNING -DCMAKE_BUILD_TYPE=Release \
	        -DCMAKE_MAKE_PROGRAM=$(CURDIR)/$(1)/bin/ninja -DPython_EXECUTABLE=$(CURDIR)/$(1)/bin/python > /dev/null && \
	    $(1)/bin/ninja --quiet -C .build-core && rm -f .build-core/ready-* && touch $(CORE_READY); }
endef

# $(call install_project,FOLDER). setuptools warns of what every editable installation does.
install_project = $(call build_core,$(1)) && echo "set-up: installing gudgeon itself" && \
    PYTHONWARNINGS=ignore $(1)/bin/python -m pip install -q --no-deps --no-build-isolation \
        -C cmake.define.GUDGEON_PREBUILT=ON -e . && rm -rf gudgeon.egg-info build

# $(call link_package,FOLDER): the package as folders of the same names, for type checkers, which follow no import hook.
link_package = rm -rf $(1); mkdir -p $(1); \
    for name in pipeline/gudgeon/__init__.py pipeline/gudgeon/models.py pipeline/gudgeon/py.typed modaldb pipeline solver; do \
        ln -s $(CURDIR)/$$name $(1)/$$(basename $$name); done

# $(call run_level,NAME): pytest with a level of the core that set-up does not build.
run_level = $(BIN)/ninja --quiet -C .build-core _$(1) && \
    OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 GUDGEON_CORE=$(1) $(BIN)/pytest
# What `make checked` runs, and what else runs kernels of the core.
CORE_CASES := tests/solver/test_operations.py tests/solver/test_core.py
CORE_TESTS := tests/solver/integrators tests/solver/contact tests/solver/ports tests/contracts

# Prints the packages of those libraries that cannot be loaded, whatever the system that should have them.
missing_libraries = for pair in $(join $(addsuffix =,$(SONAMES)),$(SYSTEM_LIBRARIES)); do \
    $(PYTHON) -c 'import ctypes, sys; ctypes.CDLL(sys.argv[1])' $${pair%%=*} 2> /dev/null || echo $${pair\#*=}; \
    done | { cat; $(has_compiler) || echo g++; } | xargs
# The core is C++20; CXX names another compiler than the system's.
has_compiler = command -v $${CXX:-c++} > /dev/null

# Tries to install $$missing, by root, or by sudo where it asks for no password; the caller sees whether it did.
define install_packages
	if [ "$$(id -u)" = 0 ]; then as_root=; \
	elif sudo -n true 2> /dev/null; then as_root="sudo -n"; \
	else as_root=false; fi; \
	test "$$as_root" = false || echo "set-up: installing system packages: $$missing"; \
	{ $$as_root apt-get update -qq && \
	  $$as_root env DEBIAN_FRONTEND=noninteractive $(APT_INSTALL) -qq $$missing; } > /dev/null || true
endef

# The extra docs, which the lock files leave out.
has_docs = $(BIN)/python -c 'import material, ziamath' 2> /dev/null
DOCS = $(call extra,docs)
has_release = $(BIN)/python -c 'import auditwheel, build, pytest_cov' 2> /dev/null
# $(call extra,NAME): the packages of an extra, quoted.
extra = $(shell $(BIN)/python -c 'import tomllib; print(*map(repr, tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$(1)"]))')

# Lines by which extras name each other are left out: what they stand for is listed anyway.
REQUIREMENTS := import tomllib; project = tomllib.load(open("pyproject.toml", "rb")); \
    extras = project["project"]["optional-dependencies"]; \
    unlocked = ("peers", "ansys", "docs", "release"); \
    base = project["build-system"]["requires"] + project["project"]["dependencies"]
REQUIREMENTS_ALL := $(REQUIREMENTS); \
    print(*base, *(line for name, extra in extras.items() if name not in unlocked for line in extra \
    if not line.startswith("gudgeon")), sep="\n")
REQUIREMENTS_SOLVER := $(REQUIREMENTS); \
    print(*base, *(line for line in extras["dev"] if line.startswith("pytest>")), sep="\n")
COMPILE = $(BIN)/pip-compile -q --generate-hashes --allow-unsafe --strip-extras --no-emit-options --no-header \
    --no-annotate
