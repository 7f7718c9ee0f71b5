//! Points with their pixels as a table of comma-separated values, RFC 4180 without quotes.
//!
//! The first line names the columns, in any order and case: x y z (metres, world) and u v (pixels, (0, 0)
//! the centre of the top-left one) must be there. What a point's noise is may be: sigma_x sigma_y sigma_z
//! (m) or cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz (m^2); sigma_u sigma_v (px) or cov_uu cov_uv cov_vv
//! (px^2). A row leaves a group of them empty to say nothing. Any other column is refused, since it could
//! be a misspelt one, but for `name` and `comment`, which are passed over. Lines that begin with # are too.

use std::path::Path;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::cameras::text_of;
use super::file::{format_error, read_bounded, write_atomically};
use super::observation::ObservationRecord;
use super::tree::{real, shown};
use crate::error::{Error, Result};

/// A million points and more.
const MAX_BYTES: u64 = 256 << 20;
const PASSED_OVER: [&str; 2] = ["name", "comment"];
const REQUIRED: [&str; 5] = ["x", "y", "z", "u", "v"];
const SIGMAS: [&str; 3] = ["sigma_x", "sigma_y", "sigma_z"];
const COVARIANCE: [&str; 6] = ["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"];
const PIXEL_SIGMAS: [&str; 2] = ["sigma_u", "sigma_v"];
const PIXEL_COVARIANCE: [&str; 3] = ["cov_uu", "cov_uv", "cov_vv"];

/// Reads all points of a table, or none.
///
/// # Errors
/// `FileIo`; `FileFormat`, which names the line and the column.
pub fn read_correspondences_csv(path: &Path) -> Result<Vec<ObservationRecord>> {
    let name = path.display().to_string();
    let bytes = read_bounded(path, MAX_BYTES)?;
    from_csv(text_of(&bytes, &name)?, &name)
}

/// Writes points at once.
///
/// # Errors
/// `FileIo`; `Unsupported` for laser shots and lines (an inverse depth on a ray and a line through space
/// are no columns of a point: a calibration's JSON has them).
pub fn write_correspondences_csv(path: &Path, observations: &[ObservationRecord]) -> Result<()> {
    write_atomically(path, to_csv(observations)?.as_bytes())
}

/// Where each column of a group stands; `None` when none of them is there.
type Columns<const N: usize> = Option<[usize; N]>;

struct Header {
    width: usize,
    required: [usize; 5],
    sigmas: Columns<3>,
    covariance: Columns<6>,
    pixel_sigmas: Columns<2>,
    pixel_covariance: Columns<3>,
}

struct Row<'a> {
    file: &'a str,
    line: usize,
    cells: Vec<&'a str>,
}

