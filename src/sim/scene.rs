//! The room: its walls, the boxes in it, a person who may walk through it, and rays through it.
//!
//! Room frame = rig frame of station 1 (x right, y down, z forward, metres). Walls and boxes are
//! those of the thesis's noise study (room with a back wall at 4.6 m and 5 boxes).

use nalgebra::{Vector2, Vector3};

use super::texture;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy)]
pub struct Solid {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

/// The room is seen from inside.
pub const ROOM: Solid = Solid { low: [-1.9, -1.3, -1.0], high: [2.0, 1.2, 4.6] };

pub const BOXES: [Solid; 5] = [
    Solid { low: [-0.7, 0.15, 1.7], high: [0.2, 1.2, 2.5] },
    Solid { low: [-0.48, -0.45, 1.05], high: [-0.28, 0.1, 1.3] },
    Solid { low: [0.25, 0.3, 1.35], high: [0.5, 1.2, 1.7] },
    Solid { low: [-0.9, -0.75, 1.9], high: [-0.45, -0.1, 2.4] },
    Solid { low: [0.1, -0.9, 2.9], high: [0.9, -0.1, 3.5] },
];

/// Six of the room, then six of each box; within a solid: 2 axis + (1 on the high side).
pub const FACES: usize = 6 * (1 + BOXES.len());

/// Faces that reflect a part of the laser's light like a mirror: the tops of the first and the third
/// box and the left side of the fifth.
pub const GLOSSY: [usize; 3] = [6 + 2, 18 + 2, 30];

/// Bit b set: box b is looked at.
pub type Candidates = u32;
pub const ALL_BOXES: Candidates = (1 << BOXES.len()) - 1;

/// A rectangle with coordinates (u, v) in metres from its corner.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    pub axis: usize,
    pub u_axis: usize,
    pub v_axis: usize,
    /// The face's coordinate along `axis`.
    pub plane: f64,
    pub corner: [f64; 2],
    pub size: [f64; 2],
    /// Unit, towards the side that is seen.
    pub normal: Vector3<f64>,
}

impl Face {
    pub fn new(index: usize) -> Self {
        let (solid, axis, high) = (index / 6, index % 6 / 2, index % 2 == 1);
        let s = if solid == 0 { ROOM } else { BOXES[solid - 1] };
        let (u_axis, v_axis) = [(2, 1), (0, 2), (0, 1)][axis];
        let outward = if high { 1.0 } else { -1.0 };
        Self {
            axis,
            u_axis,
            v_axis,
            plane: if high { s.high[axis] } else { s.low[axis] },
            corner: [s.low[u_axis], s.low[v_axis]],
            size: [s.high[u_axis] - s.low[u_axis], s.high[v_axis] - s.low[v_axis]],
            normal: Vector3::ith(axis, if solid == 0 { -outward } else { outward }),
        }
    }

    pub fn coordinates(&self, point: &Vector3<f64>) -> [f64; 2] {
        [point[self.u_axis] - self.corner[0], point[self.v_axis] - self.corner[1]]
    }
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// In lengths of the ray's direction vector.
    pub distance: f64,
    pub face: usize,
}

/// First wall or box along a ray that starts inside the room and outside the boxes. Of the boxes,
/// only `candidates` are looked at.
pub fn cast(origin: &Vector3<f64>, direction: &Vector3<f64>, candidates: Candidates) -> Hit {
    let inverse: [f64; 3] = std::array::from_fn(|i| {
        let d = direction[i];
        1.0 / if d.abs() < 1e-12 { 1e-12f64.copysign(d) } else { d }
    });
    let mut hit = Hit { distance: f64::INFINITY, face: 0 };
    for axis in 0..3 {
        let high = inverse[axis] > 0.0;
        let plane = if high { ROOM.high[axis] } else { ROOM.low[axis] };
        let distance = (plane - origin[axis]) * inverse[axis];
        if distance < hit.distance {
            hit = Hit { distance, face: 2 * axis + usize::from(high) };
        }
    }
    for (b, solid) in BOXES.iter().enumerate().filter(|(b, _)| candidates >> b & 1 == 1) {
        let (mut enter, mut leave, mut face) = (0.0, hit.distance, None);
        for axis in 0..3 {
            let low = (solid.low[axis] - origin[axis]) * inverse[axis];
            let high = (solid.high[axis] - origin[axis]) * inverse[axis];
            let near = low.min(high);
            if near > enter {
                enter = near;
                face = Some(6 * (1 + b) + 2 * axis + usize::from(high < low));
            }
            leave = leave.min(low.max(high));
        }
        if let Some(face) = face.filter(|_| enter < leave) {
            hit = Hit { distance: enter, face };
        }
    }
    hit
}

/// A person, flat like a cardboard figure, who walks to and fro between the boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Person {
    /// Where the figure's middle is.
    pub x: f64,
    /// How far the feet are apart, -1 to 1.
    pub stride: f64,
}

impl Person {
    /// Depth of the plane in which the person walks.
    pub const DEPTH: f64 = 2.65;
    pub const HALF_WIDTH: f64 = 0.32;
    pub const HEIGHT: f64 = 1.72;
    const SPEED: f64 = 1.0;
    const PATH: [f64; 2] = [-1.5, 1.6];

    /// At time `t`, seconds.
    pub fn at(t: f64) -> Self {
        let length = Self::PATH[1] - Self::PATH[0];
        let along = (t * Self::SPEED).rem_euclid(2.0 * length);
        let x = Self::PATH[0] + if along < length { along } else { 2.0 * length - along };
        Self { x, stride: (t * 2.0 * std::f64::consts::PI * 0.9).sin() }
    }

