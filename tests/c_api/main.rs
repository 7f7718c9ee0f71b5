//! The C side of the library: how the header is made, and the checks that keep the ABI.

mod header;
