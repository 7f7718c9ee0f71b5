//! Planes that pairs of stations call the same become one.

use super::{Link, Seen};

/// For each plane that two stations or more saw: (station, its number there), each station once. The
/// largest first in every station, as they were found.
pub(super) fn planes(seen: &[Seen], links: &[Link]) -> Vec<Vec<(usize, usize)>> {
    let mut groups: Vec<Vec<(usize, usize)>> = Vec::new();
    for (station, seen) in seen.iter().enumerate() {
        let count = seen.planes.as_ref().map_or(0, |p| p.planes.len());
        groups.extend((0..count).map(|plane| vec![(station, plane)]));
    }
    for link in links {
        let Ok(pose) = &link.pose else { continue };
        for pair in &pose.matches {
            let place = |k: usize| {
                let wanted = (link.stations[k], pair[k]);
                groups.iter().position(|g| g.contains(&wanted))
            };
            let (Some(a), Some(b)) = (place(0), place(1)) else { continue };
            // Two planes of one station are two: that match was one too many.
            let clash = groups[a].iter().any(|(s, _)| groups[b].iter().any(|(t, _)| s == t));
            if a != b && !clash {
                let other = groups.swap_remove(a.max(b));
                groups[a.min(b)].extend(other);
            }
        }
    }
    groups.retain(|g| g.len() > 1);
    groups.iter_mut().for_each(|g| g.sort_unstable());
    groups.sort_unstable();
    groups
}
