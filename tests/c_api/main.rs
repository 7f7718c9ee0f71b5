//! The C side of the library: how the header is made, and the checks that keep the ABI.
//!
//! A new verb needs a chapter in header.rs, its struct in layout.rs, a fixture in
//! tests/c/fixtures.h, its names in tests/abi/exports.txt and a program in tests/c; every check
//! that forgot one of them fails and says so.

mod abi_diff;
mod cpp;
#[path = "../support/data.rs"]
mod data;
mod declarations;
mod examples;
mod exports;
mod header;
mod hostile;
mod layout;
mod programs;
mod tools;
