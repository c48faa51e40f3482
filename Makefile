# Everything a developer runs. Needs Rust; Python of 3.10 or later for the package and for `replay`; cargo-fuzz with a nightly
# toolchain for `fuzz` only.

MODELS ?= $(or $(REGRASP_MODELS),$(abspath ../shared/models))
ifneq ($(wildcard $(MODELS)),)
export REGRASP_MODELS := $(MODELS)
PACKAGES := --package models=$(MODELS)
endif

REGRASP := target/release/regrasp
OUT ?= out

WIDE := $(addprefix scenes/,$(addsuffix .toml,sphere_90x sphere_180z sphere_180x box_90x box_180z box_180x))
TIGHT := $(addprefix scenes/,$(addsuffix .toml,tight_sphere_180z tight_box_90x))
BOXES := $(addprefix scenes/,$(addsuffix .toml,box_90x box_180z box_180x))
ALLEGRO_REQUIRED := $(addprefix scenes/allegro/,$(addsuffix .toml,sphere32_x sphere32_z sphere32_180x cube57_x cube57_y \
  cube57_z cube57_180z cylinder20_x cylinder20_y box_y))
ALLEGRO_STRETCH := $(addprefix scenes/allegro/,$(addsuffix .toml,box_x box_z cube45_x cylinder20_z))
ALLEGRO_MESHES := $(addprefix scenes/allegro/,$(addsuffix .toml,rubiks_x rubiks_z apple_x apple_z can_y))
# Way poses, soft fingers, and fingers that are free while the object moves.
CAMPAIGN := $(WIDE) $(addprefix scenes/,$(addsuffix .toml,cubic soft_pair_roll six_finger_box_90x))
SOFT_AND_COUPLED := scenes/dclaw/soft_sphere32_x.toml scenes/trifinger/soft_cylinder20_z.toml scenes/shadow/sphere32_z.toml
# Roadmaps that are built and asked: sphere, box, and the box with more than a million motions.
ROADMAPS := roadmap_sphere roadmap_box roadmap_million
# Sections of docs/benchmarks.md, in this order; those without a CSV file are left out.
BENCHMARKS := rolling_wide rolling_allegro wide visibility classic improvement allegro_required allegro_stretch allegro_meshes dclaw trifinger shadow $(ROADMAPS)
# Curves of `make growth`, in this order.
GROWTH := fingers triangles obstacles threads
GROWTH_TRIALS ?= 20
QUERIES ?= 1000
ROADMAP_BENCH = --level geometry --queries $(QUERIES) --csv docs/benchmarks/$@.csv --graph docs/benchmarks/$@.json
SEEDS ?= 200
IMPROVEMENT_SEEDS ?= 100
ALLEGRO_SEEDS ?= 20
CLASSIC_SEEDS ?= 20
# Geometry alone, as in the papers: contacts stay where they are while the object moves, no friction is held back, no forces.
PLAIN := --settings docs/benchmarks/plain.json
# Such plans are judged for their geometry.
PLAIN_BENCH := $(PLAIN) --level geometry
ALLEGRO_BENCH = $(PACKAGES) --time-limit 20 --threads 1 --seeds $(ALLEGRO_SEEDS)
SOFT_BENCH = $(PACKAGES) --time-limit 6 --threads 1 --seeds $(ALLEGRO_SEEDS)

.PHONY: all demo gallery test replay replay-tracking test-rust test-python test-page page python bench paper003 growth benchmark-page campaign fuzz fuzz-program docs release $(ROADMAPS)

all: release

release:
	cargo build --release --locked -p regrasp_cli

# Plans a sphere turn, checks it, says what it did, writes $(OUT)/demo.
demo: release
	$(REGRASP) demo -o $(OUT)/demo

