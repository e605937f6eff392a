# Two commands matter: `make demo` and `make test`.

CARGO ?= cargo
NEXTEST_VERSION := 0.9.143
BIN := target/debug

.PHONY: demo test test-python test-data build lint nextest bench reference clean

# Builds the daemon and simctl, and starts the daemon with the demo robot.
demo: build
	@printf '%s\n' '' \
	  'Starting simd with the demo robot. In another terminal, from this folder:' '' \
	  '  export PATH="$$PWD/$(BIN):$$PATH"' \
	  '  simctl robot list' \
	  '  simctl joint list bench_arm' \
	  '  simctl joint set bench_arm shoulder=0.5' \
	  '  simctl joint watch bench_arm --count 5' '' \
	  'Ctrl-C here stops the daemon.' ''
	@exec $(BIN)/simd --name demo --config tests/assets/demo.toml

build:
	$(CARGO) build --locked -p simd-server -p simd-cli

# Installs what the tests need, and runs every suite.
test: lint nextest test-data build
	$(CARGO) nextest run --locked --workspace
	$(MAKE) --no-print-directory test-python

# The Python client as it is installed, against the daemon that was built.
test-python: target/python-venv/installed
	cd client/python && ../../target/python-venv/bin/pyright --pythonpath ../../target/python-venv/bin/python
	cd client/python && SIMD_BINARY="$${SIMD_BINARY:-$(abspath $(BIN))/simd}" ../../target/python-venv/bin/python -m pytest

PYTHON_CLIENT := $(shell find client/python/src -name '*.py' -not -path '*/proto/*') \
  $(wildcard proto/simd/v1/*.proto client/python/schema/*/*.proto client/python/*.toml client/python/hatch_build.py)

target/python-venv/installed: client/python/requirements.txt $(PYTHON_CLIENT)
	python3 -m venv target/python-venv
	target/python-venv/bin/pip install --quiet --disable-pip-version-check -r client/python/requirements.txt
	target/python-venv/bin/pip install --quiet --disable-pip-version-check --no-deps --force-reinstall ./client/python
	@touch $@

# Robots that others made, for the suites: never committed.
test-data: target/test-venv/installed

target/test-venv/installed: tests/requirements.txt
	python3 -m venv target/test-venv
	target/test-venv/bin/pip install --quiet --disable-pip-version-check -r $<
	@touch $@

nextest:
	@$(CARGO) nextest --version >/dev/null 2>&1 || \
	  $(CARGO) install cargo-nextest --locked --version $(NEXTEST_VERSION)

lint:
	$(CARGO) fmt --all --check
	cd proto && npm install --ignore-scripts --no-audit --no-fund --silent && npx --no-install buf lint
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings

# Figures for this machine: microseconds a step, round trips beside a TCP echo, lateness; then a
# step beside MuJoCo, PyBullet and rapier, with a plot in target/bench.
bench: build
	$(CARGO) bench --locked --profile dev -p simd-tests --bench figures
	python3 -m venv target/bench-venv
	target/bench-venv/bin/pip install --quiet -r tests/benches/requirements.txt
	CARGO="$(CARGO)" target/bench-venv/bin/python tests/benches/peers.py

# Makes the reference figures of the physics suite again.
reference:
	python3 -m venv target/reference-venv
	target/reference-venv/bin/pip install --quiet -r tests/reference/requirements.txt
	target/reference-venv/bin/python tests/reference/make_reference.py
	target/reference-venv/bin/python tests/reference/make_truth.py

clean:
	$(CARGO) clean
