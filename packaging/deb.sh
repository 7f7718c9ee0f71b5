#!/bin/sh
# Debian packages of an installed tree: libptzcal<ABI>, which programs need, and libptzcal-dev, which
# builds them. Two, so that a machine that only runs programs holds no headers and no archive. The laser
# guard comes with the library that starts it.
#
#     deb.sh TREE LIBDIR ABI VERSION OUTPUT     (TREE: an installation with DESTDIR=TREE, PREFIX=/usr)
#
# Who makes them says so as with Debian's own tools: DEBFULLNAME and DEBEMAIL are the maintainer.
set -eu
tree=$1 libdir=$2 abi=$3 version=$4 output=$5
here=$(cd "$(dirname "$0")/.." && pwd)
architecture=$(dpkg --print-architecture)

package() { # name, section, depends, summary, rest of the description
    folder="$output/$1"
    mkdir -p "$folder/DEBIAN" "$folder/usr/share/doc/$1"
    cat "$here/packaging/copyright" >"$folder/usr/share/doc/$1/copyright"
    gzip -9nc "$here/CHANGELOG.md" >"$folder/usr/share/doc/$1/changelog.gz"
    (cd "$folder" && find usr -type f -exec md5sum {} +) >"$folder/DEBIAN/md5sums"
    cat >"$folder/DEBIAN/control" <<CONTROL
Package: $1
Source: ptzcal
Version: $version
Architecture: $architecture
Maintainer: ${DEBFULLNAME:-ptzcal authors} <${DEBEMAIL:-ptzcal@example.invalid}>
Section: $2
Priority: optional
Depends: $3
Installed-Size: $(du -k -s --apparent-size "$folder/usr" | cut -f 1)
Description: $4
 $5
CONTROL
    chmod -R u+rwX,go+rX,go-w "$folder"
    dpkg-deb --root-owner-group --build "$folder" "$output/$1_${version}_$architecture.deb" >/dev/null
    rm -rf "$folder"
}

rm -rf "$output" && mkdir -p "$output"
runtime="$output/libptzcal$abi" dev="$output/libptzcal-dev"
mkdir -p "$runtime$libdir" "$runtime/DEBIAN" "$dev"
cp -a "$tree/usr" "$dev/"
mv "$dev$libdir/libptzcal.so.$abi" "$dev$libdir/libptzcal.so.$abi.$version" "$runtime$libdir/"
mv "$dev/usr/libexec" "$runtime/usr/"
gzip -9n "$dev/usr/share/man/man3/ptzcal.3"
printf 'libptzcal %s libptzcal%s (>= %s)\n' "$abi" "$abi" "$version" >"$runtime/DEBIAN/shlibs"
# Programs then depend on the version that has all they use, not on the one they were built with.
{
    printf 'libptzcal.so.%s libptzcal%s #MINVER#\n' "$abi" "$abi"
    sed -n 's/^\(ptzcal_[a-z0-9_]*\) \(.*\)/ \1@Base \2/p' "$here/tests/abi/exports.txt"
} >"$runtime/DEBIAN/symbols"
printf 'activate-noawait ldconfig\n' >"$runtime/DEBIAN/triggers"

# The C library that it was built with, at least: the newest symbol version that it asks for.
glibc=$(readelf -VW "$runtime$libdir/libptzcal.so.$abi.$version" | grep -o 'GLIBC_[0-9.]*' | sort -uV | tail -n 1)
package "libptzcal$abi" libs "libc6 (>= ${glibc#GLIBC_}), libgcc-s1" \
    "calibration of surveillance cameras with a PTZ camera and a laser (library)" \
    "Turns a pan-tilt-zoom camera with a laser pointer into a surveying instrument and calibrates fixed cameras with it."
package libptzcal-dev libdevel "libptzcal$abi (= $version)" \
    "calibration of surveillance cameras with a PTZ camera and a laser (development)" \
    "Headers for C and C++17, the archive, pkg-config and CMake files of libptzcal."
ls "$output"