impl Row<'_> {
    fn wrong(&self, reason: impl std::fmt::Display) -> Error {
        format_error(self.file, format!("line {}: {reason}", self.line))
    }

    /// The columns of a group, all or none of which are there.
    fn columns<const N: usize>(&self, names: [&str; N]) -> Result<Columns<N>> {
        let place = |name: &str| self.cells.iter().position(|cell| cell.eq_ignore_ascii_case(name));
        let found = names.map(place);
        match found.iter().position(Option::is_none) {
            None => Ok(Some(found.map(Option::unwrap_or_default))),
            Some(_) if found.iter().all(Option::is_none) => Ok(None),
            Some(missing) => Err(self.wrong(format!("the column {} is missing", names[missing]))),
        }
    }

    fn header(&self) -> Result<Header> {
        let known = |cell: &str| {
            [&PASSED_OVER[..], &REQUIRED, &SIGMAS, &COVARIANCE, &PIXEL_SIGMAS, &PIXEL_COVARIANCE]
                .concat()
                .iter()
                .any(|name| name.eq_ignore_ascii_case(cell))
        };
        for (i, cell) in self.cells.iter().enumerate() {
            if !known(cell) {
                return Err(self.wrong(format!("'{}' is no column of this format", shown(cell))));
            }
            if self.cells[..i].iter().any(|before| before.eq_ignore_ascii_case(cell)) {
                return Err(self.wrong(format!("the column {} is there twice", shown(cell))));
            }
        }
        let header = Header {
            width: self.cells.len(),
            required: self.columns(REQUIRED)?.ok_or_else(|| self.wrong("the columns x y z u v are missing"))?,
            sigmas: self.columns(SIGMAS)?,
            covariance: self.columns(COVARIANCE)?,
            pixel_sigmas: self.columns(PIXEL_SIGMAS)?,
            pixel_covariance: self.columns(PIXEL_COVARIANCE)?,
        };
        if (header.sigmas.is_some() && header.covariance.is_some())
            || (header.pixel_sigmas.is_some() && header.pixel_covariance.is_some())
        {
            return Err(self.wrong("columns of deviations and of covariances for the same"));
        }
        Ok(header)
    }

    fn numbers<const N: usize>(&self, columns: [usize; N], names: [&str; N]) -> Result<[f64; N]> {
        let mut numbers = [0.0; N];
        for ((to, column), name) in numbers.iter_mut().zip(columns).zip(names) {
            let cell = self.cells.get(column).copied().unwrap_or_default();
            *to = real(cell).ok_or_else(|| self.wrong(format!("{name}: '{}' is not a finite number", shown(cell))))?;
        }
        Ok(numbers)
    }

    /// The numbers of a group; `None` where its cells are empty.
    fn optional<const N: usize>(&self, columns: Columns<N>, names: [&str; N]) -> Result<Option<[f64; N]>> {
        match columns {
            Some(columns) if columns.iter().any(|i| self.cells.get(*i).is_some_and(|cell| !cell.is_empty())) => {
                self.numbers(columns, names).map(Some)
            }
            _ => Ok(None),
        }
    }

    fn deviations<const N: usize>(&self, columns: Columns<N>, names: [&str; N]) -> Result<Option<[f64; N]>> {
        let values = self.optional(columns, names)?;
        match values.and_then(|v| v.iter().position(|sigma| *sigma < 0.0)) {
            Some(i) => Err(self.wrong(format!("{}: a standard deviation below zero", names[i]))),
            None => Ok(values),
        }
    }

    fn point(&self, header: &Header) -> Result<ObservationRecord> {
        if self.cells.len() != header.width {
            return Err(self.wrong(format!("{} values in {} columns", self.cells.len(), header.width)));
        }
        let [x, y, z, u, v] = self.numbers(header.required, REQUIRED)?;
        let diagonal = self.deviations(header.sigmas, SIGMAS)?;
        let full = self.optional(header.covariance, COVARIANCE)?;
        let pixel_diagonal = self.deviations(header.pixel_sigmas, PIXEL_SIGMAS)?;
        let pixel_full = self.optional(header.pixel_covariance, PIXEL_COVARIANCE)?;
        let spread = |[x, y, z]: [f64; 3]| Matrix3::from_diagonal(&Vector3::new(x * x, y * y, z * z));
        let matrix = |[xx, xy, xz, yy, yz, zz]: [f64; 6]| Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        Ok(ObservationRecord::Point {
            world: Vector3::new(x, y, z),
            world_covariance: diagonal.map(spread).or(full.map(matrix)),
            pixel: Vector2::new(u, v),
            pixel_covariance: pixel_diagonal
                .map(|[u, v]| Matrix2::new(u * u, 0.0, 0.0, v * v))
                .or(pixel_full.map(|[uu, uv, vv]| Matrix2::new(uu, uv, uv, vv))),
        })
    }
}

