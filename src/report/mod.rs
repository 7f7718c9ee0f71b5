//! One HTML file that says what was measured and how good it is: for the person who signs for a
//! camera, and for the one who asks in a year why it was trusted.
//!
//! The file needs nothing else: pictures are inside, there are no scripts, and it prints on paper as it
//! looks on a telephone. The same input makes the same bytes: no clock is read.

mod boards;
mod camera;
mod image_plane;
mod inputs;
mod page;
mod scan;
mod scene;
mod seen;
mod survey;

use std::path::Path;

use nalgebra::Vector3;

use crate::adjust::Adjusted;
use crate::calibrate::{BoardCalibration, Boards, Calibration, Correspondences};
use crate::error::{Error, Result};
use crate::format::write_atomically;
use crate::geometry::Rigid;
use crate::image::ImageView;
use crate::rig::Scan;
use page::{Page, escape};
use scene::Scene;

/// Bytes of a report: sections beyond them are refused.
const MAX_BYTES: usize = 256 << 20;
const MAX_TEXT: usize = 100_000;

/// A report that grows by one section for each thing that is added.
#[derive(Debug, Clone)]
pub struct Report {
    title: String,
    /// Upwards in the world: decides what the view from above is.
    up: Vector3<f64>,
    notes: Vec<String>,
    cameras: Vec<camera::Summary>,
    sections: Vec<String>,
    scene: Scene,
    inputs: Vec<inputs::Input>,
}

impl Report {
    /// # Errors
    /// `InvalidArgument` for a title that is too long.
    pub fn new(title: &str) -> Result<Self> {
        text("title", title)?;
        Ok(Self {
            title: title.to_owned(),
            up: -Vector3::y(),
            notes: Vec::new(),
            cameras: Vec::new(),
            sections: Vec::new(),
            scene: Scene::default(),
            inputs: Vec::new(),
        })
    }

    /// Which way is up in the world, any length: of the rig's frame, the default, it is -y.
    ///
    /// # Errors
    /// `NotFinite`; `InvalidArgument` for a vector without a length.
    pub fn set_up(&mut self, up: &Vector3<f64>) -> Result<()> {
        if let Some(index) = up.iter().position(|v| !v.is_finite()) {
            return Err(Error::NotFinite { name: "up", index });
        }
        self.up = up.try_normalize(1e-12).ok_or_else(|| Error::invalid("up", "no direction"))?;
        Ok(())
    }

    /// A paragraph of the host's: who, when, where, with what.
    ///
    /// # Errors
    /// `InvalidArgument` for a text that is too long.
    pub fn add_note(&mut self, note: &str) -> Result<()> {
        text("note", note)?;
        self.room(note.len())?;
        self.notes.push(note.to_owned());
        Ok(())
    }

    /// A calibrated camera. `set` is what it was calibrated from: without it there is nothing to say of
    /// its image and its depths. `picture`, of the camera's size, is drawn beneath its measurements.
    ///
    /// # Errors
    /// `InvalidArgument` for a set or a picture of another camera.
    pub fn add_calibration(
        &mut self,
        name: &str,
        calibration: &Calibration,
        set: Option<&Correspondences>,
        picture: Option<&ImageView<'_>>,
    ) -> Result<()> {
        text("name", name)?;
        let seen = set.map(|set| seen::of_set(calibration, set)).transpose()?;
        let (section, summary) = camera::section(name, calibration, seen.as_ref(), picture)?;
        self.room(section.len())?;
        self.scene.add_camera(name, &calibration.camera);
        if let Some(seen) = &seen {
            self.scene.add_points(seen.points.iter().filter(|p| p.used).filter_map(|p| p.world));
        }
        if let Some(set) = set {
            self.inputs.push(inputs::of_set(name, set));
        }
        self.sections.push(section);
        self.cameras.push(summary);
        Ok(())
    }

