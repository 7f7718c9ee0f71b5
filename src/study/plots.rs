//! The study's and the label's charts, as SVG (Figs. 12 and 13 of the thesis).

use super::label::PrecisionLabel;
use super::method::Method;
use super::run::Study;
use super::statistics::Quantity;
use crate::draw::chart::{Axis, Chart, HeatMap, Mark, Series};
use crate::error::{Error, Result};

impl Quantity {
    pub const ALL: [Self; Self::COUNT] = [Self::Centre, Self::Rotation, Self::Focal, Self::PrincipalPoint];

    /// Its label on an axis, and the factor to that unit.
    fn label(self) -> (&'static str, f64) {
        match self {
            Self::Centre => ("position error (mm)", 1e3),
            Self::Rotation => ("rotation error (mrad)", 1e3),
            Self::Focal => ("focal length error (px)", 1.0),
            Self::PrincipalPoint => ("principal point error (px)", 1.0),
        }
    }
}

fn axis(label: &str, log: bool) -> Axis {
    Axis { label: label.into(), log }
}

impl Study {
    /// Root mean square error against noise, a line for each method, dashed what the closed-form covariance
    /// expects: Fig. 13 (a). Over levels with the same noise on both cameras, or all where there are
    /// none such, against the fixed camera's.
    pub fn plot_errors(&self, quantity: Quantity) -> String {
        let (label, factor) = quantity.label();
        let same = self.options.levels.iter().any(|l| l.head == l.fixed);
        // Without noise there is no error, and no place for it on a logarithmic axis.
        let shown: Vec<usize> = (0..self.options.levels.len())
            .filter(|i| self.options.levels[*i].head + self.options.levels[*i].fixed > 0.0)
            .filter(|i| !same || self.options.levels[*i].head == self.options.levels[*i].fixed)
            .collect();
        let noise = |i: usize| self.options.levels[i].fixed;
        let line = |value: &dyn Fn(usize) -> f64| shown.iter().map(|i| [noise(*i), factor * value(*i)]).collect();
        let q = quantity as usize;
        let method = |(colour, method): (usize, &Method)| {
            let cells = self.cells_of(*method);
            let points = line(&|i| cells.get(i).map_or(f64::NAN, |c| c.rms[q]));
            Series { name: method.name().into(), points, mark: Mark::Line, colour }
        };
        let mut series: Vec<Series> = self.options.methods.iter().enumerate().map(method).collect();
        if !self.expected.is_empty() {
            let points = line(&|i| self.expected.get(i).map_or(f64::NAN, |e| e.rms[q]));
            series.push(Series { name: "joint ML, covariance".into(), points, mark: Mark::Dashed, colour: 6 });
        }
        let cameras = if same { "both cameras" } else { "fixed camera" };
        let title =
            format!("Fixed camera from {} shots, rms of {} trials", self.set_up.shots.len(), self.options.trials);
        let x = axis(&format!("noise, {cameras} (px)"), false);
        Chart { title, x, y: axis(label, true), series, equal: false }.to_svg()
    }

    /// Mean position error over the noises of head and fixed camera: Fig. 13 (b).
    ///
    /// # Errors
    /// `InvalidArgument` for a method that was not asked for.
    pub fn plot_grid(&self, method: Method) -> Result<String> {
        let cells = self.asked(method)?;
        let values = |of: fn(&super::information::NoiseLevel) -> f64| {
            let mut values: Vec<f64> = self.options.levels.iter().map(of).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        };
        let (x, y) = (values(|l| l.head), values(|l| l.fixed));
        let at = |head: f64, fixed: f64| {
            let cell = cells.iter().find(|c| c.level.head == head && c.level.fixed == fixed);
            cell.map_or(f64::NAN, |c| 1e3 * c.mean[Quantity::Centre as usize])
        };
        Ok(HeatMap {
            title: format!("Mean position error (mm): {}", method.name()),
            x_label: "noise, head camera (px)".into(),
            y_label: "noise, fixed camera (px)".into(),
            values: y.iter().map(|fixed| x.iter().map(|head| at(*head, *fixed)).collect()).collect(),
            x,
            y,
        }
        .to_svg())
    }

    /// Position errors of single trials at one level, seen from above: Fig. 12.
    ///
    /// # Errors
    /// `InvalidArgument` for a level that there is not.
    pub fn plot_scatter(&self, level: usize) -> Result<String> {
        let at = self.options.levels.get(level);
        let at = at.ok_or_else(|| Error::invalid("level", format!("{level} of {}", self.options.levels.len())))?;
        let method = |(colour, method): (usize, &Method)| {
            let centres = self.cells_of(*method).get(level).map(|c| c.centres.as_slice()).unwrap_or_default();
            let points = centres.iter().map(|c| [1e3 * c.x, 1e3 * c.z]).collect();
            Series { name: method.name().into(), points, mark: Mark::Dots, colour }
        };
        Ok(Chart {
            title: format!("Estimated positions, noise {} px (head), {} px (fixed)", at.head, at.fixed),
            x: axis("x, right, from the true position (mm)", false),
            y: axis("z, forward, from the true position (mm)", false),
            series: self.options.methods.iter().enumerate().map(method).collect(),
            equal: true,
        }
        .to_svg())
    }

    fn asked(&self, method: Method) -> Result<&[super::statistics::Cell]> {
        let cells = self.cells_of(method);
        if cells.is_empty() {
            return Err(Error::invalid("method", format!("{} is not part of this study", method.name())));
        }
        Ok(cells)
    }
}

impl PrecisionLabel {
    /// A quantity against the working distance, a line for each level, dashed what is expected.
    pub fn plot(&self, quantity: Quantity) -> String {
        let (label, factor) = quantity.label();
        let q = quantity as usize;
        self.chart(label, |row| [factor * row.simulated[q], factor * row.expected[q]])
    }

    /// The error of points handed off, against their distance.
    pub fn plot_handoff(&self) -> String {
        self.chart("error of a point handed off (mm)", |row| [1e3 * row.handoff_simulated, 1e3 * row.handoff_expected])
    }

    fn chart(&self, label: &str, values: impl Fn(&super::label::LabelRow) -> [f64; 2]) -> String {
        let mut series = Vec::new();
        for (colour, level) in self.options.levels.iter().enumerate() {
            let rows = || self.rows.iter().filter(|r| r.level == *level);
            let points = |k: usize| rows().map(|r| [r.distance, values(r)[k]]).collect();
            let name = if level.head == level.fixed {
                format!("{} px", level.fixed)
            } else {
                format!("{} px, {} px", level.head, level.fixed)
            };
            series.push(Series { name: format!("{name}, simulated"), points: points(0), mark: Mark::Line, colour });
            series.push(Series { name: format!("{name}, covariance"), points: points(1), mark: Mark::Dashed, colour });
        }
        let title = format!("Precision label: {}, rms of {} trials", self.options.method.name(), self.options.trials);
        Chart { title, x: axis("working distance (m)", false), y: axis(label, true), series, equal: false }.to_svg()
    }
}
