# make run: the main job.  make test: every check.  make docs: the documentation site.
# make bench: speed, as ratios.  make coverage: what the tests run.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= results
SITE := docs/conf.py docs/_sphinx docs/own

# Commands that tests start would else compile what they import, each anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test check suite site docs coverage bench pictures clean

run: $(VENV)/.installed
	@echo "The published study, some minutes:"
	$(BIN)/flexspine study --out $(OUT)
	@echo "Look at $(OUT)/verdicts.md and $(OUT)/peak_grf_over_speed.png"

# Two at once, as neither keeps two cores busy alone.
test: $(VENV)/.installed-check
	$(MAKE) --jobs 2 --no-print-directory check $(VENV)/.installed-dev
	$(MAKE) --jobs 2 --no-print-directory suite site

# flexspine itself is installed anew meanwhile.
check: export PYTHONPATH := src
check: $(VENV)/.installed-check
	$(BIN)/ruff check src tests benchmarks examples $(SITE)
	$(BIN)/ruff format --check src tests benchmarks examples $(SITE)
	$(BIN)/mypy --num-workers auto
	$(BIN)/lint-imports

suite: $(VENV)/.installed-dev
	$(BIN)/pytest -n auto --dist loadfile

# With the compiled code of the tests.
site: export FLEXSPINE_OPTIMIZATION := 0
site: export FLEXSPINE_CACHE_DIR := $(CURDIR)/.pytest_cache/d/compiled
site: docs

# Runs its examples and pages of code; fails on any warning, such as a broken link.
docs: $(VENV)/.installed-dev
	$(BIN)/sphinx-build -j auto -W --keep-going -q -b html -d docs/_build/read docs docs/_build/html
	$(BIN)/sphinx-build -j auto -W --keep-going -q -b doctest -d docs/_build/read docs docs/_build/doctest
	@echo "Open docs/_build/html/index.html"

# How much of the library the tests run, by line and branch; takes half as long again as they do.
coverage: $(VENV)/.installed-dev
	$(BIN)/pytest -n auto --dist loadfile --cov --cov-report=term

bench: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks

# The pictures of the README and of docs/.
pictures: $(VENV)/.installed
	$(BIN)/flexspine bound --strides 2 --out $(OUT)/pictures
	$(BIN)/flexspine study --out $(OUT)/pictures/study
	$(BIN)/flexspine basin --out $(OUT)/pictures/basin
	$(BIN)/flexspine map --out $(OUT)/pictures/map
	$(BIN)/flexspine trot --seconds 3.2 --out $(OUT)/pictures/trot
	mkdir -p docs/images
	$(BIN)/python -c "from flexspine import load_robot, plot_coordinates as p; p(load_robot('sc618')).savefig('docs/images/sc618_coordinates.png')"
	cp $(OUT)/pictures/figure.png $(OUT)/pictures/strip.png $(OUT)/pictures/animation.gif docs/images/
	cp $(OUT)/pictures/study/peak_grf_over_speed.png $(OUT)/pictures/study/damping.png docs/images/
	cp $(OUT)/pictures/trot/figure.png docs/images/trot.png
	cp $(OUT)/pictures/trot/animation.gif docs/images/trot.gif
	cp $(OUT)/pictures/basin/basin.png $(OUT)/pictures/map/map.png docs/images/

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --editable '.[engine]'
	touch $@

# What is never imported need not be compiled.
$(VENV)/.installed-check: $(VENV)/bin/python pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[check]'
	touch $@

$(VENV)/.installed-dev: $(VENV)/.installed-check
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[dev]'
	touch $@ $(VENV)/.installed

clean:
	rm -rf $(VENV) results docs/_build docs/gallery docs/reference .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
