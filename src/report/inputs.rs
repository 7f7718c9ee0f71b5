//! What a result was made from, by hashes: the same input has the same hash wherever it is made.

use sha2::{Digest, Sha256};

use super::page::{Page, counted, escape, table};
use crate::adjust::Adjusted;
use crate::calibrate::{Boards, Correspondences, Observation};
use crate::rig::{Scan, Sighting};

/// Something that went in.
#[derive(Debug, Clone)]
pub struct Input {
    name: String,
    /// What it is, for a person.
    kind: String,
    /// SHA-256.
    hash: String,
}

/// Numbers as little-endian 64-bit floats, in the order in which they are named; counts and kinds too.
#[derive(Default)]
struct Hash(Sha256);

impl Hash {
    fn numbers<'a>(&mut self, values: impl IntoIterator<Item = &'a f64>) {
        values.into_iter().for_each(|v| self.0.update(v.to_le_bytes()));
    }

    fn number(&mut self, value: f64) {
        self.numbers(&[value]);
    }

    fn finish(self) -> String {
        self.0.finalize().iter().map(|b| format!("{b:02x}")).collect()
    }
}

/// Bytes of a file of the host's.
pub fn of_bytes(name: &str, bytes: &[u8]) -> Input {
    let mut hash = Hash::default();
    hash.0.update(bytes);
    Input { name: name.to_owned(), kind: counted(bytes.len(), "byte"), hash: hash.finish() }
}

/// The image size, then each measurement: 0 (point), 1 (shot) or 2 (line) and its numbers, with 0 or 1
/// before a covariance that may be missing.
pub fn of_set(name: &str, set: &Correspondences) -> Input {
    let mut hash = Hash::default();
    hash.numbers(&[f64::from(set.width()), f64::from(set.height())]);
    for observation in set.observations() {
        match observation {
            Observation::Point { world, world_covariance, pixel, pixel_covariance } => {
                hash.number(0.0);
                hash.numbers(world);
                optional(&mut hash, world_covariance.as_ref());
                hash.numbers(pixel);
                optional(&mut hash, pixel_covariance.as_ref());
            }
            Observation::Shot { shot, pixel, pixel_covariance } => {
                hash.number(1.0);
                hash.numbers(&shot.origin);
                hash.numbers(&shot.direction);
                hash.numbers(&[shot.rho, shot.variance]);
                hash.numbers(pixel);
                hash.numbers(pixel_covariance);
            }
            Observation::Line(line) => {
                hash.number(2.0);
                hash.numbers(&line.point);
                hash.numbers(&line.direction);
                optional(&mut hash, line.covariance.as_ref());
                line.ends.iter().for_each(|end| hash.numbers(end));
                hash.number(f64::from(u8::from(line.end_covariances.is_some())));
                line.end_covariances.iter().flatten().for_each(|c| hash.numbers(c));
            }
        }
    }
    Input { name: name.to_owned(), kind: counted(set.len(), "measurement"), hash: hash.finish() }
}

fn optional<'a, I: IntoIterator<Item = &'a f64>>(hash: &mut Hash, values: Option<I>) {
    hash.number(f64::from(u8::from(values.is_some())));
    values.into_iter().for_each(|v| hash.numbers(v));
}

/// The image size and the bending allowed, then each view: how many corners, their places on the board,
/// pixels and covariances, and the laser's spot.
pub fn of_boards(name: &str, boards: &Boards) -> Input {
    let mut hash = Hash::default();
    hash.numbers(&[f64::from(boards.width()), f64::from(boards.height()), boards.bending()]);
    for view in boards.views() {
        hash.number(view.corners().len() as f64);
        for corner in view.corners() {
            hash.numbers(corner.board.iter().chain(&corner.pixel));
            optional(&mut hash, corner.pixel_covariance.as_ref());
        }
        optional(&mut hash, view.spot().map(|s| &s.pixel));
        optional(&mut hash, view.spot().and_then(|s| s.pixel_covariance.as_ref()));
    }
    Input { name: name.to_owned(), kind: counted(boards.views().len(), "view"), hash: hash.finish() }
}

/// The region, the rig model's numbers as the shots' points hold them, and every shot: its index,
/// readings and the spots of head and fixed cameras (NaN for those that are missing).
pub fn of_scan(name: &str, scan: &Scan) -> Input {
    let mut hash = Hash::default();
    hash.numbers(scan.region.pan.iter().chain(&scan.region.tilt));
    hash.numbers(&[f64::from(scan.region.pan_steps), f64::from(scan.region.tilt_steps)]);
    for shot in &scan.shots {
        hash.numbers(&[f64::from(shot.index), shot.pan, shot.tilt, shot.zoom]);
        std::iter::once(&shot.head).chain(&shot.fixed).for_each(|s| spot(&mut hash, s));
        if let Some(depth) = &shot.point {
            let p = &depth.point;
            hash.numbers(p.origin.iter().chain(&p.direction).chain(&[p.rho, p.variance]));
        }
    }
    Input { name: name.to_owned(), kind: counted(scan.shots.len(), "shot"), hash: hash.finish() }
}

fn spot(hash: &mut Hash, sighting: &Sighting) {
    match sighting {
        Ok(spot) => hash.numbers([spot.x, spot.y].iter().chain(&spot.covariance)),
        Err(_) => hash.number(f64::NAN),
    }
}

/// Every shot of a survey: station, readings, the head's spot and all sightings.
pub fn of_survey(name: &str, survey: &Adjusted) -> Input {
    let mut hash = Hash::default();
    let shots = survey.input.shots();
    for shot in shots {
        hash.numbers(&[shot.station as f64, shot.pan, shot.tilt]);
        match &shot.head {
            Some((pixel, covariance)) => hash.numbers(pixel.iter().chain(covariance)),
            None => hash.number(f64::NAN),
        }
        for s in &shot.sightings {
            hash.number(s.camera as f64);
            hash.numbers(s.pixel.iter().chain(&s.covariance));
        }
    }
    Input { name: name.to_owned(), kind: counted(shots.len(), "shot"), hash: hash.finish() }
}

pub fn list(page: &mut Page, inputs: &[Input]) {
    if inputs.is_empty() {
        return;
    }
    let row = |i: &Input| vec![escape(&i.name), escape(&i.kind), format!("<code>{}</code>", i.hash)];
    let rows: Vec<Vec<String>> = inputs.iter().map(row).collect();
    page.put("<section><h2>What it was made from</h2>\n");
    page.put(&table(&["input", "size", "SHA-256"], &rows, 3));
    page.put("</section>\n");
}
