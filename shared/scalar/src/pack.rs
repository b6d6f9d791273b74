//! Packs: several numbers that are computed at once.
//!
//! Computations in which links do not depend on each other take one link in each lane. The device has
//! one lane. An x86-64 host has eight `f32` or four `f64` with AVX2, and half as many without. Every lane
//! does the same operations in the same order as a single number, so the bits are the same.

use crate::{Number, Vector3};

/// One number in each lane, of which each is an `S`; every operation is done lane by lane.
pub trait Gather<S: Number>: Number {
    /// Gathers the number of each lane.
    fn from_lanes(of: impl FnMut(usize) -> S) -> Self;
    /// The same number in each lane.
    #[inline(always)]
    fn splat(value: S) -> Self {
        Self::from_lanes(|_| value)
    }
    /// Gathers the vector of each lane.
    fn gather_vectors(of: impl FnMut(usize) -> Vector3<S>) -> Vector3<Self>;
}

/// Lanes that hold links of one chain, where `S` is the number of one catheter or of several abreast.
pub trait Pack<S: Number>: Gather<S> {
    fn lane(self, lane: usize) -> S;
    /// Splits into the vectors of the lanes.
    fn split_vectors(vectors: Vector3<Self>) -> Self::Lanes<Vector3<S>>;
    /// `yes` for the catheters that have a link, else `no`. Lanes are only filled with links that a single
    /// catheter has, so that without company it is `yes`.
    #[inline(always)]
    fn where_present(_present: S::Mask, yes: Self, _no: Self) -> Self {
        yes
    }
}

/// Lanes of plain numbers, which convert from and to integers.
pub trait PlainPack<T: Number>: Pack<T> {
    /// The number nearest to the integer of each lane.
    fn from_ints(of: impl FnMut(usize) -> i32) -> Self;
    /// Each number truncated towards zero and clamped to 0 … `most`; 0 for NaN.
    fn to_clamped_ints(self, most: i32) -> Self::Lanes<i32>;
    /// The numbers of all lanes.
    #[inline(always)]
    fn numbers(self) -> Self::Lanes<T> {
        Self::per_lane(|lane| self.lane(lane))
    }
}

/// A computation that is generic over the pack; see [`Real::run_vectorised`](crate::Real::run_vectorised).
pub trait Kernel<T: Number> {
    type Output;
    /// Runs the computation.
    ///
    /// It must be `#[inline(always)]`, as must all code in it that handles packs. A separate function would
    /// be compiled for the smallest instruction set of the target.
    fn run<N: PlainPack<T>>(self) -> Self::Output;
}