    /// A camera calibrated from boards, with its views. It has no pose in the world, so the view from above
    /// does not show it.
    ///
    /// # Errors
    /// `InvalidArgument` for boards of another calibration.
    pub fn add_board_calibration(&mut self, name: &str, found: &BoardCalibration, boards: &Boards) -> Result<()> {
        text("name", name)?;
        let seen = seen::of_boards(found, boards)?;
        let (camera, summary) = camera::section(name, &found.calibration, Some(&seen), None)?;
        let views = boards::section(name, found);
        self.room(camera.len() + views.len())?;
        self.inputs.push(inputs::of_boards(name, boards));
        self.sections.extend([camera, views]);
        self.cameras.push(summary);
        Ok(())
    }

    /// A scan: what was fired at, who saw it, what was missed and why. Its frame is the station's, the
    /// world of the view from above.
    ///
    /// # Errors
    /// `InvalidArgument` for a name that is too long.
    pub fn add_scan(&mut self, name: &str, scan: &Scan) -> Result<()> {
        text("name", name)?;
        let section = scan::section(name, scan);
        self.room(section.len())?;
        self.scene.add_station(name, &Rigid::identity());
        self.scene.add_points(scan.points().into_iter().map(|p| p.position));
        self.inputs.push(inputs::of_scan(name, scan));
        self.sections.push(section);
        Ok(())
    }

    /// A survey solved: stations, rig and cameras with what the data say of them.
    ///
    /// # Errors
    /// `InvalidArgument` for a name that is too long.
    pub fn add_survey(&mut self, name: &str, survey: &Adjusted) -> Result<()> {
        text("name", name)?;
        let mut sections = vec![survey::section(name, survey)];
        let mut summaries = Vec::new();
        for (index, calibration) in survey.cameras.iter().enumerate() {
            let seen = seen::of_survey(survey, index);
            let own = format!("{name}, camera {index}");
            let (section, summary) = camera::section(&own, calibration, Some(&seen), None)?;
            sections.push(section);
            summaries.push(summary);
        }
        self.room(sections.iter().map(String::len).sum())?;
        for (index, station) in survey.stations.iter().enumerate() {
            self.scene.add_station(&format!("station {index}"), station);
        }
        for (summary, calibration) in summaries.iter().zip(&survey.cameras) {
            self.scene.add_camera(&summary.name, &calibration.camera);
        }
        let shots = 0..survey.input.shots().len();
        self.scene.add_points(shots.filter_map(|shot| Some(survey.shot_point(shot).ok()?.0)));
        self.inputs.push(inputs::of_survey(name, survey));
        self.sections.append(&mut sections);
        self.cameras.append(&mut summaries);
        Ok(())
    }

    /// Names bytes that the result was made from, by their hash (SHA-256): a journal, a rig's file.
    ///
    /// # Errors
    /// `InvalidArgument` for a name that is too long.
    pub fn add_input(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        text("name", name)?;
        self.inputs.push(inputs::of_bytes(name, bytes));
        Ok(())
    }

    /// The whole page.
    pub fn to_html(&self) -> String {
        let mut page = Page::new(&self.title);
        page.put(&format!("<header><h1>{}</h1>\n", escape(&self.title)));
        page.put(&format!("<p class=\"made\">Made by ptzcal {}</p>\n", env!("CARGO_PKG_VERSION")));
        for note in &self.notes {
            page.put(&format!("<p>{}</p>\n", escape(note)));
        }
        page.put("</header>\n");
        camera::summaries(&mut page, &self.cameras);
        self.scene.draw(&mut page, &self.up);
        for section in &self.sections {
            page.put(section);
        }
        inputs::list(&mut page, &self.inputs);
        page.finish()
    }

    /// Writes the page, whole or not at all.
    ///
    /// # Errors
    /// `Io`.
    pub fn save(&self, path: &Path) -> Result<()> {
        write_atomically(path, self.to_html().as_bytes())
    }

    /// Refuses what would make the file larger than a browser likes.
    fn room(&self, more: usize) -> Result<()> {
        let sum = more + self.sections.iter().chain(&self.notes).map(String::len).sum::<usize>();
        if sum > MAX_BYTES {
            return Err(Error::invalid("report", format!("{sum} bytes, more than {MAX_BYTES}: make several")));
        }
        Ok(())
    }
}

fn text(name: &'static str, text: &str) -> Result<()> {
    if text.len() > MAX_TEXT {
        return Err(Error::invalid(name, format!("{} bytes, more than {MAX_TEXT}", text.len())));
    }
    Ok(())
}
