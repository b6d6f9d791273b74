//! A lab's DBC: its messages by the names and identifiers that the file itself gives.

use can_dbc::{AttributeValue, ByteOrder, Dbc, Message, MessageId, Signal as DbcSignal};
use cathforce_bus::{EXTENDED, MAX_EXTENDED_ID, MAX_ID};

/// Identifier of the pseudo message that holds signals without a frame.
const NO_FRAME: u32 = 0xC000_0000;
/// Attributes in which editors keep names of more than 32 letters.
const LONG_MESSAGE: &str = "SystemMessageLongSymbol";
const LONG_SIGNAL: &str = "SystemSignalLongSymbol";

/// A DBC with at least one signal.
pub struct LabDbc {
    dbc: Dbc,
    /// Identifier as the file has it, with the mark of an extended one, and name of each message.
    written: Vec<(u64, String)>,
}

/// A signal and the message that it is in.
#[derive(Clone, Copy)]
pub struct Found<'a> {
    pub message: &'a Message,
    pub signal: &'a DbcSignal,
}

/// What an identifier of the file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Identifier {
    Base(u32),
    Extended(u32),
    /// More than 11 bits without the mark of an extended identifier, or more than 29 with it.
    Neither(u64),
    /// The signal is in no frame.
    NoFrame,
}

impl LabDbc {
    /// Reads a DBC, which must describe at least one signal.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        // Tools write Latin-1 as often as UTF-8; the two differ in comments and in `µ` and `°`.
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.to_owned(),
            Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
        };
        // The error names the line and what stands there.
        let dbc = Dbc::try_from(text.as_str()).map_err(|e| format!("this is not a DBC: {e}"))?;
        match dbc.messages.iter().any(|message| !message.signals.is_empty()) {
            true => Ok(Self { dbc, written: written(&text) }),
            false => Err("this DBC has no signal".into()),
        }
    }

    pub fn dbc(&self) -> &Dbc {
        &self.dbc
    }

    /// All signals, in the order of the file.
    pub fn signals(&self) -> impl Iterator<Item = Found<'_>> {
        let messages = self.dbc.messages.iter();
        messages
            .flat_map(|message| message.signals.iter().map(move |signal| Found { message, signal }))
    }

    /// The signals that a name may mean: `MESSAGE.SIGNAL` by their short or long names, or the identifier
    /// in place of the message, `0x321.SIGNAL`.
    pub fn named(&self, name: &str) -> Vec<Found<'_>> {
        let Some((of_message, of_signal)) = name.rsplit_once('.') else { return Vec::new() };
        let of_id = of_message.strip_prefix("0x").and_then(|hex| u32::from_str_radix(hex, 16).ok());
        let is_meant = |found: &Found<'_>| {
            let Found { message, signal } = *found;
            let by_id = || match self.identifier(message) {
                Identifier::Base(id) => of_id == Some(id),
                Identifier::Extended(id) => of_id == Some(id),
                _ => false,
            };
            let message_is = message.name == of_message
                || self.long_message(message) == Some(of_message)
                || by_id();
            let signal_is = signal.name == of_signal || self.long_signal(*found) == Some(of_signal);
            message_is && signal_is
        };
        self.signals().filter(is_meant).collect()
    }

    /// `MESSAGE.SIGNAL`, by the long names where there are some.
    pub fn full_name(&self, found: Found<'_>) -> String {
        let Found { message, signal } = found;
        let of_message = self.long_message(message).unwrap_or(&message.name);
        let of_signal = self.long_signal(found).unwrap_or(&signal.name);
        format!("{of_message}.{of_signal}")
    }

    /// The identifier of a message. The library keeps 16 bits of one that has no mark of an extended
    /// identifier, so that this looks it up in the text.
    pub fn identifier(&self, message: &Message) -> Identifier {
        let is_own = |(raw, name): &&(u64, String)| {
            *name == message.name && MessageId::try_from(*raw).ok() == Some(message.id)
        };
        let written = self.written.iter().filter(is_own).map(|(raw, _)| *raw);
        // Of several that look the same to the library, the doubtful one counts.
        let raw = written.max_by_key(|raw| matches!(kind(*raw), Identifier::Neither(_)));
        kind(raw.unwrap_or_else(|| u64::from(message.id.raw())))
    }

    fn long_message(&self, message: &Message) -> Option<&str> {
        let attributes = self.dbc.attribute_values_message.iter();
        let own = attributes.filter(|one| one.name == LONG_MESSAGE && one.message_id == message.id);
        text_of(own.map(|one| &one.value))
    }

    fn long_signal(&self, Found { message, signal }: Found<'_>) -> Option<&str> {
        let attributes = self.dbc.attribute_values_signal.iter();
        let own = attributes.filter(|one| {
            one.name == LONG_SIGNAL
                && one.message_id == message.id
                && one.signal_name == signal.name
        });
        text_of(own.map(|one| &one.value))
    }
}

impl Identifier {
    pub fn text(self) -> String {
        match self {
            Self::Base(id) => format!("{id:#05x}"),
            Self::Extended(id) => format!("{id:#010x} (29 bits)"),
            Self::Neither(id) => format!("{id:#x} (more than 11 bits without the mark of 29)"),
            Self::NoFrame => "no frame".into(),
        }
    }
}

/// Whether all bits of a signal are in its frame.
pub fn is_within_frame(Found { message, signal }: Found<'_>) -> bool {
    let bits = message.size.saturating_mul(8);
    let last = match signal.byte_order {
        ByteOrder::LittleEndian => signal.start_bit,
        // Counted from the top of byte 0 on, as the bits of such a signal follow one another.
        ByteOrder::BigEndian => (signal.start_bit / 8) * 8 + 7 - signal.start_bit % 8,
    };
    last.saturating_add(signal.size) <= bits
}

