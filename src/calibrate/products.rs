//! Sums of products of columns whose numbers lie in lanes: the normal equations of points, a block at a time.
//!
//! Intrinsics, since the compiler does not keep a tile of sums in registers; all processors add in the same
//! order and give the same bits.
#![allow(unsafe_code)]

use super::block::{Block, LANES, Lanes};
use super::freedom::Unknown;

/// Lanes whose products are summed apart until the end: those of the widest vectors.
const PARTS: usize = 8;
type Sum = [f64; PARTS];
/// Columns that are multiplied by others at a time.
const DOWN: usize = 2;

/// J^T J of rows that are given a block at a time.
pub(crate) struct Products {
    /// The columns of both coordinates' rows, filled up with zeros to a multiple of [`DOWN`].
    columns: [Vec<Lanes>; 2],
    /// Row by row; the upper triangle counts.
    sums: Vec<Sum>,
}

impl Products {
    pub fn new(width: usize) -> Self {
        let padded = width.next_multiple_of(DOWN);
        let columns = vec![[0.0; LANES]; padded];
        Self { columns: [columns.clone(), columns], sums: vec![[0.0; PARTS]; padded * padded] }
    }

    pub fn clear(&mut self) {
        self.sums.fill([0.0; PARTS]);
    }

    /// A column of the next rows.
    pub fn column(&mut self, k: usize) -> [&mut Lanes; 2] {
        self.columns.each_mut().map(|row| &mut row[k])
    }

    /// Takes the columns of unknowns from a block, from column `first` on.
    pub fn take(&mut self, block: &Block, unknowns: &[Unknown], first: usize) {
        for (row, from) in self.columns.iter_mut().zip(&block.rows) {
            for (to, unknown) in row[first..].iter_mut().zip(unknowns) {
                *to = from[unknown.parameter];
                if let Some(tied) = unknown.tied {
                    to.iter_mut().zip(&from[tied]).for_each(|(a, b)| *a += b);
                }
            }
        }
    }

    /// Adds the rows' products.
    pub fn add(&mut self) {
        let [x, y] = &self.columns;
        #[cfg(target_arch = "x86_64")]
        {
            use crate::vectors::{Vectors, widest};
            match widest() {
                // SAFETY: the processor has the feature.
                Vectors::Avx512 => return unsafe { avx512::add(&mut self.sums, [x, y]) },
                // SAFETY: the processor has the feature.
                Vectors::Avx2 => return unsafe { avx2::add(&mut self.sums, [x, y]) },
                Vectors::Baseline => {}
            }
        }
        portable(&mut self.sums, [x, y]);
    }

    /// Entry a <= b.
    pub fn at(&self, a: usize, b: usize) -> f64 {
        self.sums[a * self.columns[0].len() + b].iter().sum()
    }
}

fn portable(sums: &mut [Sum], rows: [&[Lanes]; 2]) {
    let width = rows[0].len();
    for a in 0..width {
        for b in a - a % DOWN..width {
            let mut added = [0.0; PARTS];
            for row in rows {
                for (left, right) in row[a].chunks_exact(PARTS).zip(row[b].chunks_exact(PARTS)) {
                    for ((sum, x), y) in added.iter_mut().zip(left).zip(right) {
                        *sum += x * y;
                    }
                }
            }
            sums[a * width + b].iter_mut().zip(&added).for_each(|(sum, x)| *sum += x);
        }
    }
}

/// The same for vectors of `$lanes` numbers.
#[cfg(target_arch = "x86_64")]
macro_rules! vectors {
    ($module:ident, $feature:literal, $lanes:literal, $vector:ident, $zero:ident, $multiply:ident, $add:ident) => {
        mod $module {
            use std::arch::x86_64::{$add, $multiply, $vector, $zero};
            use std::mem::transmute;

            use super::{DOWN, LANES, Lanes, PARTS, Sum};

            /// Columns that they are multiplied by.
            const ACROSS: usize = 4;

            #[target_feature(enable = $feature)]
            pub fn add(sums: &mut [Sum], rows: [&[Lanes]; 2]) {
                let width = rows[0].len();
                for a in (0..width).step_by(DOWN) {
                    for b in (a..width).step_by(ACROSS) {
                        if width - b < ACROSS {
                            tile::<DOWN>(sums, rows, a, b);
                        } else {
                            tile::<ACROSS>(sums, rows, a, b);
                        }
                    }
                }
            }

            #[inline]
            #[target_feature(enable = $feature)]
            fn tile<const WIDE: usize>(sums: &mut [Sum], rows: [&[Lanes]; 2], a: usize, b: usize) {
                let width = rows[0].len();
                // Vectors that a sum is made of.
                const VECTORS: usize = PARTS / $lanes;
                for part in 0..VECTORS {
                    let mut added = [[$zero(); WIDE]; DOWN];
                    for row in rows {
                        let (left, right) = (&row[a..a + DOWN], &row[b..b + WIDE]);
                        for l in 0..LANES / PARTS {
                            let load = |column: &Lanes| vector(&column.as_chunks().0[l * VECTORS + part]);
                            let x: [_; DOWN] = [load(&left[0]), load(&left[1])];
                            for k in 0..WIDE {
                                let y = load(&right[k]);
                                for i in 0..DOWN {
                                    added[i][k] = $add(added[i][k], $multiply(x[i], y));
                                }
                            }
                        }
                    }
                    for (i, added) in added.iter().enumerate() {
                        for (sum, added) in sums[(a + i) * width + b..][..WIDE].iter_mut().zip(added) {
                            let sum = &mut sum.as_chunks_mut().0[part];
                            // SAFETY: as in `vector`.
                            *sum = unsafe { transmute::<$vector, [f64; $lanes]>($add(vector(sum), *added)) };
                        }
                    }
                }
            }

            /// A load; the intrinsic for it checks its pointer at length where debug assertions are on, as in the
            /// tests that count instructions.
            #[inline]
            #[target_feature(enable = $feature)]
            fn vector(numbers: &[f64; $lanes]) -> $vector {
                // SAFETY: both are so many numbers in order, whatever their values.
                unsafe { transmute::<[f64; $lanes], $vector>(*numbers) }
            }
        }
    };
}
#[cfg(target_arch = "x86_64")]
vectors!(avx512, "avx512f", 8, __m512d, _mm512_setzero_pd, _mm512_mul_pd, _mm512_add_pd);
#[cfg(target_arch = "x86_64")]
vectors!(avx2, "avx2", 4, __m256d, _mm256_setzero_pd, _mm256_mul_pd, _mm256_add_pd);