    /// Reflectance of the figure at a point of its plane; `None` beside it.
    pub fn albedo(&self, x: f64, y: f64) -> Option<[f64; 3]> {
        let (across, up) = (x - self.x, ROOM.high[1] - y);
        if (across / 0.1).powi(2) + ((up - 1.58) / 0.14).powi(2) < 1.0 {
            return Some([0.62, 0.45, 0.36]);
        }
        if (0.78..1.44).contains(&up) && across.abs() < 0.17 + 0.06 * (up - 0.78) {
            let fold = 0.05 * (across * 40.0).sin() + 0.03 * (up * 25.0).sin();
            return Some([0.22 + fold, 0.34 + fold, 0.36 + fold]);
        }
        let step = 0.2 * self.stride * (0.8 - up);
        let leg = (across - step).abs() < 0.085 || (across + step).abs() < 0.085;
        ((0.0..=0.78).contains(&up) && leg).then_some([0.24, 0.21, 0.2])
    }

    /// Where a ray passes through the figure.
    fn cross(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, [f64; 3])> {
        let distance = (Self::DEPTH - origin.z) / direction.z;
        let point = origin + direction * distance;
        let albedo = (distance > 0.0 && distance.is_finite()).then(|| self.albedo(point.x, point.y))??;
        Some((distance, albedo))
    }
}

/// A point on a surface.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    pub position: Vector3<f64>,
    pub normal: Vector3<f64>,
    /// Red, green, blue.
    pub albedo: [f64; 3],
    pub glossy: bool,
}

/// The first surface along a ray, person included.
pub fn trace(origin: &Vector3<f64>, direction: &Vector3<f64>, person: Option<&Person>) -> SurfacePoint {
    let hit = cast(origin, direction, ALL_BOXES);
    if let Some((distance, albedo)) = person.and_then(|p| p.cross(origin, direction)).filter(|c| c.0 < hit.distance) {
        let normal = Vector3::new(0.0, 0.0, -direction.z.signum());
        return SurfacePoint { position: origin + direction * distance, normal, albedo, glossy: false };
    }
    let (face, position) = (Face::new(hit.face), origin + direction * hit.distance);
    let albedo = texture::albedo(hit.face, Vector2::from(face.coordinates(&position)).map(|c| c as f32).into());
    SurfacePoint { position, normal: face.normal, albedo: albedo.map(f64::from), glossy: GLOSSY.contains(&hit.face) }
}

/// Is the way from `eye` to `point` (on a surface) clear?
pub fn visible(eye: &Vector3<f64>, point: &Vector3<f64>, person: Option<&Person>) -> bool {
    const ON_SURFACE: f64 = 1.0 - 1e-7;
    let way = point - eye;
    cast(eye, &way, ALL_BOXES).distance >= ON_SURFACE
        && person.and_then(|p| p.cross(eye, &way)).is_none_or(|(distance, _)| distance >= ON_SURFACE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn inside(s: &Solid, p: &Vector3<f64>, margin: f64) -> bool {
        (0..3).all(|i| p[i] > s.low[i] + margin && p[i] < s.high[i] - margin)
    }

    #[test]
    fn a_ray_ends_on_the_face_it_names_and_passes_nothing_before() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut uniform = move || rng.next_u32() as f64 / u32::MAX as f64 * 2.0 - 1.0;
        let mut boxes_hit = 0;
        for _ in 0..2000 {
            let origin = Vector3::new(0.3 * uniform(), 0.3 * uniform(), 0.3 * uniform());
            let direction = Vector3::new(uniform(), uniform(), uniform() + 0.6);
            let hit = cast(&origin, &direction, ALL_BOXES);
            let end = origin + direction * hit.distance;
            let face = Face::new(hit.face);
            assert!((end[face.axis] - face.plane).abs() < 1e-9);
            let [u, v] = face.coordinates(&end);
            assert!(u > -1e-9 && v > -1e-9 && u < face.size[0] + 1e-9 && v < face.size[1] + 1e-9);
            assert!(face.normal.dot(&direction) < 0.0, "the face is seen from its front");
            for k in 0..400 {
                let p = origin + direction * (hit.distance * k as f64 / 400.0);
                assert!(inside(&ROOM, &p, -1e-9) && BOXES.iter().all(|b| !inside(b, &p, 1e-9)));
            }
            boxes_hit += usize::from(hit.face >= 6);
            assert!(visible(&origin, &end, None));
            assert!(!visible(&origin, &(end + direction * 0.01), None));
        }
        assert!(boxes_hit > 200);
    }

    #[test]
    fn the_person_stands_in_the_way() {
        let person = Person { x: 0.5, stride: 0.0 };
        let eye = Vector3::new(0.4, 0.0, 0.0);
        let wall = trace(&eye, &Vector3::new(0.06, 0.15, 4.6), None).position;
        assert!((wall.z - 4.6).abs() < 1e-9);
        assert!(!visible(&eye, &wall, Some(&person)));
        assert!(visible(&eye, &wall, Some(&Person { x: -1.0, stride: 0.0 })));
        let on_person = trace(&eye, &(wall - eye), Some(&person));
        assert!((on_person.position.z - Person::DEPTH).abs() < 1e-12);
        assert!(visible(&eye, &on_person.position, Some(&person)));
    }

    #[test]
    fn the_person_stays_in_the_room_and_moves_steadily() {
        for k in 0..400 {
            let (a, b) = (Person::at(k as f64 * 0.04), Person::at((k + 1) as f64 * 0.04));
            assert!((a.x - b.x).abs() <= 0.04 + 1e-9);
            assert!(a.x - Person::HALF_WIDTH > ROOM.low[0] && a.x + Person::HALF_WIDTH < ROOM.high[0]);
        }
    }
}