/// Reads a table's text; `name` is what errors call it.
pub fn from_csv<'a>(text: &'a str, name: &'a str) -> Result<Vec<ObservationRecord>> {
    if !text.is_empty() && !text.ends_with('\n') {
        // A number that was cut short is a number too.
        return Err(format_error(name, format!("line {}: the file ends before the line does", text.lines().count())));
    }
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let cells =
        |(i, line): (usize, &'a str)| Row { file: name, line: i + 1, cells: line.split(',').map(str::trim).collect() };
    let header =
        lines.next().map(cells).ok_or_else(|| format_error(name, "line 1: no line with the columns' names"))?;
    let header = header.header()?;
    lines.map(|line| cells(line).point(&header)).collect()
}

/// A table's text: the columns that some point needs.
pub fn to_csv(observations: &[ObservationRecord]) -> Result<String> {
    let (mut has_world, mut has_pixel) = (false, false);
    for (i, observation) in observations.iter().enumerate() {
        let ObservationRecord::Point { world_covariance, pixel_covariance, .. } = observation else {
            let what = format!("measurement {i} in a table of points: it is a laser shot or a line");
            return Err(Error::Unsupported { what });
        };
        if world_covariance.is_some_and(|c| c != c.transpose()) {
            return Err(Error::invalid("xyz covariance", format!("of point {i} is not symmetric")));
        }
        has_world |= world_covariance.is_some();
        has_pixel |= pixel_covariance.is_some();
    }
    let mut columns = REQUIRED.to_vec();
    columns.extend(COVARIANCE.iter().filter(|_| has_world));
    columns.extend(PIXEL_COVARIANCE.iter().filter(|_| has_pixel));
    let mut text = columns.join(",") + "\n";
    for observation in observations {
        let ObservationRecord::Point { world, world_covariance, pixel, pixel_covariance } = observation else {
            continue;
        };
        let mut cells: Vec<String> = world.iter().chain(pixel).map(|v| format!("{v:?}")).collect();
        let mut add = |values: Option<Vec<f64>>, count: usize| match values {
            Some(values) => cells.extend(values.iter().map(|v| format!("{v:?}"))),
            None => cells.extend(std::iter::repeat_n(String::new(), count)),
        };
        if has_world {
            add(world_covariance.map(|c| vec![c.m11, c.m12, c.m13, c.m22, c.m23, c.m33]), COVARIANCE.len());
        }
        if has_pixel {
            add(pixel_covariance.map(|c| vec![c.m11, c.m12, c.m22]), PIXEL_COVARIANCE.len());
        }
        text += &(cells.join(",") + "\n");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::{Random, fuzz_inputs, mutated};

    fn points() -> Vec<ObservationRecord> {
        let point = |i: f64, world_covariance, pixel_covariance| ObservationRecord::Point {
            world: Vector3::new(i / 3.0, -1e-300, 0.1 + 0.2),
            world_covariance,
            pixel: Vector2::new(1e5 / 7.0, -i),
            pixel_covariance,
        };
        let world = Matrix3::new(1.0, 0.1, 0.2, 0.1, 2.0, 1.0 / 3.0, 0.2, 1.0 / 3.0, 3.0);
        let pixel = Matrix2::new(0.25, 0.01, 0.01, 1.0 / 3.0);
        vec![
            point(1.0, None, None),
            point(2.0, Some(world), None),
            point(3.0, None, Some(pixel)),
            point(4.0, Some(world), Some(pixel)),
        ]
    }

    #[test]
    fn what_is_written_is_read_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        for some in [&points()[..], &points()[..1], &points()[..2], &points()[2..3], &[]] {
            write_correspondences_csv(&path, some).unwrap();
            assert_eq!(read_correspondences_csv(&path).unwrap(), some);
        }
        let line = ObservationRecord::Line {
            point: Vector3::zeros(),
            direction: Vector3::x(),
            covariance: None,
            ends: [Vector2::zeros(), Vector2::x()],
            end_covariances: None,
        };
        assert!(to_csv(&[points()[0].clone(), line]).unwrap_err().to_string().contains("measurement 1"));
    }

    #[test]
    fn tables_of_people_are_read() {
        let text = "# surveyed in May\r\nName, U,V, X,Y,Z, sigma_x,sigma_y,sigma_z, sigma_u,sigma_v\r\n\
            corner A, 10.5,20, 1,2,3, 0.01,0.02,0, 0.5,0.25\r\n\r\nB,11,21,4,5,6,,,,,\r\n";
        let found = from_csv(text, "points.csv").unwrap();
        let wanted = [
            ObservationRecord::Point {
                world: Vector3::new(1.0, 2.0, 3.0),
                world_covariance: Some(Matrix3::from_diagonal(&Vector3::new(0.01 * 0.01, 0.02 * 0.02, 0.0))),
                pixel: Vector2::new(10.5, 20.0),
                pixel_covariance: Some(Matrix2::new(0.25, 0.0, 0.0, 0.0625)),
            },
            ObservationRecord::Point {
                world: Vector3::new(4.0, 5.0, 6.0),
                world_covariance: None,
                pixel: Vector2::new(11.0, 21.0),
                pixel_covariance: None,
            },
        ];
        assert_eq!(found, wanted);
    }

    #[test]
    fn faults_name_the_line_and_the_column() {
        for (text, word) in [
            ("", "line 1"),
            ("# only\n", "line 1"),
            ("x,y,z,u,v\n1,2,3,4,5", "line 2: the file ends before the line does"),
            ("x,y,z,u\n", "the column v is missing"),
            ("a,b\n", "'a' is no column"),
            ("1,2,3,4,5\n", "'1' is no column"),
            ("x,y,z,u,v,X\n", "X is there twice"),
            ("x,y,z,u,v,sigma_x\n", "the column sigma_y is missing"),
            ("x,y,z,u,v,sigma_u,sigma_v,cov_uu,cov_uv,cov_vv\n", "deviations and of covariances"),
            ("x,y,z,u,v\n1,2,3,4\n", "line 2: 4 values in 5 columns"),
            ("x,y,z,u,v\n1,2,3,4,5,6\n", "line 2: 6 values in 5 columns"),
            ("x,y,z,u,v\n\n1,2,3,4,5\n1,2,,4,5\n", "line 4: z: ''"),
            ("x,y,z,u,v\n1,2,3,nan,5\n", "line 2: u: 'nan'"),
            ("x,y,z,u,v\n1,2,3,1e999,5\n", "line 2: u"),
            ("x,y,z,u,v\n\"1\",2,3,4,5\n", "line 2: x"),
            ("x;y;z;u;v\n", "is no column"),
            ("x,y,z,u,v,sigma_u,sigma_v\n1,2,3,4,5,-1,1\n", "sigma_u: a standard deviation below zero"),
            ("x,y,z,u,v,sigma_u,sigma_v\n1,2,3,4,5,1,\n", "sigma_v: ''"),
        ] {
            let e = from_csv(text, "points.csv").unwrap_err();
            assert!(matches!(e, Error::FileFormat { .. }) && e.to_string().contains(word), "{text:?}: {e}");
        }
        let text = to_csv(&points()).unwrap();
        for length in 0..text.len() {
            // Whole rows are whole rows.
            let read = from_csv(&text[..length], "cut");
            assert!(read.is_err() || text[..length].ends_with('\n'), "{length}");
        }
    }

    #[test]
    fn fuzz_tables() {
        let mut random = Random(5);
        let good = to_csv(&points()).unwrap();
        let (mut read, mut refused) = (0, 0);
        for _ in 0..fuzz_inputs() {
            let bytes = mutated(good.as_bytes(), &mut random);
            match text_of(&bytes, "fuzz").and_then(|text| from_csv(text, "fuzz")) {
                Ok(points) => {
                    read += 1;
                    assert_eq!(from_csv(&to_csv(&points).unwrap(), "again").unwrap(), points);
                }
                Err(e) => {
                    refused += 1;
                    assert!(e.to_string().starts_with("fuzz: line "), "{e}");
                }
            }
        }
        assert!(read > 100 && refused > 100, "{read} {refused}");
    }
}
