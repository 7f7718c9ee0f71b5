//! All distances between two sets of descriptors, by dot products in integers: exact, and the same on
//! every processor.
//!
//! The descriptors of `b` are laid out so that a vector instruction works on sixteen of them at once:
//! four numbers of each, then the next four. They are kept minus 128, as the instruction for dot products
//! of bytes (AVX-512 VNNI) takes unsigned times signed ones.
#![allow(unsafe_code)]

use super::descriptor::{DESCRIPTOR_SIZE, Descriptor};

/// Descriptors of `b` in a block, and of `a` in a group.
const BLOCK: usize = 16;
const GROUP: usize = 8;
/// Descriptors of `a` that meet all of `b` before the next ones do: they stay in the first cache.
const TILE: usize = 128;
/// Squared distance of what is not there; the largest possible one is 128 x 255^2.
const FAR: i32 = i32::MAX / 2;

/// The nearest descriptor of the other set; of equals, the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Nearest {
    pub index: usize,
    /// Squared distance; `None` where the other set is empty.
    pub best: Option<i32>,
    /// Squared distance of the second nearest; `None` where there is none.
    pub second: Option<i32>,
}

/// For each of `a` its nearest of `b`, and for each of `b` the index of its nearest of `a`.
pub fn nearest(a: &[Descriptor], b: &[Descriptor]) -> (Vec<Nearest>, Vec<usize>) {
    let mut search = Search::new(a, b);
    search.run();
    let known = |d: i32| (d < FAR / 2).then_some(d);
    let forward = search.forward.iter().take(a.len());
    let forward = forward.map(|n| Nearest { index: n.index as usize, best: known(n.best), second: known(n.second) });
    let backward = search.blocks.iter().flat_map(|block| block.index).take(b.len());
    (forward.collect(), backward.map(|i| i as usize).collect())
}

struct Search {
    groups: Vec<[Descriptor; GROUP]>,
    /// |a|^2 - 256 sum of a: what is left of the squared distance beside |b|^2 and the products.
    rest: Vec<i32>,
    forward: Vec<Two>,
    blocks: Vec<Block>,
}

#[derive(Clone, Copy)]
struct Two {
    best: i32,
    second: i32,
    index: u32,
}

struct Block {
    /// Of each quadruple of numbers those of all descriptors, minus 128.
    quads: [[[i8; 4]; BLOCK]; DESCRIPTOR_SIZE / 4],
    /// |b|^2.
    norms: [i32; BLOCK],
    best: [i32; BLOCK],
    index: [u32; BLOCK],
}

impl Block {
    fn new(descriptors: &[Descriptor]) -> Self {
        let mut block = Self {
            quads: [[[0; 4]; BLOCK]; DESCRIPTOR_SIZE / 4],
            norms: [FAR; BLOCK],
            best: [FAR; BLOCK],
            index: [0; BLOCK],
        };
        for (lane, descriptor) in descriptors.iter().enumerate() {
            block.norms[lane] = norm(descriptor);
            for (quads, four) in block.quads.iter_mut().zip(descriptor.as_chunks::<4>().0) {
                quads[lane] = four.map(|v| (v ^ 128) as i8);
            }
        }
        block
    }
}

fn norm(descriptor: &Descriptor) -> i32 {
    descriptor.iter().map(|v| i32::from(*v).pow(2)).sum()
}

/// Products of a group of `a` with a block of `b`.
type Products = [[i32; BLOCK]; GROUP];

impl Search {
    fn new(a: &[Descriptor], b: &[Descriptor]) -> Self {
        let rest = |d: &Descriptor| norm(d) - 256 * d.iter().map(|v| i32::from(*v)).sum::<i32>();
        let group = |some: &[Descriptor]| std::array::from_fn(|i| some.get(i).copied().unwrap_or([0; DESCRIPTOR_SIZE]));
        Self {
            groups: a.chunks(GROUP).map(group).collect(),
            rest: a.iter().map(rest).collect(),
            forward: vec![Two { best: FAR, second: FAR, index: 0 }; a.len()],
            blocks: b.chunks(BLOCK).map(Block::new).collect(),
        }
    }

