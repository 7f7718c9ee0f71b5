//! How cost grows with points, images, cameras and threads: least times of many repetitions, and the
//! exponent between neighbouring sizes. `cargo bench --bench growth -- --write docs/performance.md`
//! writes the page; NAME limits it to tasks whose names contain it.

use std::fmt::Write;
use std::time::{Duration, Instant};

#[path = "../tests/support/boards.rs"]
mod boards;
#[path = "../tests/support/room.rs"]
mod room;
#[path = "../tests/support/thesis.rs"]
mod thesis;
mod work;

/// Time for one size.
const BUDGET: Duration = Duration::from_millis(600);

fn least_ms(task: &work::Task, size: usize) -> f64 {
    let mut work = (task.prepare)(size);
    let (begin, mut least, mut rounds) = (Instant::now(), f64::INFINITY, 0);
    while rounds < 3 || begin.elapsed() < BUDGET {
        let start = Instant::now();
        work();
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
        rounds += 1;
    }
    least
}

fn table(task: &work::Task) -> String {
    let mut page = format!("## {}\n\n| {} | ms | grows as |\n|---|---|---|\n", task.name, task.of);
    let mut before: Option<(usize, f64)> = None;
    for &size in task.sizes {
        let took = least_ms(task, size);
        let exponent =
            before.map_or(String::new(), |(n, t)| format!("n^{:.2}", (took / t).ln() / (size as f64 / n as f64).ln()));
        writeln!(page, "| {size} | {took:.3} | {exponent} |").expect("a string");
        before = Some((size, took));
    }
    page
}

/// The high-water mark of this process's memory, megabytes.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<f64>().ok()? / 1024.0)
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|l| l.strip_prefix("model name")?.split(": ").nth(1));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {cores} cores", model.unwrap_or("unknown processor"))
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let write = arguments.iter().position(|a| a == "--write").map(|i| arguments[i + 1].clone());
    let named: Vec<&String> = arguments.iter().filter(|a| !a.starts_with("--") && Some(*a) != write.as_ref()).collect();
    let mut page = format!(
        "# How cost grows\n\nLeast times of one call on one thread, in Rust, on {}; images are 16:9. Written by `cargo bench --bench \
         growth -- --write docs/performance.md`; against the peers: [numbers.md](numbers.md).\n",
        processor()
    );
    for task in work::TASKS {
        if named.is_empty() || named.iter().any(|n| task.name.contains(n.as_str())) {
            let rows = table(task);
            print!("\n{rows}");
            page += &format!("\n{rows}");
        }
    }
    if let Some(peak) = peak_memory() {
        page +=
            &format!("\nThe process that made this page, inputs of all sizes among it, took {peak:.0} MB at most.\n");
    }
    if let Some(path) = write {
        std::fs::write(&path, page).unwrap_or_else(|e| panic!("{path}: {e}"));
    }
}