# The pictures of README and docs/gallery.md, which has the same commands; those of the Allegro and Shadow hands want the models. The same
# bytes every time.
GALLERY ?= docs/pictures
gallery: release
	mkdir -p $(GALLERY) $(OUT)/gallery
	$(REGRASP) plan scenes/box_90x.toml -o $(OUT)/gallery/box.json
	$(REGRASP) view $(OUT)/gallery/box.json scenes/box_90x.toml --png $(GALLERY)/box.png --width 1200
	$(REGRASP) plan scenes/ellipsoid_obstacle.toml -o $(OUT)/gallery/obstacle.json
	$(REGRASP) view $(OUT)/gallery/obstacle.json scenes/ellipsoid_obstacle.toml --png $(GALLERY)/obstacle.png --width 1200
	$(REGRASP) roadmap build scenes/box_90x.toml $(PLAIN) --places 120 --angle 100 -o $(OUT)/gallery/box.roadmap
	$(REGRASP) roadmap picture $(OUT)/gallery/box.roadmap scenes/box_90x.toml -o $(GALLERY)/roadmap.svg
	$(REGRASP) plan scenes/out_of_reach.toml -o $(OUT)/gallery/none.json --max-work 300000 --failure $(GALLERY)/out-of-reach; test $$? -eq 1
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

test-rust:
	cargo test --locked --workspace

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

test-python: release python
	if [ ! -d $(VENV) ]; then echo "SKIPPED: tests of the Python package"; \
	else REGRASP_CLI=$(CURDIR)/$(REGRASP) $(VENV)/bin/python -m pytest -q; fi

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

# Writes docs/benchmarks.md and docs/benchmarks/. One thread, so that times compare. The two methods of paper 000 draw poses
# uniformly, as the paper does. The suite of paper 000 takes half an hour; cut off and run again, it goes on where it was.
bench: release
	$(REGRASP) bench $(WIDE) --seeds $(SEEDS) --threads 1 --time-limit 20 --csv docs/benchmarks/rolling_wide.csv
	$(REGRASP) bench $(WIDE) $(TIGHT) $(PLAIN_BENCH) --seeds $(SEEDS) --threads 1 --time-limit 20 --csv docs/benchmarks/wide.csv
	$(REGRASP) bench scenes/tight_sphere_180z.toml --method visibility --settings docs/benchmarks/uniform_poses.json --level geometry --seeds $(CLASSIC_SEEDS) --threads 1 --time-limit 60 --csv docs/benchmarks/visibility.csv
	$(REGRASP) bench scenes/tight_sphere_180z.toml --method classic --settings docs/benchmarks/uniform_poses.json --level geometry --seeds $(CLASSIC_SEEDS) --threads 1 --time-limit 60 --csv docs/benchmarks/classic.csv
	$(REGRASP) bench $(BOXES) $(PLAIN_BENCH) --improve 1 --seeds $(IMPROVEMENT_SEEDS) --threads 1 --csv docs/benchmarks/improvement.csv
	$(REGRASP) bench suites/paper000.toml
	$(REGRASP) bench suites/paper004.toml
	$(MAKE) paper003
	$(MAKE) $(ROADMAPS)
	$(MAKE) growth