    fn run(&mut self) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512vnni")
            {
                // SAFETY: the processor has the features.
                return unsafe { x86::with_vnni(self) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has the feature.
                return unsafe { x86::with_avx2(self) };
            }
        }
        self.compare(portable);
    }

    #[inline(always)]
    fn compare(&mut self, products: impl Fn(&[Descriptor; GROUP], &Block) -> Products) {
        let all = self.groups.chunks(TILE / GROUP).zip(self.rest.chunks(TILE)).zip(self.forward.chunks_mut(TILE));
        for (tile, ((groups, rest), forward)) in all.enumerate() {
            for (number, block) in self.blocks.iter_mut().enumerate() {
                let parts = groups.iter().zip(rest.chunks(GROUP)).zip(forward.chunks_mut(GROUP));
                for (g, ((group, rest), forward)) in parts.enumerate() {
                    let first = (tile * TILE + g * GROUP) as u32;
                    let products = products(group, block);
                    for (i, ((rest, two), products)) in rest.iter().zip(forward).zip(&products).enumerate() {
                        block.meet(first + i as u32, *rest, products, two, number);
                    }
                }
            }
        }
    }
}

impl Block {
    #[inline(always)]
    fn meet(&mut self, a: u32, rest: i32, products: &[i32; BLOCK], two: &mut Two, number: usize) {
        let mut distances = [0; BLOCK];
        let mut any = false;
        for l in 0..BLOCK {
            let d = self.norms[l] + rest - 2 * products[l];
            distances[l] = d;
            any |= d < two.second;
            let closer = d < self.best[l];
            self.best[l] = if closer { d } else { self.best[l] };
            self.index[l] = if closer { a } else { self.index[l] };
        }
        if any {
            for (l, d) in distances.iter().enumerate() {
                if *d < two.best {
                    *two = Two { best: *d, second: two.best, index: (number * BLOCK + l) as u32 };
                } else if *d < two.second {
                    two.second = *d;
                }
            }
        }
    }
}

