//! The number of one catheter, or of several catheters abreast.

use crate::{Number, Pack, Vector3};

/// A number of the equations of motion: one catheter's, or those of several catheters abreast
/// ([`Abreast`](crate::Abreast)).
///
/// Where the equations of catheters differ, because one has fewer links than another, a mask says which of
/// them an answer is for. For one catheter the compiler removes the masks.
pub trait Catheters: Number + Pack<Self> {
    /// There are several.
    const ABREAST: bool;
    /// How many links each has.
    type Count: Copy;
    /// A link of each.
    type Index: Copy + Blend<Self>;
    fn index(link: usize) -> Self::Index;
    /// The catheters with more than `link` links, among them always the one with the most.
    fn present(count: Self::Count, link: usize) -> Self::Mask;
    /// The catheters with more than `link` links.
    fn has(count: Self::Count, link: usize) -> Self::Mask;
    fn not(mask: Self::Mask) -> Self::Mask;
    /// What `yes` returns for the catheters of a mask, and for the others what `no` returns. For one catheter
    /// only one of them is called.
    fn either<X: Blend<Self>>(
        mask: Self::Mask,
        yes: impl FnOnce() -> X,
        no: impl FnOnce() -> X,
    ) -> X;
}

/// Something that is made of the numbers of catheters.
pub trait Blend<S: Number>: Sized {
    /// `yes` for the catheters of a mask, `no` for the others.
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self;
}

impl<S: Number> Blend<S> for S {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: S, no: S) -> S {
        S::choose(mask, yes, no)
    }
}

impl<S: Number> Blend<S> for Vector3<S> {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        Self::new(
            S::choose(mask, yes.x(), no.x()),
            S::choose(mask, yes.y(), no.y()),
            S::choose(mask, yes.z(), no.z()),
        )
    }
}

impl<S: Number, A: Blend<S>, B: Blend<S>> Blend<S> for (A, B) {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        (A::blend(mask, yes.0, no.0), B::blend(mask, yes.1, no.1))
    }
}

impl<S: Number, A: Blend<S>, B: Blend<S>, C: Blend<S>> Blend<S> for (A, B, C) {
    #[inline(always)]
    fn blend(mask: S::Mask, yes: Self, no: Self) -> Self {
        (A::blend(mask, yes.0, no.0), B::blend(mask, yes.1, no.1), C::blend(mask, yes.2, no.2))
    }
}

macro_rules! one {
    ($number:ty) => {
        impl Catheters for $number {
            const ABREAST: bool = false;
            type Count = usize;
            type Index = u16;
            #[inline(always)]
            fn index(link: usize) -> u16 {
                link as u16
            }
            #[inline(always)]
            fn present(_count: usize, _link: usize) -> bool {
                true
            }
            #[inline(always)]
            fn has(count: usize, link: usize) -> bool {
                link < count
            }
            #[inline(always)]
            fn not(mask: bool) -> bool {
                !mask
            }
            #[inline(always)]
            fn either<X: Blend<Self>>(
                mask: bool,
                yes: impl FnOnce() -> X,
                no: impl FnOnce() -> X,
            ) -> X {
                if mask { yes() } else { no() }
            }
        }

        impl Blend<$number> for u16 {
            #[inline(always)]
            fn blend(mask: bool, yes: u16, no: u16) -> u16 {
                if mask { yes } else { no }
            }
        }
    };
}
one!(f32);
one!(f64);
