//! The section of a scan: what was fired at, who saw it, and why not.

use super::page::{counted, escape, figure, table, thinned, thinned_note, verdict};
use crate::draw::chart::{Axis, Chart, Mark, Series};
use crate::rig::{Miss, Scan, ScanEnd, Shot, Sighting};

/// Dots of one figure.
const MOST: usize = 4000;
/// Share of shots that may be ambiguous before lights and mirrors are to be looked for.
const AMBIGUOUS: f64 = 0.05;
/// Share of shots that the head camera should see.
const SEEN: f64 = 0.5;

const MISSES: [(Miss, &str); 5] = [
    (Miss::NotFound, "no spot"),
    (Miss::Ambiguous, "several candidates"),
    (Miss::OffEpipolarLine, "a reflection"),
    (Miss::OffPrediction, "not where it must be"),
    (Miss::OutsideView, "outside the view"),
];

pub fn section(name: &str, scan: &Scan) -> String {
    let shots = &scan.shots;
    let mut html = format!("<section><h2>{}</h2>\n", escape(name));
    html += &verdict(&warnings(scan), "Every position was taken.");
    let r = &scan.region;
    html += &format!(
        "<p>{} of {} positions, pan {:.2} to {:.2}&deg; in {}, tilt {:.2} to {:.2}&deg; in {}{}.</p>\n",
        shots.len(),
        r.len(),
        r.pan[0].to_degrees(),
        r.pan[1].to_degrees(),
        counted(r.pan_steps as usize, "step"),
        r.tilt[0].to_degrees(),
        r.tilt[1].to_degrees(),
        counted(r.tilt_steps as usize, "step"),
        if scan.resumed > 0 {
            format!("; {} came from the journal", counted(scan.resumed, "shot"))
        } else {
            String::new()
        }
    );
    let row = |eye: Eye| {
        let missed = |miss: Miss| shots.iter().filter(|s| eye.seen(s) == Err(miss)).count().to_string();
        let found = shots.iter().filter(|s| eye.seen(s).is_ok()).count();
        let cells = [eye.name(), found.to_string()];
        cells.into_iter().chain(MISSES.iter().map(|(miss, _)| missed(*miss))).collect::<Vec<String>>()
    };
    let rows: Vec<Vec<String>> = eyes(scan).map(row).collect();
    let head: Vec<&str> = ["camera", "spots"].into_iter().chain(MISSES.iter().map(|(_, words)| *words)).collect();
    html += &table(&head, &rows, 1);
    html += "<div class=\"figures\">\n";
    for eye in eyes(scan) {
        html += &map(eye, shots);
    }
    html += &depths(scan);
    html + "</div></section>\n"
}

/// The head camera, or a fixed one by its number.
#[derive(Clone, Copy)]
struct Eye(Option<usize>);

impl Eye {
    fn name(self) -> String {
        self.0.map_or_else(|| "head".into(), |camera| format!("fixed {camera}"))
    }

    fn seen(self, shot: &Shot) -> Sighting {
        match self.0 {
            None => shot.head,
            Some(camera) => shot.fixed.get(camera).copied().unwrap_or(Err(Miss::NotFound)),
        }
    }
}

fn eyes(scan: &Scan) -> impl Iterator<Item = Eye> {
    std::iter::once(Eye(None)).chain((0..scan.fixed_sizes.len()).map(|camera| Eye(Some(camera))))
}

fn warnings(scan: &Scan) -> Vec<String> {
    let mut warnings = Vec::new();
    match &scan.end {
        ScanEnd::Complete | ScanEnd::TargetMet => {}
        ScanEnd::Stopped => warnings.push("the scan was stopped before its end".into()),
        ScanEnd::Cancelled => warnings.push("the scan was cancelled before its end".into()),
        ScanEnd::Failed(error) => warnings.push(format!("the scan failed: {error}")),
    }
    if let Some(repair) = &scan.repair {
        warnings.push(format!("the journal was damaged and mended: {repair:?}"));
    }
    let shots = scan.shots.len().max(1) as f64;
    for eye in eyes(scan) {
        let share =
            |wanted: fn(&Sighting) -> bool| scan.shots.iter().filter(|s| wanted(&eye.seen(s))).count() as f64 / shots;
        let ambiguous = share(|s| *s == Err(Miss::Ambiguous));
        if ambiguous > AMBIGUOUS {
            warnings.push(format!(
                "camera {}: {:.0} % of the shots had several candidates; look for lights that flicker and for mirrors",
                eye.name(),
                100.0 * ambiguous
            ));
        }
    }
    let head = scan.shots.iter().filter(|s| s.head.is_ok()).count() as f64 / shots;
    if head < SEEN {
        warnings.push(format!(
            "the head camera saw {:.0} % of the shots only: dark or glossy surfaces, distance, or exposure",
            100.0 * head
        ));
    }
    warnings
}

/// Directions by what became of them.
fn map(eye: Eye, shots: &[Shot]) -> String {
    let at = |wanted: &dyn Fn(&Sighting) -> bool| -> Vec<[f64; 2]> {
        let chosen = shots.iter().filter(|s| wanted(&eye.seen(s)));
        chosen.map(|s| [s.pan.to_degrees(), s.tilt.to_degrees()]).collect()
    };
    let found = at(&|s| s.is_ok());
    let mut series = vec![Series { name: "spot".into(), points: thinned(&found, MOST), mark: Mark::Dots, colour: 2 }];
    for (k, (miss, words)) in MISSES.iter().enumerate() {
        let points = at(&|s| *s == Err(*miss));
        if !points.is_empty() {
            let mark = if *miss == Miss::OutsideView { Mark::Dots } else { Mark::Crosses };
            let colour = [0, 1, 3, 4, 5][k];
            series.push(Series { name: (*words).into(), points: thinned(&points, MOST), mark, colour });
        }
    }
    let chart = Chart {
        title: format!("Directions: {}", eye.name()),
        x: Axis::linear("pan, right (degrees)"),
        y: Axis::linear("tilt, up (degrees)"),
        series,
        equal: true,
    };
    let caption = format!("What the camera saw of each shot.{}", thinned_note(shots.len(), MOST));
    figure(&chart.to_compact_svg(), &caption)
}

/// Depth and its standard deviation.
fn depths(scan: &Scan) -> String {
    let measured = |shot: &Shot| {
        let p = shot.point?.point;
        (p.rho > 0.0).then(|| [1.0 / p.rho, 1e3 * p.variance.sqrt() / (p.rho * p.rho)])
    };
    let all: Vec<[f64; 2]> = scan.shots.iter().filter_map(measured).collect();
    if all.is_empty() {
        return String::new();
    }
    let chart = Chart {
        title: "Depths measured by the head".into(),
        x: Axis { label: "depth (m)".into(), log: true },
        y: Axis { label: "standard deviation (mm)".into(), log: true },
        series: vec![Series { name: String::new(), points: thinned(&all, MOST), mark: Mark::Dots, colour: 0 }],
        equal: false,
    };
    let caption =
        format!("Triangulation: the error grows with the square of the depth.{}", thinned_note(all.len(), MOST));
    figure(&chart.to_compact_svg(), &caption)
}