#[inline(always)]
fn portable(group: &[Descriptor; GROUP], block: &Block) -> Products {
    let mut products = [[0; BLOCK]; GROUP];
    for (q, quads) in block.quads.iter().enumerate() {
        for (a, sums) in group.iter().zip(&mut products) {
            let four = &a[4 * q..4 * q + 4];
            for (sum, quad) in sums.iter_mut().zip(quads) {
                *sum += four.iter().zip(quad).map(|(a, b)| i32::from(*a) * i32::from(*b)).sum::<i32>();
            }
        }
    }
    products
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{BLOCK, Block, Descriptor, GROUP, Products, Search};

    #[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni")]
    pub fn with_vnni(search: &mut Search) {
        search.compare(|a, b| vnni(a, b));
    }

    #[target_feature(enable = "avx2")]
    pub fn with_avx2(search: &mut Search) {
        search.compare(|a, b| avx2(a, b));
    }

    #[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vnni")]
    #[inline]
    fn vnni(group: &[Descriptor; GROUP], block: &Block) -> Products {
        let mut sums = [_mm512_setzero_si512(); GROUP];
        for (q, quads) in block.quads.iter().enumerate() {
            // SAFETY: 64 bytes are there.
            let b = unsafe { _mm512_loadu_si512(quads.as_ptr().cast()) };
            for (a, sum) in group.iter().zip(&mut sums) {
                let four = i32::from_ne_bytes(a.as_chunks().0[q]);
                *sum = _mm512_dpbusd_epi32(*sum, _mm512_set1_epi32(four), b);
            }
        }
        let mut products = [[0; BLOCK]; GROUP];
        for (sum, out) in sums.iter().zip(&mut products) {
            // SAFETY: 64 bytes are there.
            unsafe { _mm512_storeu_si512(out.as_mut_ptr().cast(), *sum) };
        }
        products
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn avx2(group: &[Descriptor; GROUP], block: &Block) -> Products {
        let mut products = [[0; BLOCK]; GROUP];
        // Two of `a` at a time: eight sums, each of two parts for four of `b`.
        for (pair, out) in group.as_chunks::<2>().0.iter().zip(products.as_chunks_mut::<2>().0) {
            let mut sums = [[_mm256_setzero_si256(); 4]; 2];
            for (q, quads) in block.quads.iter().enumerate() {
                let wide = pair.each_ref().map(|a| {
                    let four = i32::from_ne_bytes(a.as_chunks().0[q]);
                    _mm256_cvtepu8_epi16(_mm_set1_epi32(four))
                });
                for (part, of_four) in quads.as_chunks::<4>().0.iter().enumerate() {
                    // SAFETY: 16 bytes are there.
                    let b = _mm256_cvtepi8_epi16(unsafe { _mm_loadu_si128(of_four.as_ptr().cast()) });
                    for (sum, a) in sums.iter_mut().zip(wide) {
                        sum[part] = _mm256_add_epi32(sum[part], _mm256_madd_epi16(a, b));
                    }
                }
            }
            for (sums, out) in sums.iter().zip(out) {
                for (sum, out) in sums.iter().zip(out.as_chunks_mut::<4>().0) {
                    let mut halves = [0i32; 8];
                    // SAFETY: 32 bytes are there.
                    unsafe { _mm256_storeu_si256(halves.as_mut_ptr().cast(), *sum) };
                    *out = std::array::from_fn(|l| halves[2 * l] + halves[2 * l + 1]);
                }
            }
        }
        products
    }
}

#[cfg(test)]
mod tests {
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    use super::*;

    fn random(n: usize, seed: u64, levels: u32) -> Vec<Descriptor> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| std::array::from_fn(|_| (rng.next_u32() % levels * (255 / (levels - 1))) as u8)).collect()
    }

    /// By subtraction, one pair after the other.
    fn plainly(a: &[Descriptor], b: &[Descriptor]) -> Vec<Nearest> {
        let distance = |a: &Descriptor, b: &Descriptor| -> i32 {
            a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2)).sum()
        };
        let nearest = |a: &Descriptor| {
            let mut all: Vec<(i32, usize)> = b.iter().enumerate().map(|(j, b)| (distance(a, b), j)).collect();
            all.sort_unstable();
            let second = all.get(1).map(|s| s.0);
            Nearest { index: all.first().map_or(0, |s| s.1), best: all.first().map(|s| s.0), second }
        };
        a.iter().map(nearest).collect()
    }

    /// Blocks that are not full, ties, and the extremes 0 and 255.
    #[test]
    fn every_path_is_exact() {
        for (na, nb, levels) in [(0, 5, 2), (1, 1, 2), (5, 0, 2), (131, 37, 2), (300, 210, 256), (129, 16, 2)] {
            let (mut a, mut b) = (random(na, 1, levels), random(nb, 2, levels));
            if na > 8 {
                (a[3], a[7], b[0], b[1]) = ([255; 128], [0; 128], [0; 128], [255; 128]);
                b[9] = b[4];
            }
            let forward = plainly(&a, &b);
            let backward: Vec<usize> = plainly(&b, &a).iter().map(|n| n.index).collect();
            assert_eq!(nearest(&a, &b), (forward.clone(), backward.clone()), "{na} {nb}");
            let paths: Vec<(&str, fn(&mut Search))> = vec![
                ("portable", |s| s.compare(portable)),
                #[cfg(target_arch = "x86_64")]
                ("avx2", |s| {
                    if is_x86_feature_detected!("avx2") {
                        // SAFETY: the processor has the feature.
                        unsafe { x86::with_avx2(s) }
                    } else {
                        s.compare(portable)
                    }
                }),
            ];
            for (name, path) in paths {
                let mut search = Search::new(&a, &b);
                path(&mut search);
                let best: Vec<_> = search.forward.iter().map(|n| (n.best, n.index as usize)).collect();
                let wanted: Vec<_> = forward.iter().map(|n| (n.best.unwrap_or(FAR), n.index)).collect();
                assert_eq!(best, wanted, "{name} {na} {nb}");
                let index = search.blocks.iter().flat_map(|b| b.index).map(|i| i as usize);
                assert!(index.take(nb).eq(backward.iter().copied()), "{name} {na} {nb}");
            }
        }
    }
}
