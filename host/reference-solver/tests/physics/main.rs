//! The reference solver against closed forms and published solutions.

mod beyond;
mod contact;
mod moving;
mod statics;
mod support;
