//! Pictures of a chessboard with the laser off and on: 4 x 4 samples a pixel, light times the board's
//! reflectance, a beam of Gaussian section, blur and noise. Shares nothing with the detectors.
#![allow(dead_code)]

use nalgebra::Vector3;
use ptzcal::geometry::rig_model::LaserLine;
use ptzcal::geometry::{Camera, Rigid};
use ptzcal::image::{Image, PixelFormat};
use ptzcal::rig_calibration::ChessboardSpec;

use super::thesis::Noise;

const SAMPLES: usize = 4;
/// Reflectance of dark and bright squares, grey levels under the room's light.
const DARK: f64 = 50.0;
const BRIGHT: f64 = 140.0;
const WALL: f64 = 100.0;
/// Light of the laser over that of the room, at the beam's middle.
const LASER: f64 = 1.2;

pub struct Scene<'a> {
    pub camera: &'a Camera,
    pub spec: &'a ChessboardSpec,
    /// Board to camera, the board's frame in the middle of its corners.
    pub pose: Rigid,
    pub line: LaserLine,
    /// Standard deviation of the beam's section, metres.
    pub beam: f64,
    /// Standard deviations: pixels, grey levels.
    pub blur: f64,
    pub noise: f64,
}

impl Scene<'_> {
    /// With the laser off and on.
    pub fn render(&self, noise: &mut Noise) -> [Image; 2] {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let (wide, high) = (width * SAMPLES, height * SAMPLES);
        let (mut off, mut on) = (vec![0f32; wide * high], vec![0f32; wide * high]);
        let at = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
        let n: Vector3<f64> = self.pose.rotation.column(2).into();
        let back = self.pose.inverse();
        let (o, v) = (Vector3::new(self.line.x0, self.line.y0, 0.0), Vector3::new(self.line.vx, self.line.vy, 1.0));
        let v = v.normalize();
        // Edges are ramps as wide as a sample: point samples would move them.
        let ramp = self.pose.translation.z / self.camera.intrinsics.fx / SAMPLES as f64;
        // Rays of the pixels' corners; between them they are interpolated.
        let corner = |i: usize| {
            let (x, y) = ((i % (width + 1)) as f64 - 0.5, (i / (width + 1)) as f64 - 0.5);
            let ray = self.camera.back_project(&nalgebra::Vector2::new(x, y)).expect("a ray");
            ray.direction / ray.direction.z
        };
        let rays: Vec<Vector3<f64>> = (0..(width + 1) * (height + 1)).map(corner).collect();
        for y in 0..high {
            for x in 0..wide {
                let first = y / SAMPLES * (width + 1) + x / SAMPLES;
                let part = |i: usize| at(i % SAMPLES) + 0.5;
                let across = |k: usize| rays[k] * (1.0 - part(x)) + rays[k + 1] * part(x);
                let d = across(first) * (1.0 - part(y)) + across(first + width + 1) * part(y);
                let point = d * (n.dot(&self.pose.translation) / n.dot(&d));
                let reflectance = self.reflectance(&back.apply(&point), ramp);
                let miss = (point - o) - v * v.dot(&(point - o));
                let far = miss.norm_squared() / (self.beam * self.beam);
                let spot = if far < 60.0 { LASER * (-0.5 * far).exp() } else { 0.0 };
                off[y * wide + x] = reflectance as f32;
                on[y * wide + x] = (reflectance * (1.0 + spot)) as f32;
            }
        }
        [off, on].map(|fine| {
            let fine = blurred(&fine, wide, high, self.blur * SAMPLES as f64);
            let mut image = Image::new(PixelFormat::Gray8, width as u32, height as u32);
            for (i, pixel) in image.data.iter_mut().enumerate() {
                let (x, y) = (i % width, i / width);
                let rows = (0..SAMPLES).map(|j| (y * SAMPLES + j) * wide + x * SAMPLES);
                let sum: f64 = rows.flat_map(|r| &fine[r..r + SAMPLES]).map(|v| f64::from(*v)).sum();
                let mean = sum / (SAMPLES * SAMPLES) as f64;
                *pixel = (mean + self.noise * noise.gaussian()).round().clamp(0.0, 255.0) as u8;
            }
            image
        })
    }

    fn reflectance(&self, on_board: &Vector3<f64>, ramp: f64) -> f64 {
        let square = self.spec.square;
        // Squares from the board's corner.
        let a = on_board.x / square + 0.5 * f64::from(self.spec.columns + 1);
        let b = on_board.y / square + 0.5 * f64::from(self.spec.rows + 1);
        let (columns, rows) = (f64::from(self.spec.columns) + 1.0, f64::from(self.spec.rows) + 1.0);
        let inside = |m: f64| a > -m && b > -m && a < columns + m && b < rows + m;
        if !inside(0.0) {
            return if inside(1.0) { BRIGHT } else { WALL };
        }
        let wave = |p: f64| {
            let nearest = p.round();
            let sign = if nearest.rem_euclid(2.0) < 0.5 { 1.0 } else { -1.0 };
            sign * (2.0 * (p - nearest) * square / ramp).clamp(-1.0, 1.0)
        };
        0.5 * (BRIGHT + DARK) - 0.5 * (BRIGHT - DARK) * wave(a) * wave(b)
    }
}

fn blurred(image: &[f32], width: usize, height: usize, sigma: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as isize;
    let mut kernel: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp() as f32).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let clamped = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
    let mut across = vec![0f32; image.len()];
    for (row, out) in image.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
        let padded: Vec<f32> = (-reach..width as isize + reach).map(|i| row[clamped(i, width)]).collect();
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(o, p)| *o += weight * p);
        }
    }
    let mut down = vec![0f32; image.len()];
    for (y, out) in down.chunks_exact_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = clamped(y as isize + k as isize - reach, height) * width;
            out.iter_mut().zip(&across[from..from + width]).for_each(|(o, p)| *o += weight * p);
        }
    }
    down
}
