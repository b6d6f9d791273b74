//! A hash that changes with the layout of a type.
//!
//! postcard writes values without names, so the bytes of one version of a type may be read as another
//! version without an error. [`hash`] traces what a type's own `Deserialize` reads, in order: names of
//! structs and fields, widths of numbers, lengths of arrays. Nobody has to maintain a version number.

use core::fmt;

use serde::de::{self, DeserializeOwned, DeserializeSeed, Visitor};

/// FNV-1a over the names and types that `T` reads.
///
/// Covers structs, tuples, arrays, sequences, options and plain values. An enum or a map inside `T` gives
/// `None`, because only a part of it could be traced; an image contains neither.
pub(crate) fn hash<T: DeserializeOwned>() -> Option<u32> {
    let mut fnv = Fnv(0x811C_9DC5);
    T::deserialize(Tracer(&mut fnv)).ok()?;
    Some(fnv.0)
}

struct Fnv(u32);

impl Fnv {
    fn add(&mut self, text: &str) {
        // The terminating zero distinguishes "ab", "c" from "a", "bc".
        for byte in text.bytes().chain([0]) {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }

    fn add_len(&mut self, len: usize) {
        for byte in (len as u32).to_le_bytes() {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }
}

/// Returns a zero of every requested type, and hashes the request.
struct Tracer<'h>(&'h mut Fnv);

/// The type cannot be traced completely.
#[derive(Debug)]
struct Unseen;

impl fmt::Display for Unseen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a type whose layout cannot be traced")
    }
}

impl de::StdError for Unseen {}

impl de::Error for Unseen {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self
    }
}

macro_rules! plain {
    ($( $method:ident: $visit:ident($zero:expr) = $name:literal; )+) => { $(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unseen> {
            self.0.add($name);
            visitor.$visit($zero)
        }
    )+ };
}

macro_rules! refuse {
    ($( $method:ident($($arg:ty),*); )+) => { $(
        fn $method<V: Visitor<'de>>(self, $(_: $arg,)* _: V) -> Result<V::Value, Unseen> {
            Err(Unseen)
        }
    )+ };
}

impl<'de> de::Deserializer<'de> for Tracer<'_> {
    type Error = Unseen;

    plain! {
        deserialize_bool: visit_bool(false) = "bool";
        deserialize_i8: visit_i8(0) = "i8";
        deserialize_i16: visit_i16(0) = "i16";
        deserialize_i32: visit_i32(0) = "i32";
        deserialize_i64: visit_i64(0) = "i64";
        deserialize_u8: visit_u8(0) = "u8";
        deserialize_u16: visit_u16(0) = "u16";
        deserialize_u32: visit_u32(0) = "u32";
        deserialize_u64: visit_u64(0) = "u64";
        deserialize_f32: visit_f32(0.0) = "f32";
        deserialize_f64: visit_f64(0.0) = "f64";
        deserialize_char: visit_char('0') = "char";
        deserialize_str: visit_str("") = "str";
        deserialize_string: visit_str("") = "str";
        deserialize_bytes: visit_bytes(&[]) = "bytes";
        deserialize_byte_buf: visit_bytes(&[]) = "bytes";
    }

    refuse! {
        deserialize_any();
        deserialize_ignored_any();
        deserialize_identifier();
        deserialize_map();
        deserialize_enum(&'static str, &'static [&'static str]);
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unseen> {
        self.0.add("unit");
        visitor.visit_unit()
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unseen> {
        self.0.add("option");
        visitor.visit_some(self)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Unseen> {
        self.0.add(name);
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Unseen> {
        self.0.add(name);
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unseen> {
        self.0.add("seq");
        visitor.visit_seq(Elements { tracer: self, names: &[], left: 1 })
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Unseen> {
        self.0.add("tuple");
        self.0.add_len(len);
        visitor.visit_seq(Elements { tracer: self, names: &[], left: len })
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Unseen> {
        self.0.add(name);
        self.deserialize_tuple(len, visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unseen> {
        self.0.add(name);
        self.0.add_len(fields.len());
        visitor.visit_seq(Elements { tracer: self, names: fields, left: fields.len() })
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// Elements of a struct, array or sequence, in order.
struct Elements<'h> {
    tracer: Tracer<'h>,
    names: &'static [&'static str],
    left: usize,
}

impl<'de> de::SeqAccess<'de> for Elements<'_> {
    type Error = Unseen;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Unseen> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        if let Some((name, rest)) = self.names.split_first() {
            self.tracer.0.add(name);
            self.names = rest;
        }
        seed.deserialize(Tracer(self.tracer.0)).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    /// Every way to change a struct that its bytes alone would not show.
    #[test]
    fn changes_when_a_field_is_added_reordered_renamed_or_retyped() {
        macro_rules! hash_of {
            ($($field:ident: $kind:ty),*) => {{
                #[derive(Deserialize)]
                #[allow(dead_code)]
                struct Part { $($field: $kind),* }
                #[derive(Deserialize)]
                #[allow(dead_code)]
                struct Whole { parts: heapless::Vec<Part, 3>, end: u8 }
                hash::<Whole>().expect("a layout that can be traced")
            }};
        }
        let original = hash_of!(length_m: f32, count: u16);
        assert_eq!(original, hash_of!(length_m: f32, count: u16));
        for changed in [
            hash_of!(length_m: f32, count: u16, extra: bool),
            hash_of!(length_m: f32),
            hash_of!(count: u16, length_m: f32),
            hash_of!(length_mm: f32, count: u16),
            hash_of!(length_m: f64, count: u16),
            hash_of!(length_m: f32, count: u32),
            hash_of!(length_m: [f32; 1], count: u16),
            hash_of!(length_m: [f32; 2], count: u16),
            hash_of!(length_m: Option<f32>, count: u16),
            hash_of!(length_m: (f32, u16), count: u16),
        ] {
            assert_ne!(changed, original);
        }
    }

    #[test]
    fn says_so_when_a_type_cannot_be_seen_whole() {
        #[derive(Deserialize)]
        #[allow(dead_code)]
        enum Either {
            A(u8),
            B(f32),
        }
        #[derive(Deserialize)]
        #[allow(dead_code)]
        struct Whole {
            either: Either,
        }
        assert_eq!(hash::<Whole>(), None);
    }
}
