# What people do with ptzcal; cargo does the work. `make` alone lists the targets.

CARGO ?= cargo
PYTHON ?= python3
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
# Of the guard program of GPIO lasers: the library looks for it in ../libexec beside its own folder.
LIBEXECDIR ?= $(PREFIX)/libexec
MANDIR ?= $(PREFIX)/share/man
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

# Bytes of the stripped library: installcheck says when it grows beyond.
MAX_SIZE ?= 10000000
STRIP ?= strip
# Where Debian has libraries, and its packages' folder.
MULTIARCH := $(shell dpkg-architecture -qDEB_HOST_MULTIARCH 2>/dev/null || $${CC:-cc} -print-multiarch 2>/dev/null)
DEB := $(TARGET)/deb
AARCH64 := aarch64-unknown-linux-gnu

.PHONY: help demo test test-aarch64 fuzz accuracy bench install install-build install-files installcheck deb wheel wheel-files docs header lint release-abi need-cargo need-cc

help:
	@echo "make demo       scans a simulated room and calibrates cameras; results in target/demo"
	@echo "make test       runs all tests"
	@echo "make test-aarch64  those that differ by processor, on an emulated 64-bit ARM"
	@echo "make accuracy   measures accuracy against bounds and truth; target/accuracy.json"
	@echo "make fuzz       ten million random inputs for every reader of outside bytes"
	@echo "make bench      measures speed, ours and the peers'; target/bench.json"
	@echo "make install    installs libraries, headers, laser guard, ptzcal.pc, CMake package, man page (PREFIX=$(PREFIX), DESTDIR=)"
	@echo "make deb        makes Debian packages; $(DEB)"
	@echo "make installcheck  builds the examples against what was installed, and against the packages"
	@echo "make wheel      the Python package with the library in it; target/wheels"
	@echo "make docs       the manual and the header's reference as HTML and man page; target/docs"
	@echo "make header     writes include/ptzcal.h and bindings/cpp anew from src/capi"
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
	$(CARGO) test $(FEATURES) --no-fail-fast

# What differs by processor, and the numbers that rest on it, as a 64-bit ARM's vectors compute them.
test-aarch64: need-cargo
	@command -v aarch64-linux-gnu-gcc >/dev/null && command -v qemu-aarch64 >/dev/null || \
	  { echo "missing: apt-get install gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user"; exit 1; }
	@rustup target list --installed | grep -q $(AARCH64) || { echo "missing: rustup target add $(AARCH64)"; exit 1; }
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="qemu-aarch64 -L /usr/aarch64-linux-gnu" \
	$(CARGO) test --lib --target $(AARCH64) -- vectors image:: detect:: calibrate:: adjust:: geometry:: planes::

# Ten million inputs for everything that reads bytes from outside.
fuzz: need-cargo
	PTZCAL_FUZZ_INPUTS=$${PTZCAL_FUZZ_INPUTS:-10000000} $(CARGO) test $(FEATURES) fuzz_

accuracy: need-cargo
	$(CARGO) run --release --example accuracy

# Peers that cannot be installed are left out, and named.
bench: need-cc
	$(CARGO) bench --bench '*'
	$(CARGO) build --release --lib
	$${CC:-cc} -O2 -Iinclude benches/calls.c -o $(TARGET)/bench-calls -ldl
	$(TARGET)/bench-calls $(TARGET)/release/libptzcal.so
	@command -v $(PYTHON) >/dev/null || { echo "SKIPPED the peers: $(PYTHON) is not installed"; exit 0; }; \
	set -e; venv="$(TARGET)/bench-venv"; \
	[ -x "$$venv/bin/python" ] || $(PYTHON) -m venv "$$venv"; \
	for package in numpy scipy opencv-python-headless open3d plyfile; do \
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
	PTZCAL_UPDATE_HEADER=1 $(CARGO) test --quiet --test c_api the_cpp_headers_are_what_the_c_header_makes

# At a release only: from then on this is the ABI that must be kept.
release-abi: need-cargo
	cp include/ptzcal.h tests/abi/released.h

lint: need-cargo
	@if $(CARGO) fmt --version >/dev/null 2>&1; then $(CARGO) fmt --check; \
	else echo "SKIPPED formatting: rustfmt is not installed (rustup component add rustfmt)"; fi
	@if $(CARGO) clippy --version >/dev/null 2>&1; then $(CARGO) clippy --all-targets $(FEATURES) -- -D warnings; \
	else echo "SKIPPED clippy: it is not installed (rustup component add clippy)"; fi

install: install-build install-files

# The archive is built without link-time optimisation, so that any linker takes it.
install-build: need-cargo
	$(CARGO) build --release $(FEATURES) --lib --bins
	CARGO_PROFILE_RELEASE_LTO=off $(CARGO) rustc --release $(FEATURES) --lib --crate-type staticlib --target-dir $(TARGET)/archive

# Fills in what packaging/*.in leave open; paths of the CMake package are relative.
FILL = sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@LIBDIR@|$(LIBDIR)|' -e 's|@INCLUDEDIR@|$(INCLUDEDIR)|' \
  -e 's|@VERSION@|$(VERSION)|' -e 's|@ABI@|$(ABI)|' -e 's|@SYSTEM_LIBS@|$(SYSTEM_LIBS)|' \
  -e "s|@INCLUDE_FROM_LIB@|$$(realpath -m --relative-to='$(LIBDIR)' '$(INCLUDEDIR)')|"

