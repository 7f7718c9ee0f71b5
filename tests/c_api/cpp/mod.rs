//! bindings/cpp/ptzcal: constants.hpp and api.hpp are made from the C header, and every function of
//! the header has its counterpart.
//!
//! The header is regular: names say what a function belongs to, comments say how long arrays are. So
//! the C++ API is one translation of it, and a new function comes with its counterpart; what has
//! callbacks is written by hand (`HAND` in functions.rs, bindings/cpp/ptzcal/devices.hpp).

mod api;
mod bodies;
mod constants;
mod functions;
mod lengths;
mod programs;

use std::fs;
use std::path::PathBuf;

use super::{declarations, header};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("bindings/cpp/ptzcal")
}

/// (file, content) of what is made.
fn made() -> [(&'static str, String); 2] {
    let text = header::text();
    let found = declarations::parse(&text);
    [("constants.hpp", constants::write(&text)), ("api.hpp", api::write(&found, &text))]
}

/// `PTZCAL_UPDATE_HEADER=1 cargo test --test c_api cpp` writes them anew.
#[test]
fn the_cpp_headers_are_what_the_c_header_makes() {
    for (name, made) in made() {
        let path = folder().join(name);
        if std::env::var_os("PTZCAL_UPDATE_HEADER").is_some() {
            fs::write(&path, &made).unwrap();
        }
        let committed = fs::read_to_string(&path).unwrap_or_default();
        let line = made.lines().zip(committed.lines()).position(|(a, b)| a != b).map_or(0, |i| i + 1);
        assert!(made == committed, "{name} differs from include/ptzcal.h from line {line}: run `make header`");
    }
}

#[test]
fn every_function_is_called_from_cpp() {
    let files = fs::read_dir(folder()).unwrap().map(|e| fs::read_to_string(e.unwrap().path()).unwrap());
    let code: String = files.map(|text| without_comments(&text)).collect();
    for function in declarations::read().functions {
        let name = &function.name;
        let used = [format!("{name}("), format!("{name}>")].iter().any(|call| code.contains(call));
        assert!(used, "{name} has no counterpart in bindings/cpp");
    }
}

fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap().to_owned() + "\n").collect()
}
