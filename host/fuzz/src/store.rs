//! The store of images in flash.

use std::convert::Infallible;

use cathforce_storage::{Layout, State, Store};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

const BLOCK: usize = 256;
/// Each of the two slots, in bytes.
const SLOT: usize = 4 * BLOCK;

/// A flash whose content is anything. Writing clears bits and erasing sets them; nothing fails.
struct Flash(Vec<u8>);

impl ErrorType for Flash {
    type Error = Infallible;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.0[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = BLOCK;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        self.0[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        let places = self.0[offset as usize..][..bytes.len()].iter_mut();
        places.zip(bytes).for_each(|(place, byte)| *place &= byte);
        Ok(())
    }
}

/// Whatever the flash holds, it is looked at without a panic; and an image that is saved after that is the
/// one that is found, also when the power went off in between.
pub fn store(data: &[u8]) {
    let (flash, image) = data.split_at(data.len().min(2 * SLOT));
    let mut content = flash.to_vec();
    content.resize(2 * SLOT, 0xFF);
    let half = SLOT as u32;
    let open = |flash| {
        let slots = [0..half, half..2 * half];
        Store::new(flash, Layout { slots }).expect("whole blocks, apart")
    };
    let mut buffer = vec![0; SLOT];
    let mut store = open(Flash(content));
    let Ok(found) = store.load(&mut buffer, |_| true);
    assert!(found.len <= buffer.len());
    if store.save(image).is_err() {
        return;
    }
    let mut store = open(store.into_flash());
    let Ok(found) = store.load(&mut buffer, |_| true);
    assert_eq!(&buffer[..found.len], image, "{found:?}");
    assert!(matches!(found.state, State::Good | State::Fallback) && found.on_trial, "{found:?}");
    let Ok(()) = store.confirm();
    let Ok(found) = open(store.into_flash()).load(&mut buffer, |_| true);
    assert!(!found.on_trial && &buffer[..found.len] == image, "{found:?}");
}
