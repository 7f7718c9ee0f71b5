//! Plain code that the compiler vectorises, compiled for several processors: the widest vectors that the
//! one at hand has are used.
//!
//! No compilation fuses multiplication and addition or reorders a sum: all give the same bits. Sums are
//! therefore written in lanes (see [`sum`]), as many as the widest vectors have.

#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Vectors {
    Baseline,
    Avx2,
    Avx512,
}

/// What the processor can run; the features are looked up once.
#[cfg(target_arch = "x86_64")]
pub fn widest() -> Vectors {
    let avx512 = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    let widest = match (avx512, is_x86_feature_detected!("avx2")) {
        (true, _) => Vectors::Avx512,
        (false, true) => Vectors::Avx2,
        (false, false) => Vectors::Baseline,
    };
    #[cfg(test)]
    let widest = widest.min(tests::LIMIT.get());
    widest
}

/// Defines functions that choose among the compilations of their body: for AVX-512, for AVX2, and for
/// what the target has (on other architectures the only one). Their module allows unsafe code.
macro_rules! for_each_processor {
    ($(
        $(#[$attribute:meta])*
        $visible:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block
    )*) => { $(
        $(#[$attribute])*
        #[allow(clippy::too_many_arguments)]
        $visible fn $name($($arg: $type),*) $(-> $result)? {
            #[inline(always)]
            #[allow(clippy::too_many_arguments)]
            fn body($($arg: $type),*) $(-> $result)? $body
            #[cfg(target_arch = "x86_64")]
            {
                use $crate::vectors::{Vectors, widest};
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
                #[allow(clippy::too_many_arguments)]
                fn avx512($($arg: $type),*) $(-> $result)? {
                    body($($arg),*)
                }
                #[target_feature(enable = "avx2")]
                #[allow(clippy::too_many_arguments)]
                fn avx2($($arg: $type),*) $(-> $result)? {
                    body($($arg),*)
                }
                match widest() {
                    // SAFETY: the processor has the features.
                    Vectors::Avx512 => return unsafe { avx512($($arg),*) },
                    // SAFETY: the processor has the feature.
                    Vectors::Avx2 => return unsafe { avx2($($arg),*) },
                    Vectors::Baseline => {}
                }
            }
            body($($arg),*)
        }
    )* };
}
pub(crate) use for_each_processor;

/// The greater number, `b` where one is NaN: a single instruction, unlike `f32::max`.
#[inline(always)]
pub fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser number, `b` where one is NaN.
#[inline(always)]
pub fn less(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
pub mod tests {
    #[cfg(target_arch = "x86_64")]
    use super::Vectors;

    #[cfg(target_arch = "x86_64")]
    thread_local! {
        /// The widest vectors that a test wants.
        pub static LIMIT: std::cell::Cell<Vectors> = const { std::cell::Cell::new(Vectors::Avx512) };
    }

    /// The results of all compilations that the processor can run, the portable one last.
    pub fn of_each_processor<T>(mut run: impl FnMut() -> T) -> Vec<T> {
        #[cfg(target_arch = "x86_64")]
        {
            let limits = [Vectors::Avx512, Vectors::Avx2, Vectors::Baseline];
            let results = limits.map(|limit| {
                LIMIT.set(limit);
                run()
            });
            LIMIT.set(Vectors::Avx512);
            results.into()
        }
        #[cfg(not(target_arch = "x86_64"))]
        vec![run()]
    }
}
