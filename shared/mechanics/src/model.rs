//! Tables made once from a [`Description`].

use crate::{Description, DescriptionError, Real};

/// The model's configuration: a validated description and its tables.
#[derive(Clone, Debug)]
pub struct Model<T> {
    description: Description<T>,
}

impl<T: Real> Model<T> {
    /// Validates the description and makes the tables.
    pub fn new(description: Description<T>) -> Result<Self, DescriptionError> {
        description.validate()?;
        Ok(Self { description })
    }

    /// What the model was made from.
    pub fn description(&self) -> &Description<T> {
        &self.description
    }
}
