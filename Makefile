# Two commands do everything, set-up included:  make demo  and  make test

# Commands run with the environment of an ordinary user: these variables change what Python, pytest,
# the numerical libraries or the terminal output do, and some machines of developers and of CI set
# them. tests/test_environment.py fails where one of them is set. What the network and a choice of
# libraries need stays: PIP_*, certificates, proxies, DRJIT_LIBLLVM_PATH, CUDA_VISIBLE_DEVICES.
UNSET := \
    PYTHONDONTWRITEBYTECODE PYTHONUNBUFFERED PYTHONPATH PYTHONHOME PYTHONHASHSEED PYTHONOPTIMIZE \
    PYTHONWARNINGS PYTHONSTARTUP PYTHONSAFEPATH PYTHONDEVMODE PYTHONPYCACHEPREFIX PYTEST_ADDOPTS \
    NVPL_BLAS_DEBUG_CPU_TYPE OMP_NUM_THREADS OPENBLAS_NUM_THREADS MKL_NUM_THREADS MPLBACKEND \
    COLUMNS LINES FORCE_COLOR NO_COLOR \
    OPTISENSE_ENGINE
unexport $(UNSET)

PYTHON ?=
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.set-up
BLENDER_PYTHON ?=
BLENDER_VENV := .venv-blender
BLENDER_STAMP := $(BLENDER_VENV)/.set-up
BLENDER ?=
PICTURES ?=
WINDOW_STAMP := .blender-window/.set-up

LOCK := --universal --python-version 3.11 --generate-hashes --no-emit-index-url --upgrade

.PHONY: help setup demo test quick-test lint types import-rules docs docs-as-typed pytest pytest-docs pytest-scoring-pages pytest-rest bare-pytest quick-pytest \
    studio-tests test-blender studio-window-test package-test extension setup-blender \
    browser-tests setup-browser \
    format bench fuzz guided-fuzz kill-tests memory-tests lock clean

help:
	@echo "make demo     press a ball into a GelSight Mini and write the picture and a report"
	@echo "make test     lint, types, import rules, documentation and tests, the Blender extension too"
	@echo "make quick-test     lint and the tests that guard most, in two minutes"
	@echo "make studio-tests   only the tests of the Blender extension"
	@echo "make test-blender   the same on Blender 4.2, 5.0 and 5.1 too, and by mouse and keys in a window"
	@echo "make browser-tests  only the tests of the report pages in Chromium, which is installed for them"
	@echo "make extension      build and validate the Blender extension: dist/optisense_studio.zip"
	@echo "make package-test   build the wheel, install it elsewhere and render with it"
	@echo "make docs     build the documentation as a site, and check its links: site/index.html"
	@echo "make docs-as-typed  type all commands of README and docs as shown, also the long ones (hours)"
	@echo "make bench    measure speed and accuracy (minutes)"
	@echo "make fuzz     look for malformed input that is not refused in words (an hour)"
	@echo "make guided-fuzz    the same, guided by coverage (atheris; Linux on x86-64)"
	@echo "make kill-tests     kill commands at 200 random moments, and give them again (an hour)"
	@echo "make memory-tests   the same work hundreds of times in one process, with its memory (an hour)"
	@echo "make setup    only the set-up: .venv and the libLLVM the renderer needs"
	@echo "make format   let ruff tidy the code"
	@echo "make lock     resolve the dependencies anew into requirements.lock"
	@echo "make clean    remove .venv, caches and the demo's output"

setup: $(STAMP)
	$(if $(filter setup,$(MAKECMDGOALS)),@printf '\nTo use it:\n'; sh scripts/next_steps.sh,@:)

$(STAMP): pyproject.toml requirements.lock requirements-llvm.lock scripts/setup.sh scripts/system.sh
	@PYTHON="$(PYTHON)" sh scripts/setup.sh

demo: setup
	@$(BIN)/optisense render gelsight-mini --contact sphere:1.5@0,0:0.8 --out demo-output
	@printf '\nThat was the demo. What to try next:\n'; sh scripts/next_steps.sh

# Each of these runs whatever becomes of the others, several at a time; a summary at the end says
# what failed. Those that take longest begin first, but for two that render nothing: while they run,
# the process that programs of tests are forks of renders, and compiles kernels that the others load.
CHECKS := pytest-rest types pytest-docs docs pytest-tasks pytest-optics pytest-scoring-pages \
    pytest-search pytest-sensors pytest-pages studio-tests bare-pytest lint import-rules
test: setup
	@MAKE="$(MAKE)" sh scripts/run_checks.sh $(CHECKS)

quick-test: setup
	@MAKE="$(MAKE)" sh scripts/run_checks.sh lint quick-pytest

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup
	$(BIN)/mypy

import-rules: setup
	$(BIN)/lint-imports

docs: setup
	$(BIN)/sphinx-build -q -W --keep-going -c docs -b html . site
	@echo "the documentation: site/index.html"

# The quick commands are typed by the tests; this one types those that take long, too.
docs-as-typed: setup
	$(BIN)/python -m pytest tests/docs -m long -rP -o faulthandler_timeout=36000

pytest: setup
	$(BIN)/python -m pytest

# The same in lots, which `make test` runs side by side. A lot is one process: its folders share
# imports, and the first renderings, which load the kernels.
LOTS := optics pages search sensors tasks
LOT_optics := optics
LOT_pages := browser report paper
LOT_search := search
LOT_sensors := sensors objectives
LOT_tasks := tasks calibration cli

