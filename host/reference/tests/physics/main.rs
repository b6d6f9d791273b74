//! The reference solver against closed forms and published solutions.

mod contact;
mod statics;
mod moving;
mod support;
