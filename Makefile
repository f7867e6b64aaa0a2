# The commands of the README. Each does its own set-up.
.PHONY: demo test test-drivers test-validation lint mutants bench msoc-exactness clean
.DEFAULT_GOAL := demo

SHELL := bash
CARGO ?= cargo
OUT := target/demo
# Mesa complains about its absence although nothing here opens a window.
export XDG_RUNTIME_DIR ?= /tmp
RELEASE := target/release
# The bake beside its peers; a workspace of its own, which nothing else compiles.
PEERS := $(CARGO) run --release --target-dir target/peers --manifest-path preprocess/peers/Cargo.toml --

# Bakes a generated city, runs HROC through it, checks every frame against drawing everything.
demo:
	@.ci/vulkan
	$(CARGO) build --release --locked -p hroc-preprocess -p hroc-study
	@mkdir -p $(OUT)
	$(RELEASE)/hroc-bake generate radial-city --scale 0.1 --detail 1 --seed 1 -o $(OUT)/city.glb
	$(RELEASE)/hroc-bake bake $(OUT)/city.glb -o $(OUT)/city.hroc
	set -o pipefail; $(RELEASE)/hroc run $(OUT)/city.hroc --method hroc --mode of --path walk-in --frames 60 --size 640x360 --check \
		--json $(OUT)/city.json --png $(OUT)/city.png --png-frame 20 | tee $(OUT)/city.md
	@echo; echo "picture: $(OUT)/city.png"; echo "table:   $(OUT)/city.md"; echo "data:    $(OUT)/city.json"

test:
	@.ci/vulkan
	$(CARGO) test --workspace --locked --all-targets --no-fail-fast
	$(CARGO) test --workspace --locked --doc

# The tests that cross crates again, on other software drivers than the installed one. Fetched, not installed.
DRIVERS ?= swiftshader lavapipe-backports
test-drivers:
	@.ci/vulkan
	@set -e; for driver in $(DRIVERS); do \
		icd=$$(.ci/fetch-driver $$driver); echo "== on $$driver"; \
		VK_DRIVER_FILES=$$icd VK_ICD_FILENAMES=$$icd $(CARGO) test --locked -p hroc-tests --tests --no-fail-fast; \
	done

# Random cameras under the Khronos validation layer. wgpu hands its messages on only where WGPU_DEBUG is set.
CUTS ?= 10000
test-validation:
	@.ci/vulkan
	@set -e; layer=$$(.ci/fetch-driver validation); \
	WGPU_VALIDATION=1 WGPU_DEBUG=1 VK_LAYER_PATH=$$layer HROC_VALIDATION=1 HROC_CUTS=$(CUTS) \
		$(CARGO) test --locked -p hroc-tests --test random_cuts -- --nocapture

lint:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --workspace --locked --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --locked --no-deps --document-private-items

# Leaves out one safeguard after the other and shows which test notices.
mutants:
	@.ci/vulkan
	$(CARGO) test --locked -p hroc-tests --test mutants -- --nocapture --test-threads=1

bench:
	$(CARGO) bench --locked -p hroc-format -p hroc-preprocess -p hroc-msoc
	@mkdir -p $(OUT)
	$(CARGO) run --release --locked -p hroc-preprocess -- generate radial-city -o $(OUT)/bench.glb
	$(CARGO) run --release --locked -p hroc-preprocess -- bake $(OUT)/bench.glb -o $(OUT)/bench.hroc
	$(PEERS) trees
	$(PEERS) import $(OUT)/bench.glb
	$(PEERS) open $(OUT)/bench.hroc

# Ten million random triangles and queries against the reference. Takes minutes.
msoc-exactness:
	$(CARGO) test --release --locked -p hroc-msoc --test inner -- --ignored --nocapture

clean:
	$(CARGO) clean
