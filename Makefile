# What a developer runs every day. Needs Rust; Python of 3.10 or later for the package; mdbook for the book. Experiments that take
# minutes to hours are tasks of `cargo xtask`.

MODELS ?= $(or $(REGRASP_MODELS),$(abspath ../shared/models))
ifneq ($(wildcard $(MODELS)),)
export REGRASP_MODELS := $(MODELS)
PACKAGES := --package models=$(MODELS)
endif

REGRASP := target/release/regrasp
OUT ?= out
PLAIN := --settings docs/benchmarks/plain.json

.PHONY: all bench-grasps demo gallery test test-rust test-python test-ray test-page page python docs book reference release

all: release

release:
	cargo build --release --locked -p regrasp_cli

# Plans a sphere turn, checks it, says what it did, writes $(OUT)/demo.
demo: release
	$(REGRASP) demo -o $(OUT)/demo

# Lists of grasps of real hands and objects: out/grasps/grasps.md.
bench-grasps:
	cargo xtask bench-grasps

# The pictures of README and docs/gallery.md, which has the same commands; those of the Allegro and Shadow hands want the models. The same
# bytes every time.
GALLERY ?= docs/pictures
gallery: release
	mkdir -p $(GALLERY) $(OUT)/gallery
	$(REGRASP) plan scenes/box_90x.toml -o $(OUT)/gallery/box.json
	$(REGRASP) view $(OUT)/gallery/box.json scenes/box_90x.toml --png $(GALLERY)/box.png --width 1200
	$(REGRASP) plan scenes/ellipsoid_obstacle.toml -o $(OUT)/gallery/obstacle.json
	$(REGRASP) view $(OUT)/gallery/obstacle.json scenes/ellipsoid_obstacle.toml --png $(GALLERY)/obstacle.png --width 1200
	$(REGRASP) plan scenes/two_arms/justin_horse.toml --seed 3 -o $(OUT)/gallery/hand_over.json
	$(REGRASP) view $(OUT)/gallery/hand_over.json scenes/two_arms/justin_horse.toml --png $(GALLERY)/hand-over.png --frames 8 --width 1400
	$(REGRASP) roadmap build scenes/box_90x.toml $(PLAIN) --places 120 --angle 100 -o $(OUT)/gallery/box.roadmap
	$(REGRASP) roadmap picture $(OUT)/gallery/box.roadmap scenes/box_90x.toml -o $(GALLERY)/roadmap.svg
	$(REGRASP) plan scenes/out_of_reach.toml -o $(OUT)/gallery/none.json --max-work 300000 --failure $(GALLERY)/out-of-reach; test $$? -eq 1
	$(REGRASP) plan scenes/two_arms/impossible_place.toml -o $(OUT)/gallery/none.json --failure $(GALLERY)/impossible-place; test $$? -eq 1
	$(REGRASP) plan scenes/two_arms/impossible_double_grasp.toml -o $(OUT)/gallery/none.json --failure $(GALLERY)/impossible-double-grasp; test $$? -eq 1
ifneq ($(PACKAGES),)
	$(REGRASP) plan scenes/allegro/cube57_z.toml $(PACKAGES) --seed 1 -o $(OUT)/gallery/cube.json
	$(REGRASP) view $(OUT)/gallery/cube.json scenes/allegro/cube57_z.toml $(PACKAGES) --png $(GALLERY)/allegro-cube.png --frames 8 --width 1400 --svg $(GALLERY)/allegro-cube
	$(REGRASP) plan scenes/allegro/apple_z.toml $(PACKAGES) -o $(OUT)/gallery/apple.json
	$(REGRASP) view $(OUT)/gallery/apple.json scenes/allegro/apple_z.toml $(PACKAGES) --png $(GALLERY)/allegro-apple.png --frames 8 --width 1300
	$(REGRASP) plan scenes/shadow/sphere32_z.toml $(PACKAGES) -o $(OUT)/gallery/shadow.json
	$(REGRASP) view $(OUT)/gallery/shadow.json scenes/shadow/sphere32_z.toml $(PACKAGES) --png $(GALLERY)/shadow-sphere.png --frames 4 --width 1400
