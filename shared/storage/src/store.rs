//! Saving and finding images.

use core::ops::Range;

use embedded_storage::nor_flash::NorFlash;

use crate::CRC32;
use crate::header::{HEADER, Header, IMAGE_OFFSET, TRIALS};

/// Bytes that are written or read at a time. A multiple of the word of every flash in use.
const CHUNK: usize = 256;
/// The largest word for which there is room beside the header.
const LARGEST_WORD: usize = 32;
const ERASED: u8 = 0xFF;
/// A mark: any word that is not erased is one, torn or not.
const MARK: [u8; LARGEST_WORD] = [0; LARGEST_WORD];

/// Where in a flash the two slots lie, in whole erase blocks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    pub slots: [Range<u32>; 2],
}

/// The images that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// No image has ever been saved.
    Empty,
    /// The newest image is good.
    Good,
    /// A slot is damaged, was cut short while it was written, or holds an image that has failed its
    /// trials; the image of the other one is used.
    Fallback,
    /// Something has been written, and no image is good.
    Lost,
}

/// What a boot finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    pub state: State,
    /// Length of the image in the buffer \[bytes\]; 0 without one.
    pub len: usize,
    /// The image is on trial, and [`Store::confirm`] has to be called once the device has run with it.
    pub on_trial: bool,
}

/// Why an image was not saved. The one before is there still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError<E> {
    /// Longer than a slot has room for.
    TooLong { capacity: u32 },
    /// The flash reads other bytes than were written.
    ReadBack,
    /// The flash failed.
    Flash(E),
}

impl<E> From<E> for SaveError<E> {
    fn from(error: E) -> Self {
        Self::Flash(error)
    }
}

/// A slot, as far as it has been looked at.
#[derive(Clone, Copy)]
struct Slot {
    number: usize,
    /// Everything that a header takes is erased.
    is_erased: bool,
    header: Option<Header>,
    /// Trials that are used up.
    used: usize,
    is_confirmed: bool,
}

impl Slot {
    fn has_failed(&self) -> bool {
        !self.is_confirmed && self.used >= TRIALS
    }
}

/// Images in a flash.
pub struct Store<F: NorFlash> {
    flash: F,
    slots: [Range<u32>; 2],
    /// Slot of the image that was loaded or saved last.
    taken: Option<usize>,
}

impl<F: NorFlash> Store<F> {
    /// `None`: the slots do not consist of whole erase blocks, overlap, leave the flash or have no room
    /// for an image, or the flash has words that do not fit.
    pub fn new(flash: F, layout: Layout) -> Option<Self> {
        let slots = layout.slots;
        let capacity = u32::try_from(flash.capacity()).unwrap_or(u32::MAX);
        let block = u32::try_from(F::ERASE_SIZE).ok()?;
        let [a, b] = &slots;
        let fits = |slot: &Range<u32>| {
            slot.start.is_multiple_of(block)
                && slot.end.is_multiple_of(block)
                && slot.end <= capacity
                && slot.end > slot.start + IMAGE_OFFSET
        };
        let apart = a.end <= b.start || b.end <= a.start;
        let words = F::WRITE_SIZE <= LARGEST_WORD && LARGEST_WORD.is_multiple_of(F::WRITE_SIZE);
        (fits(a) && fits(b) && apart && words).then_some(Self { flash, slots, taken: None })
    }

    /// Reads the image to boot with into `into`: the newest good one that `accept` takes. On trial, it uses up
    /// one trial first.
    ///
    /// `accept`: whether this program can read an image, such as one of an earlier version. It must look at
    /// the image only as far as nothing can go wrong, because a trial counts what follows.
    pub fn load(
        &mut self,
        into: &mut [u8],
        mut accept: impl FnMut(&[u8]) -> bool,
    ) -> Result<Found, F::Error> {
        self.taken = None;
        let slots = self.look()?;
        let nothing = |state| Found { state, len: 0, on_trial: false };
        if slots.iter().all(|slot| slot.is_erased) {
            return Ok(nothing(State::Empty));
        }
        let damaged = slots.iter().any(|slot| slot.header.is_none() && !slot.is_erased);
        let mut state = if damaged { State::Fallback } else { State::Good };
        for (slot, header) in newest_first(slots) {
            let len = header.len as usize;
            if !slot.has_failed()
                && self.read(slot.number, header, into)?
                && into.get(..len).is_some_and(&mut accept)
            {
                if !slot.is_confirmed {
                    self.mark(slot.number, slot.used)?;
                }
                self.taken = Some(slot.number);
                return Ok(Found { state, len, on_trial: !slot.is_confirmed });
            }
            state = State::Fallback;
        }
        Ok(nothing(State::Lost))
    }

    /// The device has run with the image that was loaded or saved last.
    pub fn confirm(&mut self) -> Result<(), F::Error> {
        let Some(number) = self.taken else { return Ok(()) };
        if self.look_at(number)?.is_confirmed { Ok(()) } else { self.mark(number, TRIALS) }
    }

