//! The built library, the C compilers, and commands.

use std::env;
use std::io::Write;
use std::process::{Command, Output};

#[path = "../support/library.rs"]
mod built;
pub use built::{library, root, run};

pub fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Is the tool there? When it is not, says what is left out, past the test runner's capture.
pub fn has(tool: &str, left_out: &str) -> bool {
    let there = Command::new(tool).arg("--version").output().is_ok_and(|o| o.status.success());
    if !there {
        let _ = writeln!(std::io::stderr(), "SKIPPED {left_out}: {tool} is not installed");
    }
    there
}

/// The C compiler (`CC`) or, for C++, the C++ compiler (`CXX`).
pub fn compiler(cpp: bool) -> String {
    let (variable, default) = if cpp { ("CXX", "c++") } else { ("CC", "cc") };
    env::var(variable).unwrap_or(default.to_owned())
}

/// The compiler with the flags that every program here must stand.
pub fn strict(cpp: bool, standard: &str) -> Command {
    let mut command = Command::new(compiler(cpp));
    command.args([&format!("-std={standard}"), "-Wall", "-Wextra", "-pedantic", "-Werror"]);
    command.arg("-I").arg(root().join("include"));
    command
}
