#!/bin/sh
# Builds the examples against an installed ptzcal, in an empty folder, as its users do: with pkg-config,
# with the archive, with CMake. What is not installed here is skipped by name.
#
#     check.sh LIBDIR INCLUDEDIR EXAMPLES EMPTY_FOLDER [ROOT]
#
# ROOT is where a package was unpacked to: LIBDIR and INCLUDEDIR are below it.
set -eu
libdir=$1 includedir=$2 examples=$3 work=$4 root=${5:-}
cc=${CC:-cc} cxx=${CXX:-c++}

# Seconds since the last time; the first hour with a library begins with these.
mark=$(date +%s%N)
seconds() {
    now=$(date +%s%N)
    awk "BEGIN { printf \"%.1f s\", ($now - $mark) / 1e9 }"
    mark=$now
}

# What a program of C and one of C++ say when all is well.
try() {
    "./$1" >"$1.out" || { cat "$1.out"; echo "check: $1 failed"; exit 1; }
    grep -q "$2" "$1.out" || { cat "$1.out"; echo "check: $1 does not say '$2'"; exit 1; }
}

rm -rf "$work" && mkdir -p "$work" && cd "$work"
cp "$examples"/c/calibrate_fixed_camera.c "$examples"/cpp/*.cpp .
export LD_LIBRARY_PATH="$root$libdir"

# The shared library needs what every Linux has.
library=$(readlink -f "$root$libdir/libptzcal.so")
if command -v readelf >/dev/null; then
    others=$(readelf -dW "$library" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' |
        grep -v -e '^libc\.so\.6$' -e '^libm\.so\.6$' -e '^libgcc_s\.so\.1$' -e '^ld-linux' || true)
    [ -z "$others" ] || { echo "check: the library needs $others"; exit 1; }
    readelf -dW "$library" | grep -q "SONAME.*\[$(basename "$(readlink "$root$libdir/libptzcal.so")")\]" ||
        { echo "check: the soname is not what libptzcal.so points at"; exit 1; }
else
    echo "SKIPPED what the library needs: readelf is not installed"
fi
size=$(wc -c <"$library")
[ "$size" -le "${MAX_SIZE:-0}" ] || { echo "check: the library has $size bytes, more than $MAX_SIZE"; exit 1; }

if command -v pkg-config >/dev/null; then
    export PKG_CONFIG_LIBDIR="$root$libdir/pkgconfig" PKG_CONFIG_SYSROOT_DIR="$root"
    seconds >/dev/null
    $cc calibrate_fixed_camera.c $(pkg-config --cflags --libs ptzcal) -lm -o c
    try c 'fixed camera: f 8'
    echo "check: the C example built and ran in $(seconds)"
    $cxx -std=c++17 calibrate_fixed_camera.cpp $(pkg-config --cflags --libs ptzcal) -o cpp
    try cpp 'fixed camera: f 8'
    echo "check: the C++ example built and ran in $(seconds)"
    system=$(sed -n 's/^Libs.private: //p' "$PKG_CONFIG_LIBDIR/ptzcal.pc")
    $cc calibrate_fixed_camera.c $(pkg-config --cflags ptzcal) "$root$libdir/libptzcal.a" $system -o archive
    LD_LIBRARY_PATH= try archive 'fixed camera: f 8'
    unset PKG_CONFIG_LIBDIR PKG_CONFIG_SYSROOT_DIR
    echo "check: C and C++ examples run against the installed library, shared and archive"
else
    echo "SKIPPED building with ptzcal.pc: pkg-config is not installed"
fi

if command -v cmake >/dev/null; then
    cat >CMakeLists.txt <<'CMAKE'
cmake_minimum_required(VERSION 3.13)
project(user C CXX)
find_package(ptzcal 0.1 REQUIRED)
add_executable(with_c calibrate_fixed_camera.c)
target_link_libraries(with_c ptzcal::ptzcal m)
add_executable(with_archive calibrate_fixed_camera.c)
target_link_libraries(with_archive ptzcal::static)
add_executable(with_cpp click_to_point.cpp)
target_compile_features(with_cpp PRIVATE cxx_std_17)
target_link_libraries(with_cpp ptzcal::ptzcal)
find_package(OpenCV QUIET COMPONENTS core imgproc calib3d)
if(OpenCV_FOUND)
  add_executable(with_opencv opencv_frames.cpp)
  target_compile_features(with_opencv PRIVATE cxx_std_17)
  target_link_libraries(with_opencv ptzcal::ptzcal ${OpenCV_LIBS})
endif()
CMAKE
    for wrong in 0.99 1.0; do
        mkdir -p "wrong$wrong"
        printf 'cmake_minimum_required(VERSION 3.13)\nproject(user C)\nfind_package(ptzcal %s REQUIRED)\n' "$wrong" >"wrong$wrong/CMakeLists.txt"
        ! cmake -S "wrong$wrong" -B "wrong$wrong" -Dptzcal_DIR="$root$libdir/cmake/ptzcal" >/dev/null 2>&1 ||
            { echo "check: CMake takes this version for $wrong"; exit 1; }
    done
    { cmake -S . -B build -Dptzcal_DIR="$root$libdir/cmake/ptzcal" && cmake --build build; } >cmake.out 2>&1 ||
        { cat cmake.out; echo "check: the CMake package does not work"; exit 1; }
    cd build
    try with_c 'fixed camera: f 8'
    try with_archive 'fixed camera: f 8'
    try with_cpp 'the head looks there'
    if [ -x with_opencv ]; then try with_opencv 'undistorted 800 x 600'
    else echo "SKIPPED cv::Mat: OpenCV (libopencv-dev) is not installed"; fi
    echo "check: find_package(ptzcal) works, shared and static"
else
    echo "SKIPPED find_package(ptzcal): cmake is not installed"
fi
for file in "$includedir/ptzcal.hpp" "$includedir/ptzcal/opencv.hpp" "${libdir%/lib*}/share/man/man3/ptzcal.3*"; do
    # Unquoted: a package's man page ends with .gz.
    ls $root$file >/dev/null || { echo "check: $file is missing"; exit 1; }
done