# What was built before, without building.
install-files:
	install -d $(DESTDIR)$(LIBDIR)/pkgconfig $(DESTDIR)$(LIBDIR)/cmake/ptzcal $(DESTDIR)$(INCLUDEDIR)/ptzcal \
	  $(DESTDIR)$(LIBEXECDIR)/ptzcal $(DESTDIR)$(MANDIR)/man3
	install -m 755 $(TARGET)/release/ptzcal-laser-guard $(DESTDIR)$(LIBEXECDIR)/ptzcal/ptzcal-laser-guard
	install -m 755 $(TARGET)/release/libptzcal.so $(DESTDIR)$(LIBDIR)/libptzcal.so.$(ABI).$(VERSION)
	@command -v $(STRIP) >/dev/null && $(STRIP) --strip-unneeded $(DESTDIR)$(LIBDIR)/libptzcal.so.$(ABI).$(VERSION) \
	  $(DESTDIR)$(LIBEXECDIR)/ptzcal/ptzcal-laser-guard || echo "SKIPPED stripping: $(STRIP) is not installed"
	ln -sf libptzcal.so.$(ABI).$(VERSION) $(DESTDIR)$(LIBDIR)/libptzcal.so.$(ABI)
	ln -sf libptzcal.so.$(ABI) $(DESTDIR)$(LIBDIR)/libptzcal.so
	install -m 644 $(TARGET)/archive/release/libptzcal.a $(DESTDIR)$(LIBDIR)/libptzcal.a
	install -m 644 include/ptzcal.h bindings/cpp/ptzcal.hpp $(DESTDIR)$(INCLUDEDIR)
	install -m 644 bindings/cpp/ptzcal/*.hpp $(DESTDIR)$(INCLUDEDIR)/ptzcal
	install -m 644 docs/ptzcal.3 $(DESTDIR)$(MANDIR)/man3
	@$(FILL) packaging/ptzcal.pc.in > $(DESTDIR)$(LIBDIR)/pkgconfig/ptzcal.pc
	@for file in ptzcalConfig.cmake ptzcalConfigVersion.cmake; do \
	  $(FILL) packaging/$$file.in > $(DESTDIR)$(LIBDIR)/cmake/ptzcal/$$file; \
	done
	@echo "installed libptzcal.so.$(ABI).$(VERSION) in $(DESTDIR)$(LIBDIR)"

# A Python wheel with the library in it: who installs it needs no compiler.
wheel: need-cargo
	$(PYTHON) -m pip wheel --no-deps --wheel-dir $(TARGET)/wheels ./bindings/python

# Builds what goes into the wheel and says where it is (bindings/python/setup.py).
wheel-files: need-cargo
	@$(CARGO) build --release $(FEATURES) --lib --bins 1>&2
	@echo "$(abspath $(TARGET))/release"

# From the installed tree, without debhelper. Built on the oldest Debian that they shall run on.
deb: install-build
	@command -v dpkg-deb >/dev/null || { echo "SKIPPED Debian packages: dpkg-deb is not installed"; exit 0; }; \
	set -e; rm -rf $(DEB); \
	$(MAKE) --no-print-directory install-files PREFIX=/usr LIBDIR=/usr/lib/$(MULTIARCH) DESTDIR=$(abspath $(DEB))/tree; \
	packaging/deb.sh $(DEB)/tree /usr/lib/$(MULTIARCH) $(ABI) $(VERSION) $(abspath $(DEB))/packages

# Installs into scratch folders, and builds the examples in empty ones, as users do: against the tree of
# make install, and against the packages unpacked into an empty root.
installcheck: need-cc install-build
	rm -rf $(TARGET)/installcheck
	$(MAKE) --no-print-directory install-files PREFIX=$(abspath $(TARGET))/installcheck/prefix DESTDIR=
	MAX_SIZE=$(MAX_SIZE) packaging/check.sh $(abspath $(TARGET))/installcheck/prefix/lib \
	  $(abspath $(TARGET))/installcheck/prefix/include $(CURDIR)/examples $(abspath $(TARGET))/installcheck/user
	$(MAKE) --no-print-directory deb
	@command -v dpkg-deb >/dev/null || exit 0; set -e; root=$(abspath $(TARGET))/installcheck/root; mkdir -p $$root; \
	for package in $(DEB)/packages/*.deb; do dpkg-deb --extract $$package $$root; done; \
	MAX_SIZE=$(MAX_SIZE) packaging/check.sh /usr/lib/$(MULTIARCH) /usr/include $(CURDIR)/examples \
	  $(abspath $(TARGET))/installcheck/package-user $$root
	@command -v $(PYTHON) >/dev/null || { echo "SKIPPED the wheel: $(PYTHON) is not installed"; exit 0; }; \
	rm -rf $(TARGET)/wheels; $(MAKE) --no-print-directory wheel || { echo "SKIPPED the wheel: pip cannot build it"; exit 0; }; \
	packaging/check_wheel.sh $(abspath $(TARGET))/wheels $(abspath $(TARGET))/installcheck/wheel $(CURDIR)/examples $(PYTHON)
