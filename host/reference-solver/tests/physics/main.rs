//! The reference solver against closed forms and published solutions.

mod beyond;
mod contact;
mod dynamics;
mod moving;
mod statics;
mod support;