else
	@echo "SKIPPED: pictures of the Allegro and Shadow hands (no models)"
endif

test: test-rust test-python test-page

# In the profile of what ships: with `make release` and `make python` all is compiled once.
test-rust:
	cargo test --release --locked --workspace

# A fresh virtual environment with the package, installed by pip as users do. The build finds the crates compiled that
# `make release` compiled. Says SKIPPED, and leaves no environment, where there is no Python of 3.10 or later, or where pip finds
# nothing to install; a package that does not build is an error.
PYTHON ?= python3
VENV := target/python
python:
	rm -rf $(VENV)
	if ! $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then \
	  echo "SKIPPED: no Python of 3.10 or later ($(PYTHON))"; \
	elif ! { $(PYTHON) -m venv $(VENV) && $(VENV)/bin/pip install -q -r python/requirements-ci.txt; }; then \
	  echo "SKIPPED: pip cannot install python/requirements-ci.txt"; rm -rf $(VENV); \
	else \
	  PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(VENV)/bin/pip install -q --no-build-isolation --no-deps . ; \
	fi

# A test on each core, four at most: some search on several threads themselves.
PYTEST_WORKERS := -n auto --maxprocesses 4 --dist worksteal
test-python: release python
	if [ ! -d $(VENV) ]; then echo "SKIPPED: tests of the Python package"; \
	else REGRASP_CLI=$(CURDIR)/$(REGRASP) $(VENV)/bin/python -m pytest -q $(PYTEST_WORKERS); fi

# Data sets on Ray, in an environment that has it: `pip install ray`. Says SKIPPED where Ray is absent.
test-ray:
	if [ ! -d $(VENV) ]; then echo "SKIPPED: no environment (make python)"; \
	else $(VENV)/bin/python -m pytest -q -rs python/tests/test_dataset_ray.py; fi

# The page of `regrasp view`: its script and style are committed, so that cargo needs no npm.
PAGE := crates/regrasp_viewer/page
page: $(PAGE)/node_modules
	cd $(PAGE) && npm run --silent build

$(PAGE)/node_modules: $(PAGE)/package-lock.json
	cd $(PAGE) && npm ci --silent && touch node_modules

# Says SKIPPED where there is no npm, where it cannot install, or no Chromium (CHROMIUM names one that is not /usr/bin/chromium).
test-page:
	@if ! command -v npm >/dev/null; then echo "SKIPPED: no npm: tests of the page"; \
	elif ! $(MAKE) --no-print-directory $(PAGE)/node_modules; then echo "SKIPPED: npm cannot install: tests of the page"; \
	else cd $(PAGE) && npm run --silent check && npm test --silent; fi

docs:
	RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --workspace --no-deps

# The generated pages and the figures of the book.
reference:
	cargo xtask reference
	$(PYTHON) docs/concepts/figures/draw.py

# The book, in target/book. Fails at a warning, at a dead link, and where a generated page or figure is out of date. MDBOOK names the
# program: cargo install mdbook --version $(MDBOOK_VERSION) --locked.
MDBOOK ?= mdbook
MDBOOK_VERSION := 0.5.4
book:
	@$(MDBOOK) --version | grep -qx "mdbook v$(MDBOOK_VERSION)" || { echo "error: needs mdbook $(MDBOOK_VERSION): cargo install mdbook --version $(MDBOOK_VERSION) --locked" >&2; exit 1; }
	cargo xtask reference --check
	$(PYTHON) docs/concepts/figures/draw.py --check
	cargo test --quiet --release --locked -p xtask
	@mkdir -p target
	$(MDBOOK) build 2>&1 | tee target/book.log
	@! grep -E "WARN|ERROR" target/book.log