# The pages that score, search and verify take as long as all others, and are a lot of their own.
SCORING_PAGES := datasets light-colours objectives search study-report tasks tolerance verify
SCORING := $(SCORING_PAGES:%="tests/docs/test_docs_as_typed.py::test_a_page_works_as_typed[%]")

pytest-docs: setup
	$(BIN)/python -m pytest tests/docs $(SCORING:%=--deselect %)

pytest-scoring-pages: setup
	$(BIN)/python -m pytest $(SCORING)

pytest-rest: setup
	$(BIN)/python -m pytest --ignore=tests/docs $(foreach lot,$(LOTS),$(LOT_$(lot):%=--ignore=tests/%))

$(LOTS:%=pytest-%): pytest-%: setup
	$(BIN)/python -m pytest $(LOT_$*:%=tests/%)

# What guards most for its time: shapes and design files, light against closed forms, a render from
# start to end, finding objectives, search spaces, and the talk with the engine.
QUICK := tests/test_environment.py tests/test_package.py tests/test_errors.py tests/test_writing.py \
    tests/geometry tests/design tests/sensors/test_every_sensor.py tests/optics/test_llvm.py \
    tests/optics/test_closed_forms.py tests/objectives/test_registry.py tests/search/test_space.py \
    tests/search/test_methods.py tests/cli/test_render.py tests/engine/test_conversation.py
# Without the optional dependencies, as for a user who installed no extra. Other processes have them
# again: what is tested in such ones is left out.
BARE := tests/test_package.py tests/geometry/test_step.py tests/workshop/test_shapes.py \
    tests/workshop/test_moulds.py tests/sensors/from_meshes/test_building.py \
    tests/search/test_executors.py tests/cli/test_export.py tests/cli/test_commands.py
bare-pytest: setup
	PYTHONPATH=tests/helpers $(BIN)/python -m pytest -p without_optional \
	    -k "not TestPool and not loads_only" $(BARE)

quick-pytest: setup
	$(BIN)/python -m pytest -m "not slow" $(QUICK)

setup-blender: $(BLENDER_STAMP)

$(BLENDER_STAMP): requirements-blender.lock scripts/setup_blender.sh scripts/system.sh
	@BLENDER_PYTHON="$(BLENDER_PYTHON)" sh scripts/setup_blender.sh

studio-tests: setup setup-blender
	$(BLENDER_VENV)/bin/python -m pytest tests/studio

# Older and newer Blenders, each in an environment of its own, and the window test.
OTHER_BLENDERS := 4.2 5.0 5.1
test-blender: studio-tests $(OTHER_BLENDERS:%=studio-tests-%) studio-window-test

studio-tests-%: setup .venv-blender-%/.set-up
	.venv-blender-$*/bin/python -m pytest tests/studio

.PRECIOUS: .venv-blender-%/.set-up
.venv-blender-%/.set-up: scripts/setup_blender.sh
	@BLENDER_PYTHON="$(BLENDER_PYTHON)" sh scripts/setup_blender.sh $*

# BLENDER=/path/to/blender takes that one; else one is fetched into .blender-window.
# PICTURES=docs/images/studio keeps a picture of each step.
studio-window-test: setup $(if $(BLENDER),,$(WINDOW_STAMP))
	OPTISENSE_WINDOW_BLENDER="$(or $(BLENDER),.blender-window/blender)" \
	    OPTISENSE_WINDOW_PICTURES="$(PICTURES)" timeout 5400 $(BIN)/python -m pytest tests/window

$(WINDOW_STAMP): scripts/setup_blender_window.sh
	@sh scripts/setup_blender_window.sh

# Part of pytest, too, where a Chromium is installed.
browser-tests: setup setup-browser
	$(BIN)/python -m pytest tests/browser

setup-browser:
	@sh scripts/setup_browser.sh

extension: setup setup-blender
	$(BIN)/optisense studio --zip dist/optisense_studio.zip
	$(BLENDER_VENV)/bin/python scripts/validate_extension.py dist/optisense_studio.zip

package-test: extension
	@sh scripts/package_test.sh

format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Malformed files, texts and requests of every kind, for FUZZ_MINUTES; what was found is kept.
FUZZ_MINUTES := 60
fuzz: setup
	$(BIN)/python -m tests.fuzz --minutes $(FUZZ_MINUTES) --keep fuzz-found

# The same, guided by coverage, for what OptiSense's own code reads. atheris is installed for it.
guided-fuzz: setup
	$(BIN)/pip install --quiet --only-binary :all: --require-hashes --requirement requirements-fuzz.lock
	$(BIN)/python -m tests.fuzz.guided --minutes $(FUZZ_MINUTES) --keep fuzz-found

# Commands that are killed at random moments must leave nothing half and end well when given again.
KILLS := 200
kill-tests: setup
	$(BIN)/python -m tests.kills --kills $(KILLS)

# 500 images, 1,000 scores, 50 designs and 500 rounds of files, each in one process.
memory-tests: setup
	for work in images scores designs files; do $(BIN)/python -m tests.memory $$work || exit 1; done

bench: setup
	$(BIN)/python -m benchmarks

lock:
	uv pip compile pyproject.toml --extra dev $(LOCK) --output-file requirements.lock
	uv pip compile requirements-blender.in $(LOCK) --output-file requirements-blender.lock
	uv pip compile requirements-llvm.in $(LOCK) --output-file requirements-llvm.lock

clean:
	rm -rf $(VENV) $(BLENDER_VENV) $(BLENDER_VENV)-* .blender-window demo-output site build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache
