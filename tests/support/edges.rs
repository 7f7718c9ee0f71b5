//! Edges of the simulated room and its boxes (support/thesis.rs) as image segments of a camera.
#![allow(dead_code)]

use nalgebra::{Matrix2, Vector2, Vector3};
use ptzcal::calibrate::{Correspondences, ObservedLine};
use ptzcal::geometry::Camera;

use super::thesis::{BOXES, Noise, ROOM};

/// A piece of an edge, seen whole: its ends in space and, without noise, in the image.
#[derive(Clone, Copy)]
pub struct Edge {
    pub ends: [Vector3<f64>; 2],
    pub pixels: [Vector2<f64>; 2],
}

/// The twelve edges of a box.
fn edges_of(b: &[[f64; 3]; 2]) -> Vec<[Vector3<f64>; 2]> {
    let corner = |i: usize| Vector3::from_fn(|axis, _| b[i >> axis & 1][axis]);
    (0..8)
        .flat_map(|i| (0..3).filter(move |axis| i >> axis & 1 == 0).map(move |axis| [corner(i), corner(i | 1 << axis)]))
        .collect()
}

/// `n` random pieces of edges that the camera sees, at least 40 px long.
pub fn edges(camera: &Camera, n: usize) -> Vec<Edge> {
    let all: Vec<_> = BOXES.iter().chain([&ROOM]).flat_map(edges_of).collect();
    let mut noise = Noise::new(11);
    let inside = |m: &Vector2<f64>| m.x > 0.0 && m.y > 0.0 && m.x < 800.0 && m.y < 600.0;
    // Far outside the view a lens polynomial folds back into the image; a real lens does not.
    let seen = |x: &Vector3<f64>| {
        let pixel = camera.project(x).filter(inside)?;
        let ray = camera.back_project(&pixel)?;
        ((x - ray.origin).normalize().dot(&ray.direction) > 0.999).then_some(pixel)
    };
    let mut found = Vec::new();
    while found.len() < n {
        let [a, b] = all[(noise.uniform() * all.len() as f64) as usize];
        let ends = [0, 1].map(|_| a + (b - a) * noise.uniform());
        let pixels = ends.map(|x| seen(&x));
        if let [Some(p), Some(q)] = pixels
            && (p - q).norm() >= 40.0
        {
            found.push(Edge { ends, pixels: [p, q] });
        }
    }
    found
}

/// The edge as an observation whose line is named by two other points than the segment's ends.
pub fn observed(edge: &Edge, noise: &mut Noise, sigma: f64, stated: bool) -> ObservedLine {
    let [a, b] = edge.ends;
    let pixels = edge.pixels.map(|m| m + noise.pixel(sigma));
    let mut line = ObservedLine::new(a - (b - a) * 3.0, (a - b) * 0.7, pixels);
    line.end_covariances = stated.then_some([Matrix2::identity() * (sigma * sigma); 2]);
    line
}

pub fn line_set(edges: &[Edge], sigma: f64, stated: bool, noise: &mut Noise) -> Correspondences {
    let mut set = Correspondences::new(800, 600).unwrap();
    set.add_all(edges.iter().map(|e| observed(e, noise, sigma, stated).into())).unwrap();
    set
}
