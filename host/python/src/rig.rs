//! The configuration of a tick, with the image that it reads in.

use std::sync::Arc;

use cathforce_config::{ImageError, image};
use cathforce_control::Config;
use cathforce_mechanics::{Description, DescriptionError, Lumen, MAX_LINKS, Model};

self_cell::self_cell!(
    /// A device image and the configuration that reads its lumen in place.
    struct SingleCell {
        owner: Arc<[u8]>,
        #[covariant]
        dependent: Config,
    }
);

/// The model in double precision, in the lumen of an image.
pub struct DoubleConfig<'a> {
    pub model: Model<f64, MAX_LINKS>,
    pub lumen: Lumen<'a>,
}

self_cell::self_cell!(
    struct DoubleCell {
        owner: Arc<[u8]>,
        #[covariant]
        dependent: DoubleConfig,
    }
);

/// What a device computes with.
pub struct Single(SingleCell);

/// What a study in double precision computes with.
pub struct Double(DoubleCell);

impl Single {
    pub fn new(image: Arc<[u8]>) -> Result<Self, String> {
        SingleCell::try_new(image, |image| image::decode(image))
            .map(Self)
            .map_err(|error| format!("the device image is refused: {error}"))
    }

    /// The same rig and settings with another description.
    pub fn with_description(&self, description: Description<f32>) -> Result<Self, String> {
        let model = Model::new(description).map_err(refused)?;
        let settings = self.config().settings;
        let band = self.config().band;
        // The image was decoded once already, so that this cannot fail.
        SingleCell::try_new(self.0.borrow_owner().clone(), |image| {
            let whole = image::decode(image).map_err(|error| error.to_string())?;
            Ok(Config { model, settings, band, ..whole })
        })
        .map(Self)
    }

    pub fn config(&self) -> &Config<'_> {
        self.0.borrow_dependent()
    }
}

impl Double {
    /// `image`: the lumen's.
    pub fn new(image: Arc<[u8]>, description: Description<f64>) -> Result<Self, String> {
        let model = Model::new(description).map_err(refused)?;
        DoubleCell::try_new(image, |image| {
            let config = image::decode(image).map_err(|error| error.to_string())?;
            Ok(DoubleConfig { model, lumen: config.lumen })
        })
        .map(Self)
    }

    /// The same lumen with another description.
    pub fn with_description(&self, description: Description<f64>) -> Result<Self, String> {
        Self::new(self.0.borrow_owner().clone(), description)
    }

    pub fn config(&self) -> &DoubleConfig<'_> {
        self.0.borrow_dependent()
    }
}

fn refused(error: DescriptionError) -> String {
    ImageError::Description(error).to_string()
}
