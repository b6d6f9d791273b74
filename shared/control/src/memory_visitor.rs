//! Access to every number of the controller's state, for tests that corrupt it.

/// One number of [`crate::State`].
#[derive(Debug)]
pub enum MemoryWord<'a> {
    F32(&'a mut f32),
    U32(&'a mut u32),
    U16(&'a mut u16),
    U8(&'a mut u8),
}

impl MemoryWord<'_> {
    /// Overwrites the word with these bits; narrower words take the low bits.
    pub fn set_bits(self, bits: u32) {
        match self {
            Self::F32(word) => *word = f32::from_bits(bits),
            Self::U32(word) => *word = bits,
            Self::U16(word) => *word = bits as u16,
            Self::U8(word) => *word = bits as u8,
        }
    }
}

/// State whose words can be visited one by one.
pub(crate) trait VisitMemory {
    fn visit_memory(&mut self, visit: &mut dyn FnMut(MemoryWord<'_>));
}
