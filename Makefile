# Two commands matter: `make demo` and `make test`.

CARGO ?= cargo
NEXTEST_VERSION := 0.9.143
BIN := target/debug

.PHONY: demo demo-build dist dist-check dist-test release camera vulkan web viewer test test-build test-rust test-python schema python-embedded test-rerun test-ray python-blocking docs test-web test-browsers chromium firefox pairs test-data build lint lint-text clippy clippy-features nextest bench rollouts soak truth wide scenes fuzz reference clean

# Builds the daemon and simctl, and starts the daemon with the demo robot.
demo: demo-build
	@printf '%s\n' '' \
	  'Starting simd with the demo robot. Open http://127.0.0.1:7400/ and drag its slider.' \
	  'In another terminal, from this folder:' '' \
	  '  export PATH="$$PWD/$(BIN):$$PATH"' \
	  '  simctl robot list' \
	  '  simctl joint list bench_arm' \
	  '  simctl joint set bench_arm shoulder=0.5' \
	  '  simctl joint watch bench_arm --count 5' '' \
	  'Ctrl-C here stops the daemon.' ''
	@exec $(BIN)/simd --name demo --config tests/assets/demo.toml

# The daemon and simctl only: `simctl top` prints tables here, since its screen takes 26 crates.
demo-build: viewer
	$(CARGO) build --locked -p simd-server -p simd-cli --no-default-features \
	  --features simd-server/zenoh,simd-server/ros2,simd-cli/zenoh

# All binaries of the workspace: the daemon, simctl and the renderer of cameras.
build: viewer
	$(CARGO) build --locked --workspace --bins

# The renderer of cameras: $(BIN)/simd-camera. It needs a Vulkan driver to run, as `make vulkan` installs one.
camera:
	$(CARGO) build --locked -p simd-camera

# The Rust code of the schema, which is committed. A test fails if it is stale.
schema:
	CARGO_TARGET_DIR=target/schema $(CARGO) run --quiet --locked --manifest-path proto/generate/Cargo.toml

# The viewer, which becomes part of the daemon's binary; rebuilt if its sources changed.
web: client/web/dist/index.html