    /// Saves an image beside the newest good one. On an error, and after a power cut at any time, that one
    /// is there still.
    pub fn save(&mut self, image: &[u8]) -> Result<(), SaveError<F::Error>> {
        let slots = self.look()?;
        let number = self.kept(slots)?.map_or(0, |kept| 1 - kept);
        let range = self.range(number);
        let capacity = range.end - range.start - IMAGE_OFFSET;
        let len = u32::try_from(image.len()).ok().filter(|&len| len <= capacity);
        let len = len.ok_or(SaveError::TooLong { capacity })?;
        let newest = newest_first(slots).next().map(|(_, header)| header.generation);
        // The block with the header goes first.
        let erased = (IMAGE_OFFSET + len).next_multiple_of(F::ERASE_SIZE as u32);
        self.flash.erase(range.start, range.start + erased)?;
        let header = Header {
            generation: newest.map_or(0, |newest| newest.wrapping_add(1)),
            len,
            crc32: self.write(range.start + IMAGE_OFFSET, image)?,
        };
        if !self.matches(number, header)? {
            return Err(SaveError::ReadBack);
        }
        self.write(range.start, &header.bytes())?;
        self.taken = Some(number);
        Ok(())
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The slot that a save must not touch: that of the image that was loaded or saved last, or else of the
    /// newest good one.
    fn kept(&mut self, slots: [Slot; 2]) -> Result<Option<usize>, F::Error> {
        if let Some(number) = self.taken {
            let header = slots.iter().find(|slot| slot.number == number).and_then(|s| s.header);
            if let Some(header) = header
                && self.matches(number, header)?
            {
                return Ok(Some(number));
            }
        }
        for failed in [false, true] {
            for (slot, header) in newest_first(slots) {
                if slot.has_failed() == failed && self.matches(slot.number, header)? {
                    return Ok(Some(slot.number));
                }
            }
        }
        Ok(None)
    }

    fn range(&self, number: usize) -> Range<u32> {
        let [a, b] = &self.slots;
        if number == 0 { a.clone() } else { b.clone() }
    }

    fn look(&mut self) -> Result<[Slot; 2], F::Error> {
        Ok([self.look_at(0)?, self.look_at(1)?])
    }

    /// Reads the header and the marks of a slot.
    fn look_at(&mut self, number: usize) -> Result<Slot, F::Error> {
        let start = self.range(number).start;
        let mut bytes = [0; HEADER];
        self.flash.read(start, &mut bytes)?;
        let mut marks = [false; TRIALS + 1];
        for (i, mark) in marks.iter_mut().enumerate() {
            let mut word = [0; LARGEST_WORD];
            self.flash.read(mark_at(start, i), &mut word)?;
            *mark = word != [ERASED; LARGEST_WORD];
        }
        let [trials @ .., is_confirmed] = marks;
        Ok(Slot {
            number,
            is_erased: bytes == [ERASED; HEADER],
            header: Header::read(&bytes),
            used: trials.iter().take_while(|used| **used).count(),
            is_confirmed,
        })
    }

    fn mark(&mut self, number: usize, which: usize) -> Result<(), F::Error> {
        let at = mark_at(self.range(number).start, which);
        self.flash.write(at, MARK.get(..F::WRITE_SIZE).unwrap_or(&MARK))
    }

    /// Writes bytes; the last word is filled up. Returns their CRC.
    fn write(&mut self, start: u32, bytes: &[u8]) -> Result<u32, F::Error> {
        let (mut digest, mut at) = (CRC32.digest(), start);
        for piece in bytes.chunks(CHUNK) {
            digest.update(piece);
            let mut words = [ERASED; CHUNK];
            words.iter_mut().zip(piece).for_each(|(place, byte)| *place = *byte);
            let len = piece.len().next_multiple_of(F::WRITE_SIZE);
            self.flash.write(at, words.get(..len).unwrap_or(&words))?;
            at += len as u32;
        }
        Ok(digest.finalize())
    }

    /// Reads the image of a header into a buffer. Returns whether it is there, whole.
    fn read(&mut self, number: usize, header: Header, into: &mut [u8]) -> Result<bool, F::Error> {
        if !self.matches(number, header)? {
            return Ok(false);
        }
        let Some(image) = into.get_mut(..header.len as usize) else { return Ok(false) };
        let (mut digest, mut at) = (CRC32.digest(), self.range(number).start + IMAGE_OFFSET);
        for piece in image.chunks_mut(CHUNK) {
            let mut words = [0; CHUNK];
            let len = piece.len().next_multiple_of(F::READ_SIZE);
            self.flash.read(at, words.get_mut(..len).unwrap_or_default())?;
            piece.iter_mut().zip(words).for_each(|(place, byte)| *place = byte);
            digest.update(piece);
            at += len as u32;
        }
        // What was read is what was checked.
        Ok(digest.finalize() == header.crc32)
    }

    /// The bytes of a slot are those of its header.
    fn matches(&mut self, number: usize, header: Header) -> Result<bool, F::Error> {
        let range = self.range(number);
        if header.len > range.end - range.start - IMAGE_OFFSET {
            return Ok(false);
        }
        let (mut digest, mut done) = (CRC32.digest(), 0);
        while done < header.len {
            let mut words = [0; CHUNK];
            let len = (header.len - done).min(CHUNK as u32) as usize;
            let read = len.next_multiple_of(F::READ_SIZE);
            let at = range.start + IMAGE_OFFSET + done;
            self.flash.read(at, words.get_mut(..read).unwrap_or_default())?;
            digest.update(words.get(..len).unwrap_or_default());
            done += len as u32;
        }
        Ok(digest.finalize() == header.crc32)
    }
}

/// Where a mark is: each in the room of the largest word.
fn mark_at(start: u32, which: usize) -> u32 {
    start + (HEADER + which * LARGEST_WORD) as u32
}

/// Slots with headers, the newest generation first.
fn newest_first(slots: [Slot; 2]) -> impl Iterator<Item = (Slot, Header)> {
    let [a, b] = slots;
    let is_newer = match (a.header, b.header) {
        // Generations wrap after 2³² images.
        (Some(a), Some(b)) => (b.generation.wrapping_sub(a.generation) as i32) > 0,
        (a, _) => a.is_none(),
    };
    let order = if is_newer { [b, a] } else { [a, b] };
    order.into_iter().filter_map(|slot| Some((slot, slot.header?)))
}
