# gnpd: geometry of point clouds as a service. `make help` lists the targets.
BUILD   ?= build
PREFIX  ?= /usr/local
DESTDIR ?=
CC      ?= cc
SAN     ?=
comma   := ,

PKGS_CORE   := openblas
PKGS_PROTO  := jansson zlib libzip
PKGS_SERVER := libmicrohttpd
PKGS_CLIENT := libcurl libpng

# FLANN's and SuiteSparse's pkg-config files name libraries their C interfaces do not need.
LIBS_CORE   := -lflann -lopenblas -lm
LIBS_PROTO   = $(shell pkg-config --libs $(PKGS_PROTO))
LIBS_SERVER  = $(shell pkg-config --libs $(PKGS_SERVER))
LIBS_CLIENT  = $(shell pkg-config --libs $(PKGS_CLIENT))

OPT      ?= -O3
WARN     := -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes
CFLAGS   += -std=c11 -D_GNU_SOURCE $(OPT) -g $(WARN) -fno-math-errno -fno-trapping-math -pthread -MMD -MP
CPPFLAGS += -Icore -Iproto -Iserver -Iclients -Itests
LDFLAGS  += -pthread

# override: a BUILD given on the command line would otherwise win, and nothing be built with the sanitizer.
ifneq ($(SAN),)
override BUILD := $(BUILD)/$(subst $(comma),-,$(SAN))
CFLAGS   += -fsanitize=$(SAN) -fno-omit-frame-pointer -fno-sanitize-recover=all
LDFLAGS  += -fsanitize=$(SAN)
endif
CORE   := $(wildcard core/*.c)
PROTO  := $(wildcard proto/*.c)
SERVER := $(filter-out server/gnpd.c,$(wildcard server/*.c))
CLIENT := $(filter-out clients/gnp.c,$(wildcard clients/*.c))
UNIT   := $(wildcard tests/test_*.c)
object  = $(patsubst %.c,$(BUILD)/%.o,$(1))

PROGRAMS := $(BUILD)/gnpd $(BUILD)/gnp
TESTS    := $(patsubst tests/%.c,$(BUILD)/tests/%,$(UNIT))

.DEFAULT_GOAL := all
.SECONDARY:
.PHONY: all demo test unit check bench validate scans openapi install deps clean help libraries

all: $(PROGRAMS) ## build gnpd (the daemon) and gnp (the command line)

# Names the Debian package that brings what is missing before the compiler stumbles over it.
$(BUILD)/.libraries: deploy/install-deps.sh
	@deploy/install-deps.sh --check build
	@mkdir -p $(@D) && touch $@

$(BUILD)/%.o: %.c | $(BUILD)/.libraries
	@mkdir -p $(@D)
	$(CC) $(CPPFLAGS) $(CFLAGS) -c $< -o $@

$(BUILD)/libgnp.a: $(call object,$(CORE))
	rm -f $@ && $(AR) rcs $@ $^
$(BUILD)/libgnpproto.a: $(call object,$(PROTO))
	rm -f $@ && $(AR) rcs $@ $^
$(BUILD)/libgnpserver.a: $(call object,$(SERVER))
	rm -f $@ && $(AR) rcs $@ $^
$(BUILD)/libgnpclient.a: $(call object,$(CLIENT))
	rm -f $@ && $(AR) rcs $@ $^

LIB_CORE   := $(BUILD)/libgnp.a
LIB_PROTO  := $(BUILD)/libgnpproto.a $(LIB_CORE)
LIB_SERVER := $(BUILD)/libgnpserver.a $(LIB_PROTO)
LIB_CLIENT := $(BUILD)/libgnpclient.a $(LIB_PROTO)

$(BUILD)/gnpd: $(BUILD)/server/gnpd.o $(LIB_SERVER)
	$(CC) $(LDFLAGS) -o $@ $^ $(LIBS_SERVER) $(LIBS_PROTO) $(LIBS_CORE)
$(BUILD)/gnp: $(BUILD)/clients/gnp.o $(LIB_CLIENT)
	$(CC) $(LDFLAGS) -o $@ $^ $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)
$(BUILD)/tests/%: $(BUILD)/tests/%.o $(BUILD)/libgnpserver.a $(BUILD)/libgnpclient.a $(LIB_PROTO)
	$(CC) $(LDFLAGS) -o $@ $^ $(LIBS_SERVER) $(LIBS_CLIENT) $(LIBS_PROTO) $(LIBS_CORE)

unit: $(TESTS) ## build and run the unit tests
	tests/run-unit $(TESTS)

test: all $(TESTS) ## build and run everything; the last line is the count
	tests/run-all $(BUILD)

check: ## the rules of the house that a compiler does not know
	tests/check-house

openapi: $(BUILD)/tests/write_openapi ## write proto/openapi.yaml from the operation table
	$< > proto/openapi.yaml

bench: $(BUILD)/tests/bench ## time the core and write $(BUILD)/bench.json
	$(BUILD)/tests/bench $(BUILD)/bench.json

demo: ## estimate the geometry of 100,000 points over HTTP and draw it (CLOUD=file.ply: your own cloud)
	@BUILD='$(BUILD)' CLOUD='$(CLOUD)' deploy/demo.sh

scans: ## the same for two scanned models, fetched with npm
	@BUILD='$(BUILD)' deploy/scans.sh

deps: ## install the Debian packages that building and testing need
	deploy/install-deps.sh test

install: all ## install to $(DESTDIR)$(PREFIX)
	install -D -m 755 -t $(DESTDIR)$(PREFIX)/bin $(BUILD)/gnpd $(BUILD)/gnp
	install -d $(DESTDIR)$(PREFIX)/share/gnpd/weights
	for f in weights/*.safetensors weights/SHA256SUMS weights/CARD.md; do \
		test ! -f $$f || install -m 644 $$f $(DESTDIR)$(PREFIX)/share/gnpd/weights || exit 1; done
	install -D -m 644 -t $(DESTDIR)$(PREFIX)/share/doc/gnpd $(wildcard README.md) LICENSE

clean: ## remove what was built
	rm -rf $(BUILD)

help: ## this list
	@sed -n 's/^\([a-z]*\):[^#]*## \(.*\)/\1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 12

-include $(shell test -d $(BUILD) && find $(BUILD) -name '*.d' -not -path '$(BUILD)/*-*/*')
