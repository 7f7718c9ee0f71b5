//! Thinning: one point for each occupied voxel.

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};
use crate::geometry::point_cloud::{pack, unpack};
use crate::geometry::{CloudNoise, PointCloud};

/// Bits of a voxel's number along one axis.
const BITS: u32 = 21;

/// Thins a cloud out: the points in each cube of side `voxel` (metres) of a grid through the world's
/// origin become one. Where noise is known, that is the mean weighted by information,
/// x = (sum W)^-1 sum W x_i with W = (C_i + h^2/12 I)^-1: the points are measurements of different
/// places in the voxel, uniformly spread over its side h, so that even a point without noise, or a
/// laser shot's without noise across its ray, tells the mean no better than that. The noise of the
/// result is that of the measurements, (sum W)^-1 (sum W C_i W) (sum W)^-1, taken to be independent of
/// each other. Colours and normals are averaged.
///
/// Results are ordered by voxel and do not depend on anything else.
///
/// # Errors
/// The cloud's own; `InvalidArgument` for a voxel that is not positive, or so small that the cloud
/// has more than 2^21 of them along an axis.
pub fn thin(cloud: &PointCloud, voxel: f64) -> Result<PointCloud> {
    cloud.validate()?;
    // Beyond this its square means nothing.
    if !(voxel > 0.0 && voxel <= 1e9) {
        return Err(Error::invalid("voxel", format!("{voxel} m is no size")));
    }
    let mut order = sorted_by_voxel(cloud, voxel)?;
    let mut thinned = PointCloud {
        normals: cloud.normals.as_ref().map(|_| Vec::new()),
        noise: match cloud.noise {
            CloudNoise::Unknown => CloudNoise::Unknown,
            CloudNoise::Deviations(_) => CloudNoise::Deviations(Vec::new()),
            CloudNoise::Covariances(_) => CloudNoise::Covariances(Vec::new()),
        },
        ..Default::default()
    };
    let spread = voxel * voxel / 12.0;
    for members in order.chunk_by_mut(|a, b| a.0 == b.0) {
        let indices = || members.iter().map(|(_, i)| *i as usize);
        if let [(_, only)] = members {
            append(&mut thinned, cloud, *only as usize);
            continue;
        }
        thinned.colours.push(mean_colour(indices().map(|i| cloud.colours[i])));
        if let (Some(out), Some(normals)) = (&mut thinned.normals, &cloud.normals) {
            let sum: Vector3<f64> = indices().map(|i| normals[i]).sum();
            out.push(sum.try_normalize(0.0).unwrap_or_default());
        }
        // Differences from the first: no digits are lost far from the origin.
        let first = cloud.positions[members[0].1 as usize];
        let offset = |i: usize| cloud.positions[i] - first;
        let mean = match (&cloud.noise, &mut thinned.noise) {
            (CloudNoise::Deviations(d), CloudNoise::Deviations(out)) => {
                let (mut total, mut sum, mut noise) = (0.0, Vector3::zeros(), 0.0);
                for i in indices() {
                    let variance = d[i] * d[i];
                    let weight = 1.0 / (variance / 3.0 + spread);
                    total += weight;
                    sum += offset(i) * weight;
                    noise += weight * weight * variance;
                }
                out.push(noise.sqrt() / total);
                sum / total
            }
            (CloudNoise::Covariances(c), CloudNoise::Covariances(out)) => {
                let (mut total, mut sum, mut noise) = (Matrix3::zeros(), Vector3::zeros(), Matrix3::zeros());
                for i in indices() {
                    let c = unpack(&c[i]);
                    let weight = inverse(&(c + Matrix3::from_diagonal_element(spread)), spread);
                    total += weight;
                    sum += weight * offset(i);
                    noise += weight * c * weight;
                }
                let gain = inverse(&total, 0.0);
                out.push(pack(&(gain * noise * gain)));
                gain * sum
            }
            _ => indices().map(offset).sum::<Vector3<f64>>() / members.len() as f64,
        };
        thinned.positions.push(first + mean);
    }
    Ok(thinned)
}

/// Indices of the points with their voxels' numbers, in order.
fn sorted_by_voxel(cloud: &PointCloud, voxel: f64) -> Result<Vec<(u64, u32)>> {
    let cell = |p: &Vector3<f64>| p.map(|v| (v / voxel).floor());
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for p in &cloud.positions {
        let c = cell(p);
        low = low.inf(&c);
        high = high.sup(&c);
    }
    // A floor beyond 2^53 is no voxel's number.
    let most = f64::from(1u32 << BITS);
    let exact = (1u64 << 53) as f64;
    let fits = |i: usize| high[i] - low[i] < most && low[i].abs() < exact && high[i].abs() < exact;
    if !cloud.is_empty() && !(0..3).all(fits) {
        let extent = (high - low).max() * voxel;
        let reason = format!("{voxel} m is too small for a cloud of {extent:.6e} m: {most} voxels a side are the most");
        return Err(Error::invalid("voxel", reason));
    }
    let number = |p: &Vector3<f64>| {
        let c = cell(p) - low;
        [c.z, c.y, c.x].iter().fold(0u64, |number, v| number << BITS | *v as u64)
    };
    let mut order: Vec<(u64, u32)> = cloud.positions.iter().zip(0u32..).map(|(p, i)| (number(p), i)).collect();
    order.sort_unstable();
    Ok(order)
}