ifneq ($(PACKAGES),)
	$(REGRASP) bench $(ALLEGRO_REQUIRED) $(ALLEGRO_BENCH) --csv docs/benchmarks/rolling_allegro.csv
	$(REGRASP) bench $(ALLEGRO_REQUIRED) $(PLAIN_BENCH) $(ALLEGRO_BENCH) --csv docs/benchmarks/allegro_required.csv
	$(REGRASP) bench $(ALLEGRO_STRETCH) $(PLAIN_BENCH) $(ALLEGRO_BENCH) --csv docs/benchmarks/allegro_stretch.csv
	$(REGRASP) bench $(ALLEGRO_MESHES) $(PLAIN_BENCH) $(ALLEGRO_BENCH) --csv docs/benchmarks/allegro_meshes.csv
	$(REGRASP) bench $(wildcard scenes/dclaw/soft_*.toml) $(PLAIN_BENCH) $(SOFT_BENCH) --csv docs/benchmarks/dclaw.csv
	$(REGRASP) bench $(wildcard scenes/trifinger/soft_*.toml) $(PLAIN_BENCH) $(SOFT_BENCH) --csv docs/benchmarks/trifinger.csv
	$(REGRASP) bench $(wildcard scenes/shadow/*.toml) $(PLAIN_BENCH) $(ALLEGRO_BENCH) --csv docs/benchmarks/shadow.csv
endif
	$(MAKE) benchmark-page

# Random queries on saved graphs, and the same ones without them; $(OUT) keeps the graphs.
roadmap_sphere roadmap_box: roadmap_%: release
	mkdir -p $(OUT)
	$(REGRASP) roadmap build scenes/$*_90x.toml $(PLAIN) -o $(OUT)/$@.roadmap
	$(REGRASP) roadmap bench $(OUT)/$@.roadmap scenes/$*_90x.toml --single $(QUERIES) $(ROADMAP_BENCH)

roadmap_million: release
	mkdir -p $(OUT)
	$(REGRASP) roadmap build scenes/box_90x.toml $(PLAIN) -o $(OUT)/$@.roadmap --places 1700
	$(REGRASP) roadmap bench $(OUT)/$@.roadmap scenes/box_90x.toml $(ROADMAP_BENCH)

# How loading and planning grow with fingers, triangles, obstacles and threads; minutes. $(OUT) keeps the scenes.
growth: release
	$(REGRASP) growth $(GROWTH) --trials $(GROWTH_TRIALS) -o $(OUT)/growth --results docs/benchmarks/growth
	$(MAKE) benchmark-page

# Tables 4 and 5 of paper 003: scenarios D-1 to D-4, F-1, F-2. Writes docs/benchmarks/paper003; cut off and run again, it goes on
# where it was. PAPER003_SEEDS: at most so many trials per scenario.
PAPER003_SEEDS ?= $(SEEDS)
paper003: release
	$(REGRASP) bench suites/paper003.toml --seeds $(PAPER003_SEEDS)

# docs/benchmarks.md again, from what was measured.
benchmark-page: release
	$(REGRASP) bench --page docs/benchmarks.md --limits docs/benchmarks/limits.json $(wildcard $(BENCHMARKS:%=docs/benchmarks/%.csv) $(ROADMAPS:%=docs/benchmarks/%.json) $(GROWTH:%=docs/benchmarks/growth/%.csv)) suites/*.toml

# Replays in MuJoCo: 50 plans per scene and direction of gravity, with and without feedback of the object's pose; the negative
# controls; friction, mass and speed other than planned; 5 plans of every in-hand scene with gravity as planned. Some 50 minutes.
# Writes docs/benchmarks/replay.
REPLAY := $(addprefix scenes/,$(addsuffix .toml,sphere_90x sphere_180z box_90x))
REPLAY_ALLEGRO := $(addprefix scenes/allegro/,$(addsuffix .toml,sphere32_x cube57_y cube57_z))
# Every in-hand scene that has a plan, gravity as planned.
REPLAY_SCENES := $(filter-out scenes/out_of_reach.toml,$(shell grep -l 'task = "in_hand"' scenes/*.toml))
REPLAY_MODELS := $(shell grep -l 'task = "in_hand"' scenes/allegro/*.toml scenes/shadow/*.toml scenes/dclaw/soft_*.toml scenes/trifinger/soft_*.toml)
SCENE_SEEDS ?= 5
SCENE_WORK ?= 1000000
REPLAY_SEEDS ?= 50
CONTROL_SEEDS ?= 10
SIMULATE = $(VENV)/bin/python -m regrasp.simulate.campaign
replay: python
	[ -d $(VENV) ] || { echo "error: replays need the Python package (see above)" >&2; exit 1; }
	mkdir -p $(OUT)/replay docs/benchmarks/replay
	$(SIMULATE) $(REPLAY) $(if $(PACKAGES),$(REPLAY_ALLEGRO)) $(PACKAGES) --seeds $(REPLAY_SEEDS) -o $(OUT)/replay --name campaign
	$(SIMULATE) $(REPLAY) --gravity down --controllers B,A --variants default,no-rolling,no-margin --seeds $(CONTROL_SEEDS) -o $(OUT)/replay --name controls
	$(SIMULATE) $(REPLAY) --gravity down --friction-scale 0.8,1,1.2 --seeds $(CONTROL_SEEDS) -o $(OUT)/replay --name friction
	$(SIMULATE) $(REPLAY) --gravity down --mass-scale 0.5,1,1.5 --seeds $(CONTROL_SEEDS) -o $(OUT)/replay --name mass
	$(SIMULATE) $(REPLAY) --gravity down --speed 1,2 --seeds $(CONTROL_SEEDS) -o $(OUT)/replay --name speed
	$(SIMULATE) $(REPLAY_SCENES) $(if $(PACKAGES),$(REPLAY_MODELS)) $(PACKAGES) --gravity plan --seeds $(SCENE_SEEDS) --max-work $(SCENE_WORK) -o $(OUT)/replay --name scenes
	cp $(OUT)/replay/*.csv $(OUT)/replay/*.md docs/benchmarks/replay/

# Replays of 20 plans of tracking: as the paper has them; with exact cones, a friction margin and normal forces from 0.5 to
# 20 N; of the wide hand with gaits; of six fingers. Some half an hour. Writes docs/benchmarks/replay.
TRACKING_SEEDS ?= 20
replay-tracking: python
	[ -d $(VENV) ] || { echo "error: replays need the Python package (see above)" >&2; exit 1; }
	mkdir -p $(OUT)/replay-tracking docs/benchmarks/replay
	$(SIMULATE) scenes/football.toml --gravity plan --controllers B,H --seeds $(TRACKING_SEEDS) -o $(OUT)/replay-tracking/paper --name tracking_paper
	$(SIMULATE) scenes/football.toml --gravity plan --controllers B,C2,H --settings docs/benchmarks/tracking_replay.json --seeds $(TRACKING_SEEDS) -o $(OUT)/replay-tracking/football --name tracking
	$(SIMULATE) scenes/tracking_sphere_wide.toml --gravity plan --controllers B,C2,H --settings docs/benchmarks/gaiting_replay.json --seeds $(TRACKING_SEEDS) -o $(OUT)/replay-tracking/gaiting --name gaiting
	$(SIMULATE) scenes/tracking_sphere_six.toml --gravity plan --controllers B,C2,H --settings docs/benchmarks/six_replay.json --seeds $(TRACKING_SEEDS) -o $(OUT)/replay-tracking/six --name tracking_six
	cp $(OUT)/replay-tracking/*/*.csv $(OUT)/replay-tracking/*/*.md docs/benchmarks/replay/

# Slow: same bytes on 1, 2 and 8 threads (100 queries), and the checker against broken and good plans; torsion and couplings
# are broken in plans for real hands.
campaign: release
	$(REGRASP) campaign determinism $(CAMPAIGN) --queries 100 --threads 1,2,8
	$(REGRASP) campaign mutations $(CAMPAIGN) --mutants 100 --good 1000
	$(REGRASP) campaign mutations scenes/six_finger_box_90x.toml scenes/box_180x.toml --settings docs/benchmarks/free_fingers.json --mutants 100 --good 200
ifneq ($(PACKAGES),)
	$(REGRASP) campaign mutations $(SOFT_AND_COUPLED) $(PACKAGES) --mutants 100 --good 300
endif

FUZZ_TARGETS := urdf srdf hand_toml scene_toml stl obj plan_json roadmap
FUZZ_RUNS ?= 1000000
# Inputs go through files: in memory where the system has such a folder.
FUZZ_TMP ?= $(or $(wildcard /dev/shm),/tmp)

# Needs a nightly toolchain and cargo-fuzz (cargo install cargo-fuzz).
fuzz:
	for target in $(FUZZ_TARGETS); do \
	  mkdir -p fuzz/corpus/$$target && cp -n fuzz/seeds/$$target/* fuzz/corpus/$$target/ ; \
	  TMPDIR=$(FUZZ_TMP) cargo +nightly fuzz run --sanitizer none $$target -- -runs=$(FUZZ_RUNS) -max_len=4096 -timeout=30 -rss_limit_mb=1024 || exit 1 ; \
	done

# Broken files of every kind against the whole program, 10 s and 1 GB each. $(OUT)/mutants keeps what went wrong.
FUZZ_PROGRAM_RUNS ?= 20000
FUZZ_PROGRAM_SEED ?= 0
fuzz-program: release
	$(PYTHON) tests/campaigns/mutants.py --runs $(FUZZ_PROGRAM_RUNS) --seed $(FUZZ_PROGRAM_SEED) -o $(OUT)/mutants

docs:
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps
