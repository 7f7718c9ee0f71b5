//! MEVA's surveillance cameras: hand-annotated pixels of surveyed points, and the published cameras.

use std::io;
use std::path::Path;

use nalgebra::{Matrix3, Vector2, Vector3};
use ptzcal::calibrate::Correspondences;

/// A camera's measurements with its published calibration.
pub struct Surveyed {
    pub set: Correspondences,
    /// px.
    pub focal: f64,
    /// Metres.
    pub centre: Vector3<f64>,
}

/// The camera `name` (G341, ...) of the folder `meva` of the real data.
pub fn camera(folder: &Path, name: &str) -> io::Result<Surveyed> {
    let krtd = super::data::numbers(&folder.join("cameras").join(name).with_extension("krtd"))?;
    let r = Matrix3::from_fn(|i, j| krtd[3 + i][j]);
    let centre = -(r.transpose() * Vector3::from_column_slice(&krtd[6]));
    // The published principal point is the image's centre: (0, 0) is the centre of a pixel.
    let size = |c: f64| (2.0 * c + 1.0) as u32;
    let mut set = Correspondences::new(size(krtd[0][2]), size(krtd[1][2])).map_err(io::Error::other)?;
    for row in super::data::numbers(&folder.join("corr").join(name).with_extension("csv"))? {
        let (world, pixel) = (Vector3::new(row[1], row[2], row[3]), Vector2::new(row[4], row[5]));
        set.add_points(&[world], &[pixel]).map_err(io::Error::other)?;
    }
    Ok(Surveyed { set, focal: krtd[0][0], centre })
}