fn append(thinned: &mut PointCloud, cloud: &PointCloud, index: usize) {
    thinned.positions.push(cloud.positions[index]);
    thinned.colours.push(cloud.colours[index]);
    if let (Some(out), Some(normals)) = (&mut thinned.normals, &cloud.normals) {
        out.push(normals[index]);
    }
    match (&mut thinned.noise, &cloud.noise) {
        (CloudNoise::Deviations(out), CloudNoise::Deviations(d)) => out.push(d[index]),
        (CloudNoise::Covariances(out), CloudNoise::Covariances(c)) => out.push(c[index]),
        _ => {}
    }
}

/// Inverse of a positive definite matrix; of one that is not, by rounding, what `spread` alone gives.
fn inverse(m: &Matrix3<f64>, spread: f64) -> Matrix3<f64> {
    // Scaled, so that no determinant under- or overflows.
    let scale = m.amax();
    let inverse = (m / scale).try_inverse().map(|i| i / scale);
    inverse.filter(|i| i.iter().all(|v| v.is_finite())).unwrap_or_else(|| {
        Matrix3::from_diagonal_element(if spread > 0.0 { 1.0 / (scale + spread) } else { 1.0 / scale })
    })
}

fn mean_colour(colours: impl Iterator<Item = [u8; 3]>) -> [u8; 3] {
    let (mut sum, mut count) = ([0u64; 3], 0u64);
    for colour in colours {
        (0..3).for_each(|i| sum[i] += u64::from(colour[i]));
        count += 1;
    }
    sum.map(|s| ((s + count / 2) / count.max(1)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::Random;

    fn random_cloud(n: usize, seed: u64) -> PointCloud {
        let mut random = Random(seed);
        let mut unit = || random.below(1 << 30) as f64 / (1u64 << 30) as f64;
        let positions: Vec<_> = (0..n).map(|_| Vector3::new(unit() * 4.0 - 2.0, unit() - 0.5, 3.0 * unit())).collect();
        PointCloud { colours: vec![[10, 20, 30]; n], positions, ..Default::default() }
    }

    #[test]
    fn one_point_a_voxel_and_the_plain_mean_without_noise() {
        let cloud = PointCloud {
            positions: vec![Vector3::new(0.1, 0.1, 0.1), Vector3::new(0.3, 0.2, 0.4), Vector3::new(-0.1, 0.0, 0.0)],
            colours: vec![[0, 10, 255], [1, 20, 255], [7, 8, 9]],
            ..Default::default()
        };
        let thinned = thin(&cloud, 0.5).unwrap();
        assert_eq!(thinned.len(), 2);
        assert_eq!((thinned.positions[0], thinned.colours[0]), (cloud.positions[2], [7, 8, 9]));
        assert!((thinned.positions[1] - Vector3::new(0.2, 0.15, 0.25)).norm() < 1e-15);
        assert_eq!(thinned.colours[1], [1, 15, 255]);
    }

    /// The same whatever the order of the points, and every point within its voxel.
    #[test]
    fn the_order_of_points_does_not_matter() {
        let cloud = random_cloud(5000, 3);
        let reversed = cloud.select(&(0..cloud.len()).rev().collect::<Vec<_>>());
        let (a, b) = (thin(&cloud, 0.2).unwrap(), thin(&reversed, 0.2).unwrap());
        assert_eq!(a.len(), b.len());
        assert!(a.positions.iter().zip(&b.positions).all(|(a, b)| (a - b).norm() < 1e-14));
        let mut voxels: Vec<_> = cloud.positions.iter().map(|p| p.map(|v| (v / 0.2).floor() as i64)).collect();
        voxels.sort_by_key(|v| (v.z, v.y, v.x));
        voxels.dedup();
        let found: Vec<_> = a.positions.iter().map(|p| p.map(|v| (v / 0.2).floor() as i64)).collect();
        assert_eq!(found, voxels);
    }

    /// Two rays cross: each is good across itself, so that the mean is nearer the crossing than the
    /// plain one; its covariance is that of the noise, by simulation.
    #[test]
    fn weights_are_the_points_information() {
        let mut random = Random(5);
        let mut gauss = || (0..12).map(|_| random.below(1 << 30) as f64 / (1u64 << 30) as f64).sum::<f64>() - 6.0;
        let (along, sigma) = ([Vector3::new(1.0, 0.2, 0.1), Vector3::new(-0.1, 0.3, 1.0)], [0.05, 0.02]);
        let covariances: Vec<_> =
            (0..2).map(|i| pack(&(along[i] * along[i].transpose() * f64::powi(sigma[i], 2)))).collect();
        let truth = Vector3::repeat(0.5);
        let (mut sum, mut weighted, mut plain, runs) = (Matrix3::zeros(), 0.0, 0.0, 20_000);
        let mut stated = Matrix3::zeros();
        for _ in 0..runs {
            let positions: Vec<_> = (0..2).map(|i| truth + along[i] * sigma[i] * gauss()).collect();
            let mean = positions.iter().sum::<Vector3<f64>>() / 2.0;
            let cloud = PointCloud {
                positions,
                colours: vec![[0; 3]; 2],
                normals: None,
                noise: CloudNoise::Covariances(covariances.clone()),
            };
            let thinned = thin(&cloud, 1.0).unwrap();
            let e = thinned.positions[0] - truth;
            stated = thinned.noise.covariance(0).unwrap();
            sum += e * e.transpose() / f64::from(runs);
            weighted += e.norm_squared();
            plain += (mean - truth).norm_squared();
        }
        assert!((sum - stated).amax() < 0.04 * stated.amax(), "{sum} {stated}");
        assert!(weighted < plain);
        // A small voxel: the crossing itself.
        let at = |i: usize, s: f64| truth + along[i] * s;
        let cloud = PointCloud {
            positions: vec![at(0, 0.004), at(1, -0.003)],
            colours: vec![[0; 3]; 2],
            normals: None,
            noise: CloudNoise::Covariances(covariances),
        };
        let tight =
            thin(&PointCloud { positions: cloud.positions.iter().map(|p| p * 0.02).collect(), ..cloud.clone() }, 0.02);
        assert!((tight.unwrap().positions[0] / 0.02 - truth).norm() < 1e-3);
    }

    #[test]
    fn deviations_and_isotropic_covariances_agree() {
        let cloud = random_cloud(2000, 9);
        let deviations: Vec<f64> = (0..2000).map(|i| 0.001 * (1 + i % 7) as f64).collect();
        let scalar = PointCloud { noise: CloudNoise::Deviations(deviations), ..cloud };
        let full = PointCloud { noise: scalar.noise.clone().into_covariances(), ..scalar.clone() };
        let (a, b) = (thin(&scalar, 0.3).unwrap(), thin(&full, 0.3).unwrap());
        for i in 0..a.len() {
            assert!((a.positions[i] - b.positions[i]).norm() < 1e-12);
            assert!((a.noise.deviation(i).unwrap() - b.noise.deviation(i).unwrap()).abs() < 1e-12);
        }
    }

    #[test]
    fn sizes_are_guarded() {
        let cloud = random_cloud(10, 1);
        for voxel in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-7, f64::MIN_POSITIVE, 1e10] {
            assert!(thin(&cloud, voxel).is_err(), "{voxel}");
        }
        // Four octants around the origin: z is positive.
        assert!((1..=4).contains(&thin(&cloud, 1e9).unwrap().len()));
        assert!(thin(&PointCloud::default(), 0.1).unwrap().is_empty());
        let huge = PointCloud { positions: vec![Vector3::repeat(1e300)], colours: vec![[0; 3]], ..Default::default() };
        assert!(thin(&huge, 0.1).is_err());
        let twice = PointCloud { positions: vec![Vector3::x(); 9], colours: vec![[5; 3]; 9], ..Default::default() };
        assert_eq!(thin(&twice, 0.1).unwrap().positions, [Vector3::x()]);
        // No noise at all: the mean all the same.
        let exact = PointCloud { noise: CloudNoise::Covariances(vec![[0.0; 6]; 9]), ..twice };
        assert_eq!(thin(&exact, 0.1).unwrap().positions, [Vector3::x()]);
    }

    #[test]
    #[ignore = "a measurement; run it in release"]
    fn measure_a_million() {
        let cloud = random_cloud(1_000_000, 2);
        let noisy = PointCloud {
            noise: CloudNoise::Covariances(vec![[1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4]; 1_000_000]),
            ..cloud.clone()
        };
        for (name, cloud) in [("plain", &cloud), ("covariances", &noisy)] {
            for voxel in [0.01, 0.05, 0.2] {
                let begun = std::time::Instant::now();
                let n = thin(cloud, voxel).unwrap().len();
                println!("{name} {voxel} m: {n} points, {:.1} ms", begun.elapsed().as_secs_f64() * 1e3);
            }
        }
    }
}
