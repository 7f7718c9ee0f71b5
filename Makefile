# What people do with ptzcal; cargo does the work. `make` alone lists the targets.

CARGO ?= cargo
PYTHON ?= python3
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
# Of the guard program of GPIO lasers: the library looks for it in ../libexec beside its own folder.
LIBEXECDIR ?= $(PREFIX)/libexec
DESTDIR ?=

VERSION := $(shell sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
ABI := $(shell sed -n 's/^\#define PTZCAL_ABI_VERSION //p' include/ptzcal.h)
TARGET := $(or $(CARGO_TARGET_DIR),target)
# Frames of local cameras need libclang (with its headers) to build. FEATURES= leaves them out.
LIBCLANG := $(or $(LIBCLANG_PATH),$(wildcard /usr/lib/llvm-*/lib/libclang*.so*),$(shell ldconfig -p 2>/dev/null | grep -m 1 -o 'libclang[-0-9]*\.so.*'))
CLANG_HEADERS := $(wildcard /usr/lib/llvm-*/lib/clang/*/include/stddef.h /usr/lib/clang/*/include/stddef.h)
FEATURES ?= $(if $(and $(LIBCLANG),$(CLANG_HEADERS)),--features v4l2)
# What a program that links libptzcal.a needs besides (rustc --print native-static-libs).
SYSTEM_LIBS := -lgcc_s -lutil -lrt -lpthread -lm -ldl

.PHONY: help demo test fuzz accuracy bench install installcheck wheel wheel-files docs header lint release-abi need-cargo need-cc

help:
	@echo "make demo       scans a simulated room and calibrates cameras; results in target/demo"
	@echo "make test       runs all tests"
	@echo "make accuracy   measures accuracy against bounds and truth; target/accuracy.json"
	@echo "make fuzz       ten million random inputs for every reader of outside bytes"
	@echo "make bench      measures speed, ours and the peers'; target/bench.json"
	@echo "make install    installs library, header, laser guard and ptzcal.pc (PREFIX=$(PREFIX), DESTDIR=)"
	@echo "make wheel      the Python package with the library in it; target/wheels"
	@echo "make docs       the manual and the header's reference as HTML and man page; target/docs"
	@echo "make header     writes include/ptzcal.h anew from src/capi"
	@echo "make lint       formatting and clippy"

need-cargo:
	@command -v $(CARGO) >/dev/null || { echo "cargo is missing: install Rust from https://rustup.rs"; exit 1; }

need-cc: need-cargo
	@command -v $${CC:-cc} >/dev/null || { echo "a C compiler is missing: install gcc or clang, or set CC"; exit 1; }
	@command -v $${CXX:-c++} >/dev/null || { echo "a C++ compiler is missing: install g++ or clang, or set CXX"; exit 1; }

demo: need-cargo
	$(CARGO) run --release $(FEATURES) --example demo

# The C and Python tests are part of it: cargo builds the library and runs them against it.
test: need-cc
	@[ -n '$(FEATURES)' ] || echo 'SKIPPED v4l2:// cameras: libclang is not installed (Debian: apt-get install libclang1-14 libclang-common-14-dev)'
	$(CARGO) test $(FEATURES)

# Ten million inputs for everything that reads bytes from outside.
fuzz: need-cargo
	PTZCAL_FUZZ_INPUTS=$${PTZCAL_FUZZ_INPUTS:-10000000} $(CARGO) test $(FEATURES) fuzz_

accuracy: need-cargo
	$(CARGO) run --release --example accuracy

# Peers that cannot be installed are left out, and named.
bench: need-cargo
	$(CARGO) bench --bench '*'
	$(CARGO) build --release --lib
	@command -v $(PYTHON) >/dev/null || { echo "SKIPPED the peers: $(PYTHON) is not installed"; exit 0; }; \
	set -e; venv="$(TARGET)/bench-venv"; \
	[ -x "$$venv/bin/python" ] || $(PYTHON) -m venv "$$venv"; \
	for package in numpy scipy opencv-python-headless open3d; do \
	  "$$venv/bin/python" -m pip install --quiet --disable-pip-version-check "$$package" || echo "$$package cannot be installed"; \
	done; \
	"$$venv/bin/python" -c 'import numpy' 2>/dev/null || { echo "SKIPPED the peers: NumPy cannot be installed"; exit 0; }; \
	PTZCAL_LIBRARY="$(abspath $(TARGET))/release/libptzcal.so" PYTHONPATH=bindings/python \
	  "$$venv/bin/python" benches/peers/bench.py --out "$(TARGET)/bench.json"

docs:
	@command -v doxygen >/dev/null || { echo "doxygen is missing (Debian: apt-get install doxygen)"; exit 1; }
	mkdir -p $(TARGET)/docs
	PTZCAL_DOCS=$(TARGET)/docs doxygen docs/Doxyfile
	@echo "the manual: $(TARGET)/docs/html/index.html"

header: need-cargo
	PTZCAL_UPDATE_HEADER=1 $(CARGO) test --quiet --test c_api the_header_is_what_the_sources_make

# At a release only: from then on this is the ABI that must be kept.
release-abi: need-cargo
	cp include/ptzcal.h tests/abi/released.h

lint: need-cargo
	@if $(CARGO) fmt --version >/dev/null 2>&1; then $(CARGO) fmt --check; \
	else echo "SKIPPED formatting: rustfmt is not installed (rustup component add rustfmt)"; fi
	@if $(CARGO) clippy --version >/dev/null 2>&1; then $(CARGO) clippy --all-targets $(FEATURES) -- -D warnings; \
	else echo "SKIPPED clippy: it is not installed (rustup component add clippy)"; fi

# The archive is built without link-time optimisation, so that any linker takes it.
install: need-cargo
	$(CARGO) build --release $(FEATURES) --lib --bins
	CARGO_PROFILE_RELEASE_LTO=off $(CARGO) rustc --release $(FEATURES) --lib --crate-type staticlib --target-dir $(TARGET)/archive
	install -d $(DESTDIR)$(LIBDIR)/pkgconfig $(DESTDIR)$(INCLUDEDIR) $(DESTDIR)$(LIBEXECDIR)/ptzcal
	install -m 755 $(TARGET)/release/ptzcal-laser-guard $(DESTDIR)$(LIBEXECDIR)/ptzcal/ptzcal-laser-guard
	install -m 755 $(TARGET)/release/libptzcal.so $(DESTDIR)$(LIBDIR)/libptzcal.so.$(ABI).$(VERSION)
	ln -sf libptzcal.so.$(ABI).$(VERSION) $(DESTDIR)$(LIBDIR)/libptzcal.so.$(ABI)
	ln -sf libptzcal.so.$(ABI) $(DESTDIR)$(LIBDIR)/libptzcal.so
	install -m 644 $(TARGET)/archive/release/libptzcal.a $(DESTDIR)$(LIBDIR)/libptzcal.a
	install -m 644 include/ptzcal.h $(DESTDIR)$(INCLUDEDIR)/ptzcal.h
	@printf '%s\n' 'prefix=$(PREFIX)' 'libdir=$(LIBDIR)' 'includedir=$(INCLUDEDIR)' '' \
	  'Name: ptzcal' \
	  'Description: Calibrates surveillance cameras with a pan-tilt-zoom camera and a laser pointer' \
	  'Version: $(VERSION)' \
	  'Cflags: -I$${includedir}' 'Libs: -L$${libdir} -lptzcal' 'Libs.private: $(SYSTEM_LIBS)' \
	  > $(DESTDIR)$(LIBDIR)/pkgconfig/ptzcal.pc
	@echo "installed libptzcal.so.$(ABI).$(VERSION) in $(DESTDIR)$(LIBDIR)"

# A Python wheel with the library in it: who installs it needs no compiler.
wheel: need-cargo
	$(PYTHON) -m pip wheel --no-deps --wheel-dir $(TARGET)/wheels ./bindings/python

# Builds what goes into the wheel and says where it is (bindings/python/setup.py).
wheel-files: need-cargo
	@$(CARGO) build --release $(FEATURES) --lib --bins 1>&2
	@echo "$(abspath $(TARGET))/release"

# Installs into a scratch folder and builds a C program against it, as its users do.
installcheck: need-cc
	rm -rf $(TARGET)/installcheck
	$(MAKE) --no-print-directory install PREFIX=$(abspath $(TARGET))/installcheck DESTDIR=
	@command -v pkg-config >/dev/null || { echo "SKIPPED building against ptzcal.pc: pkg-config is not installed"; exit 0; }; \
	set -e; cd $(TARGET)/installcheck; export PKG_CONFIG_PATH=$$PWD/lib/pkgconfig; \
	$${CC:-cc} -I$(CURDIR)/tests/c $(CURDIR)/tests/c/versions.c $$(pkg-config --cflags --libs ptzcal) -o shared; \
	LD_LIBRARY_PATH=$$PWD/lib ./shared; \
	$${CC:-cc} -I$(CURDIR)/tests/c $(CURDIR)/tests/c/versions.c $$(pkg-config --cflags ptzcal) lib/libptzcal.a $(SYSTEM_LIBS) -o archive; \
	./archive; \
	echo "installcheck: a C program runs against the installed library, shared and archive"