fn kind(raw: u64) -> Identifier {
    let Ok(word) = u32::try_from(raw) else { return Identifier::Neither(raw) };
    let id = word & !EXTENDED;
    match (word == NO_FRAME, word & EXTENDED != 0) {
        (true, _) => Identifier::NoFrame,
        (_, true) if id <= MAX_EXTENDED_ID => Identifier::Extended(id),
        (_, false) if id <= MAX_ID => Identifier::Base(id),
        _ => Identifier::Neither(raw),
    }
}

fn text_of<'a>(mut values: impl Iterator<Item = &'a AttributeValue>) -> Option<&'a str> {
    values.find_map(|value| match value {
        AttributeValue::String(text) if !text.is_empty() => Some(text.as_str()),
        _ => None,
    })
}

/// The identifier and the name of each line `BO_`, outside of strings: a comment may have such a line.
fn written(text: &str) -> Vec<(u64, String)> {
    let mut found = Vec::new();
    let mut is_string = false;
    for line in text.lines() {
        if !is_string && let Some(rest) = line.trim_start().strip_prefix("BO_") {
            let mut words = rest.split([' ', '\t', ':']).filter(|word| !word.is_empty());
            let id = words.next().and_then(|word| word.parse::<u64>().ok());
            found.extend(id.zip(words.next().map(str::to_owned)));
        }
        let mut letters = line.chars();
        while let Some(letter) = letters.next() {
            match letter {
                '\\' => drop(letters.next()),
                '"' => is_string = !is_string,
                _ => {}
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAB: &str = "VERSION \"\"\n\nBU_: Lab\n\n\
        BO_ 274923521 Wide: 8 Lab\n SG_ Feed : 0|16@1+ (0.01,0) [0|655] \"mm\" Lab\n\n\
        BO_ 2422407169 Marked: 8 Lab\n SG_ Feed : 0|16@1+ (0.01,0) [0|655] \"mm\" Lab\n\n\
        BO_ 802 Short: 3 Lab\n SG_ Inside : 8|16@1+ (1,0) [0|1] \"mm\" Lab\n \
        SG_ Beyond : 16|16@1+ (1,0) [0|1] \"mm\" Lab\n \
        SG_ Upwards : 15|16@0+ (1,0) [0|1] \"mm\" Lab\n \
        SG_ Downwards : 23|16@0+ (1,0) [0|1] \"mm\" Lab\n\n\
        BO_ 803 Twin: 8 Lab\n SG_ Feed : 0|16@1+ (1,0) [0|1] \"mm\" Lab\n\n\
        BO_ 804 Twin: 8 Lab\n SG_ Feed : 16|16@1+ (1,0) [0|1] \"mm\" Lab\n\n\
        BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 Vector__XXX\n \
        SG_ Lost : 0|16@1+ (1,0) [0|1] \"mm\" Lab\n\n\
        CM_ BO_ 803 \"moved from\nBO_ 999 Twin: 8 Lab\";\n\
        BA_DEF_ BO_  \"SystemMessageLongSymbol\" STRING ;\n\
        BA_DEF_ SG_  \"SystemSignalLongSymbol\" STRING ;\n\
        BA_DEF_DEF_  \"SystemMessageLongSymbol\" \"\";\n\
        BA_DEF_DEF_  \"SystemSignalLongSymbol\" \"\";\n\
        BA_ \"SystemMessageLongSymbol\" BO_ 802 \"ShortButOfALongNameThatIsCutAfter32Letters\";\n\
        BA_ \"SystemSignalLongSymbol\" SG_ 802 Inside \"InsideOfALongNameThatIsCutAfter32LettersToo\";\n";

    fn one<'a>(dbc: &'a LabDbc, name: &str) -> Found<'a> {
        match dbc.named(name)[..] {
            [found] => found,
            ref all => panic!("{name}: {}", all.len()),
        }
    }

    #[test]
    fn an_identifier_is_the_one_that_the_file_has() {
        let dbc = LabDbc::read(LAB.as_bytes()).unwrap();
        let id = |name| dbc.identifier(one(&dbc, name).message);
        assert_eq!(id("Wide.Feed"), Identifier::Neither(0x1063_0001));
        assert_eq!(id("Marked.Feed"), Identifier::Extended(0x1063_0001));
        assert_eq!(id("Short.Inside"), Identifier::Base(802));
        assert_eq!(id("VECTOR__INDEPENDENT_SIG_MSG.Lost"), Identifier::NoFrame);
    }

    #[test]
    fn of_two_messages_with_one_name_each_is_found_by_its_identifier() {
        let dbc = LabDbc::read(LAB.as_bytes()).unwrap();
        assert_eq!(dbc.named("Twin.Feed").len(), 2);
        assert_eq!(one(&dbc, "0x324.Feed").signal.start_bit, 16);
        let long = "ShortButOfALongNameThatIsCutAfter32Letters.InsideOfALongNameThatIsCutAfter32LettersToo";
        assert_eq!(dbc.full_name(one(&dbc, long)), long);
        assert!(dbc.named("Twin.Feeds").is_empty() && dbc.named("Feed").is_empty());
    }

    #[test]
    fn a_signal_beyond_its_frame_is_told_from_one_inside() {
        let dbc = LabDbc::read(LAB.as_bytes()).unwrap();
        let is_within = |name| is_within_frame(one(&dbc, name));
        let found =
            ["Short.Inside", "Short.Beyond", "Short.Upwards", "Short.Downwards"].map(is_within);
        assert_eq!(found, [true, false, true, false]);
    }
}
