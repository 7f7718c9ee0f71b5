//! Loops of stations: links that come back to where they began must close.

use std::collections::VecDeque;
use std::fmt;

use nalgebra::{Matrix6, Vector6};

use super::Link;
use crate::geometry::Rigid;
use crate::geometry::chi_square::upper_tail;
use crate::geometry::rigid::{log, skew};

/// A loop of stations, and what is left when its links are followed all the way around.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopClosure {
    /// In order; the last is linked to the first.
    pub stations: Vec<usize>,
    /// Angle that is left, radians.
    pub rotation: f64,
    /// Distance that is left, metres.
    pub position: f64,
    /// Chance of that or more by the links' covariances (they share planes, which makes it a little too
    /// large).
    pub probability: f64,
}

impl fmt::Display for LoopClosure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let around: Vec<String> = self.stations.iter().map(usize::to_string).collect();
        write!(
            f,
            "the loop of stations {} does not close: {:.2} degrees and {:.3} m are left (chance {:.1e}), so that one of \
             its links took planes for others",
            around.join(", "),
            self.rotation.to_degrees(),
            self.position,
            self.probability
        )
    }
}

/// A pose with the covariance of (w, t), as [`StationPose`](crate::pose::StationPose) has them.
#[derive(Clone, Copy)]
struct Uncertain {
    pose: Rigid,
    covariance: Matrix6<f64>,
}

impl Uncertain {
    fn exact() -> Self {
        Self { pose: Rigid::identity(), covariance: Matrix6::zeros() }
    }

    /// This pose after the other: X = self(other(x)).
    fn after(&self, other: &Self) -> Self {
        // Turning self turns other's position about it; other's errors are turned by self.
        let r = self.pose.rotation;
        let mut by_self = Matrix6::identity();
        by_self.fixed_view_mut::<3, 3>(3, 0).copy_from(&-skew(&(r * other.pose.translation)));
        let mut by_other = Matrix6::zeros();
        by_other.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
        by_other.fixed_view_mut::<3, 3>(3, 3).copy_from(&r);
        Self {
            pose: self.pose.after(&other.pose),
            covariance: by_self * self.covariance * by_self.transpose()
                + by_other * other.covariance * by_other.transpose(),
        }
    }

    fn inverse(&self) -> Self {
        let pose = self.pose.inverse();
        let r = pose.rotation;
        // w' = -R^T w; t' = -R^T t: a turn moves it about the origin.
        let mut by = Matrix6::zeros();
        by.fixed_view_mut::<3, 3>(0, 0).copy_from(&-r);
        by.fixed_view_mut::<3, 3>(3, 3).copy_from(&-r);
        by.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-r * skew(&self.pose.translation)));
        Self { pose, covariance: by * self.covariance * by.transpose() }
    }
}

/// One loop for each link whose stations surer links tie already: the shortest that it closes.
pub(super) fn close(stations: usize, links: &[Link]) -> Vec<LoopClosure> {
    let known = |link: &Link| {
        let pose = link.pose.as_ref().ok()?;
        Some((link.stations, Uncertain { pose: pose.b_to_a, covariance: pose.covariance }))
    };
    let mut edges: Vec<([usize; 2], Uncertain)> = links.iter().filter_map(known).collect();
    edges.sort_by(|a, b| a.1.covariance.trace().total_cmp(&b.1.covariance.trace()));
    let closed = edges.iter().enumerate().filter_map(|(i, (ends, link))| {
        let (around, direct) = path(stations, &edges[..i], ends[0], ends[1])?;
        Some(closure(around, link, &direct))
    });
    closed.collect()
}

/// The shortest way between two stations, and the pose of its end in the frame of its beginning.
fn path(stations: usize, edges: &[([usize; 2], Uncertain)], from: usize, to: usize) -> Option<(Vec<usize>, Uncertain)> {
    let mut came: Vec<Option<(usize, Uncertain)>> = vec![None; stations];
    let mut queue = VecDeque::from([from]);
    came[from] = Some((from, Uncertain::exact()));
    while let Some(at) = queue.pop_front() {
        if at == to {
            break;
        }
        let here = came[at].map(|(_, pose)| pose)?;
        for (ends, link) in edges {
            let (next, step) = match *ends {
                [a, b] if a == at => (b, *link),
                [a, b] if b == at => (a, link.inverse()),
                _ => continue,
            };
            if came[next].is_none() {
                came[next] = Some((at, here.after(&step)));
                queue.push_back(next);
            }
        }
    }
    let pose = came[to]?.1;
    let mut around = vec![to];
    while let Some(last) = around.last().copied().filter(|last| *last != from) {
        around.push(came[last]?.0);
    }
    around.reverse();
    Some((around, pose))
}

fn closure(stations: Vec<usize>, link: &Uncertain, path: &Uncertain) -> LoopClosure {
    let turn = log(&(path.pose.rotation * link.pose.rotation.transpose()));
    let shift = path.pose.translation - link.pose.translation;
    let left = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
    let total = path.covariance + link.covariance;
    let probability = total.cholesky().map_or(0.0, |c| upper_tail(left.dot(&c.solve(&left)), 6.0));
    LoopClosure { stations, rotation: turn.norm(), position: shift.norm(), probability }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::rigid::{exp, rotation_y};

    fn moved(u: &Uncertain, by: &Vector6<f64>) -> Rigid {
        let turn = exp(&Vector3::new(by[0], by[1], by[2]));
        Rigid { rotation: turn * u.pose.rotation, translation: u.pose.translation + Vector3::new(by[3], by[4], by[5]) }
    }

    fn difference(a: &Rigid, b: &Rigid) -> Vector6<f64> {
        let (w, t) = (log(&(a.rotation * b.rotation.transpose())), a.translation - b.translation);
        Vector6::new(w.x, w.y, w.z, t.x, t.y, t.z)
    }

    fn uncertain(turn: f64, at: [f64; 3], seed: f64) -> Uncertain {
        let root = Matrix6::from_fn(|i, j| ((i * 7 + j * 3) as f64 * seed).sin() * 1e-3);
        let pose = Rigid { rotation: rotation_y(turn) * exp(&Vector3::new(0.1, 0.2, -0.3)), translation: at.into() };
        Uncertain { pose, covariance: root * root.transpose() }
    }

    /// Covariances of composed and inverted poses against derivatives by differences.
    #[test]
    fn errors_are_carried_along() {
        let (a, b) = (uncertain(0.4, [1.0, -2.0, 0.5], 1.3), uncertain(-0.9, [0.3, 0.8, 2.0], 0.7));
        let numeric = |f: &dyn Fn(&Vector6<f64>) -> Rigid, c: &Matrix6<f64>| {
            let at = f(&Vector6::zeros());
            let mut j = Matrix6::zeros();
            for k in 0..6 {
                let step = Vector6::ith(k, 1e-6);
                j.set_column(k, &(difference(&f(&step), &at) / 1e-6));
            }
            j * c * j.transpose()
        };
        let both = a.after(&b);
        let wanted = numeric(&|s| moved(&a, s).after(&b.pose), &a.covariance)
            + numeric(&|s| a.pose.after(&moved(&b, s)), &b.covariance);
        assert!((both.covariance - wanted).amax() < 1e-4 * wanted.amax());
        let wanted = numeric(&|s| moved(&a, s).inverse(), &a.covariance);
        assert!((a.inverse().covariance - wanted).amax() < 1e-4 * wanted.amax());
        let round = a.after(&a.inverse()).pose;
        assert!(difference(&round, &Rigid::identity()).norm() < 1e-12);
    }
}
