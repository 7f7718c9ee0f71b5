//! Gives the shared library its soname, by ABI number, and keeps it in memory once loaded: thread-local
//! destructors and signal handlers of a host must never find it gone.

/// PTZCAL_ABI_VERSION of src/capi/version.rs; tests/c_api/exports.rs compares the two.
const ABI: u32 = 1;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux" || os == "android") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libptzcal.so.{ABI}");
        println!("cargo:rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
}