WEB_SOURCES := $(shell find client/web -type f -not -path '*/node_modules/*' -not -path '*/dist/*' \
  -not -path '*/src/gen/*' -not -path '*/e2e/*' 2>/dev/null) $(wildcard proto/simd/v1/*.proto)

client/web/dist/index.html: client/web/node_modules/.package-lock.json $(WEB_SOURCES)
	cd client/web && npm run build --silent

client/web/node_modules/.package-lock.json: client/web/package-lock.json
	cd client/web && npm ci --ignore-scripts --no-audit --no-fund --silent
	@touch $@

# Builds the viewer if this machine can: a daemon without the viewer has a page of tables in its place.
viewer:
	@if command -v npm >/dev/null 2>&1; then \
	  $(MAKE) --no-print-directory --silent web; \
	else \
	  echo 'npm is not there, so the daemon is built without its viewer: install Node 20 and run make again.'; \
	fi

# Installs the tests' requirements and runs every suite, the cheapest stage first, with a table of seconds at the end.
# Tests that this machine cannot run are left out and named at the end; with CI set nothing is left out.
STAGES ?= lint test-build test-rust test-python+test-web
test:
	@MAKE="$(MAKE)" tests/stages/run.sh $(STAGES)

# Exits with 0 if this machine can run the tests that need something, 1 if they are left out, 2 if that is an error.
CAN = tests/stages/can.sh

# Everything that the suites run, built once: packages chosen by name have other features of their dependencies. It
# includes what two suites need, since they may run at the same time.
test-build: viewer target/python-venv/installed
	$(CARGO) build --locked --workspace --all-targets

test-rust: nextest test-data
	@$(CAN) vulkan; case $$? in \
	  0) $(CARGO) nextest run --locked --workspace ;; \
	  1) $(CARGO) nextest run --locked --workspace -E 'not (binary(daemon) & test(cameras::))' ;; \
	  *) exit 1 ;; esac

# The installed Python client against the built daemon, in two processes because most tests wait.
PYTEST_ARGS ?= -n 2 --dist loadfile
# With bytecode, pytest compiles its tests once and not in each process.
PYTEST = PYTHONDONTWRITEBYTECODE= SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" ../../target/python-venv/bin/python -m pytest $(PYTEST_ARGS)
test-python: python-embedded
	cd client/python && ../../target/python-venv/bin/pyright --pythonpath ../../target/python-venv/bin/python
	cd client/python && $(PYTEST)

# Builds the extension module `simd_embedded` into the place where the Python client's tests find it. It is built with
# the whole workspace, so that it uses the existing build.
python-embedded: target/python-venv/installed
	$(CARGO) build --locked --workspace --all-targets
	cp $(BIN)/libsimd_embedded.so \
	  "$$(target/python-venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/simd_embedded.abi3.so"

PYTHON_CLIENT := $(shell find client/python/src -name '*.py' -not -path '*/proto/*') \
  $(wildcard proto/simd/v1/*.proto client/python/schema/*/*.proto client/python/*.toml client/python/hatch_build.py)

# Rerun's reader on a recording. Its installation takes 0.7 GB, so `make test` does not include it.
test-rerun: target/rerun-venv/installed
	cd client/python && SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" ../../target/rerun-venv/bin/python -m pytest readers

target/rerun-venv/installed: client/python/readers/requirements.txt $(PYTHON_CLIENT)
	python3 -m venv target/rerun-venv
	target/rerun-venv/bin/pip install --quiet --disable-pip-version-check -r client/python/readers/requirements.txt
	target/rerun-venv/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall ./client/python
	@touch $@

# Worlds on a Ray cluster of two nodes on this machine, one of which is killed. Its installation takes 0.5 GB, so
# `make test` does not include it.
RAY_PLATLIB = $$(target/ray-venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))')
test-ray: target/ray-venv/installed
	$(CARGO) build --locked --workspace --all-targets
	cp $(BIN)/libsimd_embedded.so "$(RAY_PLATLIB)/simd_embedded.abi3.so"
	cd client/python && ../../target/ray-venv/bin/python -m pytest cluster

target/ray-venv/installed: client/python/cluster/requirements.txt $(PYTHON_CLIENT)
	python3 -m venv target/ray-venv
	target/ray-venv/bin/pip install --quiet --disable-pip-version-check -r client/python/cluster/requirements.txt
	target/ray-venv/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall ./client/python
	@touch $@

# The blocking Python client, which is generated from the asyncio client and committed.
python-blocking:
	python3 client/python/tools/make_blocking.py

target/python-venv/installed: client/python/requirements.txt $(PYTHON_CLIENT)
	python3 -m venv target/python-venv
	target/python-venv/bin/pip install --quiet --disable-pip-version-check -r client/python/requirements.txt
	target/python-venv/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall ./client/python
	@touch $@

# The documentation as web pages, in target/docs: docs/, the README, the Python client's docstrings and examples. It
# fails on a broken link, a page that is missing in the list, and a reference to an unknown docstring.
docs: target/docs-venv/installed
	NO_MKDOCS_2_WARNING=1 target/docs-venv/bin/mkdocs build --strict --config-file client/python/docs/mkdocs.yml

target/docs-venv/installed: client/python/docs/requirements.txt
	python3 -m venv target/docs-venv
	target/docs-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# The page's unit tests, then the page that the daemon serves, in real browsers. Pictures are written to
# target/screenshots.
test-web: test-data target/python-venv/installed
	@$(CAN) npm; case $$? in \
	  0) $(MAKE) --no-print-directory web && (cd client/web && npm test --silent) && $(MAKE) --no-print-directory test-browsers ;; \
	  1) ;; \
	  *) exit 1 ;; esac

test-browsers:
	@$(CAN) chromium; case $$? in 0) ;; 1) exit 0 ;; *) exit 1 ;; esac; \
	$(CAN) firefox; case $$? in 0) without= ;; 1) without='--exclude firefox*.test.ts' ;; *) exit 1 ;; esac; \
	cd client/web && SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" npm run e2e --silent -- $$without

chromium firefox vulkan:
	@$(CAN) $@

# The page beside PyBullet's and MuJoCo's renderers, robot for robot, for people to compare: pictures in target/pairs,
# the page on the left.
pairs: web chromium target/pairs-venv/installed
	target/pairs-venv/bin/python tests/reference/page_pairs.py
	cd client/web && SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" npm run pairs --silent

target/pairs-venv/installed: tests/reference/peers/requirements.txt
	python3 -m venv target/pairs-venv
	target/pairs-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# Third-party robots for the suites: never committed.
test-data: target/test-venv/installed

target/test-venv/installed: tests/requirements.txt
	python3 -m venv target/test-venv
	target/test-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# Without self-update, and not optimised: it starts programs and waits for them, and compiles in half of the time.
nextest:
	@$(CARGO) nextest --version >/dev/null 2>&1 || \
	  env -u RUSTC_WORKSPACE_WRAPPER $(CARGO) install cargo-nextest --locked --version $(NEXTEST_VERSION) --no-default-features --debug

# Clippy checks all dependencies, which takes as long as half of a build. In CI its driver compiles the workspace in
# place of rustc instead, so that one build does both. It leaves out optimisations of MIR, so no package is built like
# this.
ifdef CI
test-build test-rust python-embedded: export RUSTC_WORKSPACE_WRAPPER = clippy-driver
test-build test-rust python-embedded: export CLIPPY_ARGS = -D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__
lint: clippy-features
else
lint: clippy clippy-features
endif

clippy: lint-text
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

# Builds without Zenoh, ROS 2 and the screen of `simctl top`.
clippy-features: lint-text
	$(CARGO) clippy --locked -p simd-server -p simd-cli -p simd-embedded --no-default-features -- -D warnings

lint-text:
	$(CARGO) fmt --all --check
	@$(CAN) npm; case $$? in \
	  0) cd proto && npm install --ignore-scripts --no-audit --no-fund --silent && npx --no-install buf lint && \
	     if [ -f released.binpb ]; then npx --no-install buf breaking --against released.binpb; fi ;; \
	  1) ;; \
	  *) exit 1 ;; esac

# Figures for this machine:
# * microseconds a step, round trips beside a TCP echo, and lateness;
# * a step beside MuJoCo, PyBullet and rapier, with a plot in target/bench;
# * scans of a lidar beside MuJoCo and PyBullet;
# * accuracy of contacts over time, solved by sweeps, by simd's choice, and by MuJoCo's Newton, with a plot there too.
# The profile is the installed one, so that the figures are those that users get.
bench: test-data viewer
	$(CARGO) build --locked --release --workspace --bins --features simd-tests/jemalloc
	$(CARGO) bench --locked --profile release --workspace --bench figures --features simd-tests/jemalloc
	python3 -m venv target/bench-venv
	target/bench-venv/bin/pip install --quiet -r tests/reference/peers/requirements.txt
	CARGO="$(CARGO)" PROFILE=release FEATURES=simd-tests/jemalloc target/bench-venv/bin/python tests/reference/peers.py
	CARGO="$(CARGO)" PROFILE=release FEATURES=simd-tests/jemalloc target/bench-venv/bin/python tests/reference/lidar_peers.py
	CARGO="$(CARGO)" PROFILE=release FEATURES=simd-tests/jemalloc target/bench-venv/bin/python tests/reference/residual_peers.py

# Rollouts: beside `mujoco.rollout`, as environments beside gymnasium's of MuJoCo, for controllers in real time, and for
# learners. Writes tables, and pictures in target/rollouts, in a quarter of an hour.
ROLLOUT_BENCH = SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" target/rollouts-venv/bin/python client/python/benches
rollouts: build target/rollouts-venv/installed
	$(ROLLOUT_BENCH)/mujoco_rollouts.py
	$(ROLLOUT_BENCH)/learning_env.py --robot cart_pole
	$(ROLLOUT_BENCH)/learning_env.py --robot a1
	$(ROLLOUT_BENCH)/control.py
	$(ROLLOUT_BENCH)/learners.py

target/rollouts-venv/installed: client/python/benches/rollouts_requirements.txt $(PYTHON_CLIENT)
	python3 -m venv target/rollouts-venv
	target/rollouts-venv/bin/pip install --quiet --disable-pip-version-check -r client/python/benches/rollouts_requirements.txt
	target/rollouts-venv/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall ./client/python
	@touch $@

# A daemon in a world that is alone for a fifth of SOAK_MINUTES. Then clients come and go, with a hundred readers on
# every transport and floods of bad requests. Each minute a line shows costs, their growth, and the lateness of steps in
# both phases.
# Fails if a command was lost, a refusal was not counted or anything panicked. From 20 minutes on it also fails if:
# * memory certainly grows by 1 MiB an hour; or
# * p99.9 of the lateness is more than half above the lone world's. It must also be so for the steps beside which a
#   sleeping thread was in time, on the same processor and with a higher priority. Steps beside a late one do not count,
#   since the machine wakes any thread late then.
# SIMD_BINARY names another daemon, such as the daemon of `make dist`. SOAK_PRIORITY is the real-time priority of its
# physics thread (40; 0 is none). SOAK_LOCK=1 locks its memory: locked memory is never given back, so the figure is then
# the peak.
SOAK_MINUTES ?= 60
soak: build
	SOAK_MINUTES=$(SOAK_MINUTES) $(CARGO) bench --locked --profile dev --workspace --bench soak

# simd, MuJoCo and PyBullet against the truth: a report with a table and plots in target/truth.
truth: test-data target/reference-venv/installed
	CARGO="$(CARGO)" target/reference-venv/bin/python tests/reference/truth/report.py

# Larger runs of tests from `make test`, whose numbers are in parentheses:
# * constraints in 300 random worlds (some dozens);
# * a world on one, two and four threads for 100,000 steps (1,600);
# * worlds that are saved and restored for 100,000 steps (8,000);
# * overlapping robots in 300 worlds (10);
# * 2,000 mutations of each file of the fuzzers' corpus (60);
# * each case of a PyBullet script on a daemon too (the first ones), programs that end four at a time (one), examples
#   that learn until they can (a fifth of it), are interrupted or run beside others (some of them), and benches (none).
wide: python-embedded
	EQUAL_STEPS=100000 THREADED_STEPS=100000 CONSTRAINED_WORLDS=300 OVERLAPPING_WORLDS=300 $(CARGO) test --locked --workspace \
	  --test physics -- --nocapture threads:: constraints::random_trees contradictions:: constraint_attacks:: long_runs put_into_each_other
	SIMD_MUTATIONS=2000 $(CARGO) test --locked --workspace --test mutations --test saved_state_numbers --test query_numbers
	cd client/python && SIMD_WIDE=1 $(PYTEST) tests/pybullet_module tests/test_exit.py tests/test_examples.py tests/test_benches.py

# Scenes with contact in simd beside MuJoCo: a picture of each and a table in target/scenes.
scenes: test-data target/reference-venv/installed
	CARGO="$(CARGO)" target/reference-venv/bin/python tests/reference/truth/scenes_report.py

# Fuzzes each target for FUZZ_SECONDS. Crashes are written to tests/fuzz/libfuzzer/artifacts. A fixed one is added to
# tests/fuzz/corpus, which `make test` replays. libFuzzer's instrumentation is a nightly flag.
FUZZ_SECONDS ?= 60
FUZZ_VERSION := 0.13.2
FUZZ_TARGETS ?= urdf sdf mjcf stl obj collada gltf looks msh heights_png heights_csv paths xacro
fuzz:
	@$(CARGO) fuzz --version >/dev/null 2>&1 || \
	  $(CARGO) install cargo-fuzz --locked --version $(FUZZ_VERSION)
	@for target in $(FUZZ_TARGETS); do \
	  mkdir -p tests/fuzz/libfuzzer/found/$$target tests/fuzz/corpus/$$target && \
	  RUSTC_BOOTSTRAP=1 $(CARGO) fuzz run --fuzz-dir tests/fuzz/libfuzzer $$target \
	    tests/fuzz/libfuzzer/found/$$target tests/fuzz/corpus/$$target -- \
	    -max_total_time=$(FUZZ_SECONDS) -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 || exit 1; \
	done

# Packages in dist/: archives, a Debian package, Python wheels. The build takes long: it is optimised over all crates.
# It covers the whole workspace, so that dependencies have the tests' features and are built once for both.
dist: web
	SIMD_REQUIRE_VIEWER=1 $(CARGO) build --locked --profile dist --workspace --bins --features simd-server/jemalloc
	SIMD_REQUIRE_VIEWER=1 $(CARGO) build --locked --profile dist -p simd-embedded
	python3 server/packaging/dist.py

# Commits VERSION, for instance 0.2.0, and writes all packages of it, a bill of materials, checksums and notes to dist/.
# It publishes nothing: it prints the commands that do.
release: target/release-venv/installed
	target/release-venv/bin/python server/packaging/make_release.py $(VERSION)

target/release-venv/installed: server/packaging/requirements.txt
	python3 -m venv target/release-venv
	target/release-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

# Installs each package on an empty system, and does the main job there. It runs as root, for mmdebstrap and chroot.
dist-check: dist
	@command -v mmdebstrap >/dev/null 2>&1 || \
	  (apt-get update -qq && apt-get install -y -qq --no-install-recommends mmdebstrap)
	python3 server/packaging/check.py

# The API suite against the installed build of the daemon, and the suite of the programs against the packaged ones.
dist-test: dist
	SIMD_BINARY="$(abspath $(or $(CARGO_TARGET_DIR),target))/dist/simd" \
	  $(CARGO) nextest run --locked --workspace --features simd-server/jemalloc --cargo-profile dist --test api --test daemon

# Makes the reference figures of the physics suite again.
reference: target/reference-venv/installed
	target/reference-venv/bin/python tests/reference/make_reference.py
	target/reference-venv/bin/python tests/reference/make_ball_joints.py
	target/reference-venv/bin/python tests/reference/make_truth.py
	target/reference-venv/bin/python tests/reference/sensors.py
	target/reference-venv/bin/python tests/reference/make_kinematics.py
	target/reference-venv/bin/python tests/reference/make_scenes.py

target/reference-venv/installed: tests/reference/requirements.txt
	python3 -m venv target/reference-venv
	target/reference-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

clean:
	$(CARGO) clean
