//! Recordings for other tools: CSV, Parquet, trial bundles.

pub(crate) mod bundle;
pub(crate) mod columns;
#[cfg(feature = "parquet")]
pub(crate) mod parquet_file;
pub(crate) mod series;
pub(crate) mod synthetic;
