//! `make accuracy`: the figures of the README against truth that nobody tuned to. Prints a table and
//! writes target/accuracy.json. `accuracy quick` takes a tenth of the runs, `accuracy joint` (or
//! another part's name) runs that part alone.

#[path = "../../tests/support/boards.rs"]
mod board;
mod boards;
mod bounds;
#[path = "../../tests/support/data.rs"]
mod data;
#[path = "../../tests/support/edges.rs"]
mod edges;
mod end_to_end;
#[path = "../../tests/support/explore.rs"]
mod exploring;
mod figure;
mod groups;
mod joint;
mod lens;
mod lines;
#[path = "../../tests/support/meva.rs"]
mod meva;
mod model;
mod optimal_design;
mod outliers;
#[path = "../../tests/support/pcd.rs"]
mod pcd;
mod pointing;
mod real;
mod settle;
#[path = "../../tests/support/pointing.rs"]
mod setups;
mod simulated;
mod stations;
mod study;
#[path = "../../tests/support/thesis.rs"]
mod thesis;
mod zoom;
#[path = "../../tests/support/zoom.rs"]
mod zoom_truth;

use std::io::Write;

use figure::Figure;

fn main() -> std::io::Result<()> {
    let quick = std::env::args().any(|a| a == "quick");
    let scale = |runs: usize| if quick { (runs / 10).max(20) } else { runs };
    let mut figures = Vec::new();
    println!("{:<6} {:<68} {:>12} {:>12} {:>8} {:>7}", "goal", "set-up", "measured", "bound", "ratio", "limit");
    let mut report = |new: Vec<Figure>| {
        for f in &new {
            println!(
                "{:<6} {:<68} {:>9.4} {:<2} {:>9.4} {:<2} {:>8.3} {:>7.2} {}",
                f.goal,
                f.setup,
                f.figure,
                f.unit,
                f.bound,
                f.unit,
                f.ratio,
                f.limit,
                if f.met() { "" } else { "MISSED" }
            );
        }
        figures.extend(new);
    };
    let only = std::env::args().skip(1).find(|a| a != "quick");
    let wanted = |part: &str| only.as_deref().is_none_or(|o| o == part);
    if wanted("joint") {
        joint::run(scale(400), &mut report);
    }
    if wanted("simulated") {
        simulated::run(scale(400), &mut report);
    }
    if wanted("boards") {
        boards::run(scale(400), &mut report);
    }
    if wanted("zoom") {
        zoom::run(scale(400), &mut report);
    }
    if wanted("outliers") {
        outliers::run(scale(1000), &mut report);
    }
    if wanted("lines") {
        lines::run(scale(500), &mut report);
    }
    if wanted("model") {
        model::run(scale(400), &mut report);
    }
    if wanted("lens") {
        lens::run(scale(400), &mut report);
    }
    if wanted("study") {
        study::run(scale(400), &mut report);
    }
    if wanted("end_to_end") {
        end_to_end::run(&mut report);
    }
    if wanted("settle") {
        settle::run(scale(500), &mut report);
    }
    if wanted("stations") {
        stations::run(scale(400), &mut report);
    }
    if wanted("pointing") {
        pointing::run(scale(400), &mut report);
    }
    if wanted("real") {
        real::run(&mut report);
    }
    let entries: Vec<serde_json::Value> = figures
        .iter()
        .map(|f| {
            serde_json::json!({
                "goal": f.goal, "setup": f.setup, "figure": f.figure, "unit": f.unit,
                "bound": f.bound, "ratio": f.ratio, "limit": f.limit, "met": f.met(), "runs": f.runs,
            })
        })
        .collect();
    let path = data::target().join("accuracy.json");
    let mut file = std::fs::File::create(&path)?;
    file.write_all(serde_json::to_string_pretty(&entries)?.as_bytes())?;
    let missed = figures.iter().filter(|f| !f.met()).count();
    println!("{} figures, {missed} missed; {}", figures.len(), path.display());
    Ok(())
}
