//! Grip policy: which drive's load the operator feels, and whether any.
//!
//! The operator feels the guidewire while holding its button, and the catheter otherwise. Nothing is
//! felt while nobody holds the handle, or while the buttons of neither or of both instruments are
//! held, because it is then unclear which of them the operator moves.

/// The instrument whose load the operator feels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum HapticSource {
    #[default]
    Catheter,
    Guidewire,
}

impl HapticSource {
    /// The source while the guidewire's button is held, or not.
    pub(crate) fn for_guidewire_button(held: bool) -> Self {
        if held { Self::Guidewire } else { Self::Catheter }
    }
}

/// What the operator's hand holds, as far as frames have said so.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Grip {
    /// The handle is let go; said by the ENCODER frame.
    pub handle_released: bool,
    /// The handle is gripped; said by the master's own frames, `None` where they do not.
    pub handle_gripped: Option<bool>,
    /// The catheter's button is held; `None` where it has no button.
    pub catheter_button: Option<bool>,
    /// The guidewire's button is held.
    pub guidewire_button: bool,
}

impl Grip {
    /// Nothing is to be felt. A catheter without a button counts as held whenever the guidewire's
    /// button is not.
    pub fn is_released(self) -> bool {
        let neither_or_both =
            self.catheter_button.is_some_and(|held| held == self.guidewire_button);
        self.handle_released || self.handle_gripped == Some(false) || neither_or_both
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_felt_without_a_hand_on_the_handle() {
        assert!(!Grip::default().is_released());
        assert!(Grip { handle_released: true, ..Grip::default() }.is_released());
        for gripped in [true, false] {
            let grip = Grip { handle_gripped: Some(gripped), ..Grip::default() };
            assert_eq!(grip.is_released(), !gripped);
        }
    }

    #[test]
    fn nothing_is_felt_with_neither_or_both_buttons_held() {
        for (catheter_button, guidewire_button, released) in [
            (Some(true), false, false),
            (Some(false), true, false),
            (Some(true), true, true),
            (Some(false), false, true),
            (None, false, false),
            (None, true, false),
        ] {
            let grip = Grip { catheter_button, guidewire_button, ..Grip::default() };
            assert_eq!(grip.is_released(), released, "{grip:?}");
        }
    }
}