/// A pack of one lane.
macro_rules! alone {
    ($number:ty) => {
        impl Gather<$number> for $number {
            #[inline(always)]
            fn from_lanes(mut of: impl FnMut(usize) -> $number) -> Self {
                of(0)
            }
            #[inline(always)]
            fn gather_vectors(mut of: impl FnMut(usize) -> Vector3<$number>) -> Vector3<Self> {
                of(0)
            }
        }

        impl Pack<$number> for $number {
            #[inline(always)]
            fn lane(self, _lane: usize) -> $number {
                self
            }
            #[inline(always)]
            fn split_vectors(vectors: Vector3<Self>) -> [Vector3<$number>; 1] {
                [vectors]
            }
        }

        impl PlainPack<$number> for $number {
            #[inline(always)]
            fn from_ints(mut of: impl FnMut(usize) -> i32) -> Self {
                of(0) as $number
            }
            #[inline(always)]
            fn to_clamped_ints(self, most: i32) -> [i32; 1] {
                [(self as i32).max(0).min(most)]
            }
        }
    };
}
alone!(f32);
alone!(f64);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Real;

    const VALUES: [f64; 12] = [
        0.0,
        -0.0,
        1.0,
        -1.0e-3,
        0.1,
        3.3e7,
        -2.5e9,
        1.0e-40,
        7.0e-23,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];

    /// With one number, with as many as every processor of the target has lanes, and with as many
    /// as this one has.
    fn with_every_pack<W: Kernel<f32> + Kernel<f64> + Copy>(work: W) {
        Kernel::<f32>::run::<f32>(work);
        Kernel::<f64>::run::<f64>(work);
        #[cfg(target_arch = "x86_64")]
        {
            Kernel::<f32>::run::<crate::x86_64::F32x4>(work);
            Kernel::<f64>::run::<crate::x86_64::F64x2>(work);
        }
        f32::run_vectorised(work);
        f64::run_vectorised(work);
    }

    /// The same bits, or no number both.
    fn same<T: Real>(a: T, b: T) -> bool {
        let bits = |x: T| x.to_f64().to_bits();
        bits(a) == bits(b) || (a.to_f64().is_nan() && b.to_f64().is_nan())
    }

    /// Every operation; the bound of the last two is a number other than 0.
    fn all<N: Number>(a: N, b: N, bound: N) -> [N; 10] {
        let sum = [a + b, a - b, a * b, a / b, -a];
        let rest = [a.root(), a.positive(), a.sign(), a.larger(bound), a.smaller(bound)];
        [sum[0], sum[1], sum[2], sum[3], sum[4], rest[0], rest[1], rest[2], rest[3], rest[4]]
    }

    /// Every pack is held to the bits of one alone.
    #[derive(Clone, Copy)]
    struct HasTheBitsOfOneLane;

    impl<T: Real> Kernel<T> for HasTheBitsOfOneLane {
        type Output = ();
        fn run<N: PlainPack<T>>(self) {
            let n = VALUES.len();
            for k in 0..n * n {
                let a = |lane: usize| T::lit(VALUES[(k + lane) % n]);
                let b = |lane: usize| T::lit(VALUES[(k / n + 5 * lane) % n]);
                let bound = |lane: usize| T::lit([0.3, -7.1e5, 1.7e-20, 4.0][lane % 4]);
                let found = all(N::from_lanes(a), N::from_lanes(b), N::from_lanes(bound));
                for lane in 0..N::LANES {
                    let alone = all(a(lane), b(lane), bound(lane));
                    for (found, alone) in found.iter().zip(alone) {
                        let found = found.lane(lane);
                        assert!(same(found, alone), "{} {}: {found} {alone}", a(lane), b(lane));
                    }
                }
            }
        }
    }

    #[derive(Clone, Copy)]
    struct Chooses;

    impl<T: Real> Kernel<T> for Chooses {
        type Output = ();
        fn run<N: PlainPack<T>>(self) {
            let n = VALUES.len();
            for k in 0..n * n {
                let a = |lane: usize| T::lit(VALUES[(k + lane) % n]);
                let b = |lane: usize| T::lit(VALUES[(k / n + 5 * lane) % n]);
                let (many_a, many_b) = (N::from_lanes(a), N::from_lanes(b));
                let (yes, no) = (N::lit(1.0), N::lit(2.0));
                let masks = [many_a.below(many_b), many_a.reaches(many_b)];
                let is = |lane: usize| [a(lane) < b(lane), a(lane) >= b(lane)];
                for (i, mask) in masks.into_iter().enumerate() {
                    let found = N::choose(mask, yes, no);
                    for lane in 0..N::LANES {
                        let expected = if is(lane)[i] { T::lit(1.0) } else { T::lit(2.0) };
                        assert_eq!(found.lane(lane), expected, "{} {}", a(lane), b(lane));
                    }
                    assert_eq!(N::all(mask), (0..N::LANES).all(|lane| is(lane)[i]));
                    assert_eq!(N::any(mask), (0..N::LANES).any(|lane| is(lane)[i]));
                }
            }
        }
    }

    #[test]
    fn each_lane_chooses_for_itself() {
        with_every_pack(Chooses);
    }

    #[test]
    fn side_by_side_has_the_bits_of_one_alone() {
        with_every_pack(HasTheBitsOfOneLane);
    }

    #[derive(Clone, Copy)]
    struct CutsOff;

    impl<T: Real> Kernel<T> for CutsOff {
        type Output = ();
        fn run<N: PlainPack<T>>(self) {
            for most in [0, 7, 1 << 27] {
                for k in 0..VALUES.len() {
                    let value = |lane: usize| T::lit(VALUES[(k + lane) % VALUES.len()] * 1.7);
                    let found = N::from_lanes(value).to_clamped_ints(most);
                    for lane in 0..N::LANES {
                        let alone = value(lane).truncated().max(0).min(most);
                        assert_eq!(found[lane], alone, "{}", value(lane));
                    }
                }
            }
            let int = |lane: usize| [i32::MIN, 16_777_217, -3, i32::MAX, 5, 0, 1 << 24, -1][lane];
            for lane in 0..N::LANES {
                assert_eq!(N::from_ints(int).lane(lane), T::int(int(lane)));
            }
        }
    }

    #[test]
    fn integers_are_cut_off_and_clipped_alike() {
        with_every_pack(CutsOff);
    }

    #[derive(Clone, Copy)]
    struct ComesApart;

    impl<T: Real> Kernel<T> for ComesApart {
        type Output = ();
        fn run<N: PlainPack<T>>(self) {
            let vector = |lane: usize| {
                Vector3::new(T::lit(1.0), T::lit(2.0), T::lit(3.0)) * T::int(lane as i32 + 1)
            };
            let run_vectorised = N::gather_vectors(vector);
            let apart = N::split_vectors(run_vectorised);
            for lane in 0..N::LANES {
                assert_eq!(apart[lane], vector(lane));
                let (x, y, z) = (run_vectorised.x(), run_vectorised.y(), run_vectorised.z());
                let together = Vector3::new(x.lane(lane), y.lane(lane), z.lane(lane));
                assert_eq!(together, vector(lane));
                assert_eq!(N::splat(T::lit(0.7)).lane(lane), T::lit(0.7));
            }
        }
    }

    #[test]
    fn vectors_come_apart_as_they_were() {
        with_every_pack(ComesApart);
    }
}
